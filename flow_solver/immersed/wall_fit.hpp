#pragma once

#include <array>

#include "flow_solver/immersed/ghost_stencil.hpp"

namespace ocublast::flow {

/// Nodes in front of a wall whose weighted sum is the value at one of its points.
struct WallFit {
  struct Node {
    NodeIndex at{};
    double mean = 0.0;      ///< weight without any slope, never negative
    double linear = 0.0;    ///< for a field linear along the wall and constant normal to it
    double curved = 0.0;    ///< for a field of second order
    double distance = 0.0;  ///< m, from the wall's plane
  };
  static constexpr std::size_t most_nodes = 128;
  std::array<Node, most_nodes> node;
  std::size_t n = 0;  ///< 0: too few nodes within reach
};

/// Weights, sum 1, of the fluid nodes within 2.25 spacings of `point` and in front of the plane
/// (point, normal): moving least squares (Lancaster and Salkauskas 1981, doi:10.2307/2007507) with
/// a weight that vanishes at the rim of the reach and at the wall. A node thus comes and goes with
/// weight zero, so that the value does not jump when a moving wall passes nodes. The `curved`
/// weights fit all terms of second order but those odd in the distance from the wall, as far as the
/// nodes tell them apart; the caller takes each value to the wall by its slope there. `from`: see
/// FluidNodes::usable.
[[nodiscard]] WallFit fit_at_wall(const FluidNodes& nodes, const Vec3& point, const Vec3& normal,
                                  const NodeIndex* from);

/// What a fit reads of the fields.
struct FitSample {
  Sample gas;  ///< mean of pressure and temperature (density follows) and velocity
  double beside =
      0.0;  ///< Pa, adds to that pressure: momentum_transport, slope and curvature along the fit
  double distance = 0.0;  ///< m, of the pressure with what is beside it from the wall
};
/// Curved where the gas is smooth. Where a shock is on its way to the wall or back the parabola
/// through it overshoots: the curved part then fades with the share of the transport in the
/// pressure.
[[nodiscard]] FitSample sample(const WallFit& fit, const GasNodes& W, const Vec3& velocity,
                               const Vec3& normal, const Gas& gas) noexcept;

}  // namespace ocublast::flow
