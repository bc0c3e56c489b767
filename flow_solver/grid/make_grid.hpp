#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "flow_solver/grid/grid.hpp"

namespace ocublast::flow {

/// Buffer of growing cells added *outside* an end of the domain (numerics: a wave that leaves must
/// not come back in time). No layer: cells = 0.
struct StretchLayer {
  int cells = 0;
  double ratio = 1.1;  ///< growth from cell to cell
};

/// How one direction is divided. Spacing is honoured up to the rounding to a whole number of cells.
struct AxisSpec {
  bool present = true;      ///< false: an absent direction (one cell, no flux)
  double min = 0.0;         ///< m
  double max = 1.0;         ///< m
  double spacing = 0.01;    ///< m, largest spacing inside [min, max]
  bool refined = false;     ///< whether the fine zone below holds
  double zone_min = 0.0;    ///< m
  double zone_max = 0.0;    ///< m
  double zone_spacing = 0;  ///< m, spacing inside the zone
  double growth = 1.05;     ///< ratio of neighbouring cells outside the zone, until `spacing`
  std::vector<double>
      nodes;  ///< m, cell centres inside [min, max]; given, they replace the spacing
  StretchLayer low;
  StretchLayer high;
  bool periodic = false;  ///< ghost nodes repeat the other end; excludes layers
};

/// Nodes and jacobians of one direction. The jacobian is the difference of face positions that
/// solve the same compact system as the fluxes, so that the sum of jacobians is the length and a
/// linear function is differentiated exactly. Throws CaseError for a spec without a positive cell.
[[nodiscard]] Axis make_axis(const AxisSpec& spec);
/// Uniform direction of n cells.
[[nodiscard]] Axis make_uniform_axis(double min, double max, int n, bool periodic = false);
/// Direction through given cell centres (ascending) between two end faces.
[[nodiscard]] Axis make_axis_from_nodes(double min, double max, std::span<const double> nodes,
                                        bool periodic);
/// What is wrong with cell centres between two end faces, empty for nothing: they must rise, lie
/// inside, be at least eight, and neighbouring cells must differ by a factor of at most two.
[[nodiscard]] std::string fault_of_nodes(double min, double max, std::span<const double> nodes);
/// A direction that does not exist: one cell of unit size.
[[nodiscard]] Axis make_absent_axis();

[[nodiscard]] Grid make_grid(const std::array<AxisSpec, 3>& specs,
                             Geometry geometry = Geometry::cartesian);
/// Volume (area, length) of cell (i, j, k): product of the jacobians of present directions; of the
/// whole shell or ring on a radial grid.
[[nodiscard]] double cell_volume(const Grid& grid, int i, int j, int k);

}  // namespace ocublast::flow
