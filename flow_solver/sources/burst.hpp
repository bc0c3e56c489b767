#pragma once

#include <array>
#include <vector>

#include "flow_solver/boundary/boundary.hpp"
#include "flow_solver/gas/gas.hpp"
#include "flow_solver/grid/grid.hpp"

namespace ocublast::flow {

/// Ball of hot gas at rest. In 2-D a disc (energy per m), in 1-D a slab.
struct Burst {
  std::array<double, 3> center{};  ///< m
  double radius = 0.0;             ///< m
  double energy = 0.0;             ///< J above ambient of the whole ball; 0: `pressure` holds
  double pressure = 0.0;           ///< Pa
  double temperature = 0.0;        ///< K of the ball; unused with `mass`
  double mass = 0.0;               ///< kg above ambient of the whole ball; 0: `temperature` holds
};

/// A burst as it lies on a grid.
struct BurstOnGrid {
  std::vector<double> fraction;  ///< [n_k, n_j, n_i] part of each cell inside the ball
  double pressure = 0.0;         ///< Pa of the ball
  double density = 0.0;          ///< kg/m^3 of the ball
  double volume = 0.0;           ///< m^3 that the ball has on the grid
  double energy = 0.0;           ///< J above ambient that the grid receives
  double mass = 0.0;             ///< kg above ambient that the grid receives
};

/// Lays a burst on the grid by volume fractions, so that its front starts in the right place on any
/// grid (a jump between nodes shifts the shock by up to 0.25 cells for good). Where the energy is
/// given, the ball's pressure is set so that the grid receives exactly the share of the energy that
/// lies inside the domain (a plane of symmetry through the centre: one half); the same for a given
/// mass. Throws CaseError when no cell is touched.
[[nodiscard]] BurstOnGrid make_burst(const Grid& grid, const Gas& gas, const Burst& burst,
                                     double ambient_pressure, double ambient_density);

/// State of a cell that holds the fraction `f` of a burst: mass and energy mix by volume.
[[nodiscard]] State mix_burst(const State& outside, const BurstOnGrid& burst, double f);

}  // namespace ocublast::flow
