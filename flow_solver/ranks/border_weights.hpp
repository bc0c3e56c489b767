#pragma once

#include <vector>

#include "flow_solver/numerics/kernel.hpp"
#include "flow_solver/numerics/line_table.hpp"

namespace ocublast::flow::inline OCU_PRECISION {

/// Which of the two solves of a line.
enum class LineSolve { flux, filter };

/// A line over all ranks.
struct WholeLine {
  int n = 0;  ///< nodes
  LineEnd low = LineEnd::ghosted, high = LineEnd::ghosted;
  LineScheme scheme;
};

/// Weights of this rank's nodes in the fluxes of the faces around a border. The solve is linear:
/// the flux of a face is a row of the inverse of the line's system times the right side, which is a
/// sum over nodes. The weights fall by the decay of the inverse from node to node (0.38 for compact
/// 6, 0.45 for compact 8, 0.70 for the filter at alpha 0.47); nodes whose weights are all below
/// least_weight are left out.
struct BorderWeights {
  int first = 0,
      last = 0;   ///< nodes [first, last), counted in the rank's block; domain ghosts included
  int faces = 0;  ///< border - known + 1 .. border + known - 1
  std::vector<double> weight;  ///< [node, face, parity class]
  /// Beyond the stencils of all faces the weights of different faces are proportional (the inverse
  /// of a tridiagonal matrix has rank one on either side of its diagonal): nodes outside
  /// [near_first, near_last) need one sum only, times `ratio` [face, parity class] of each face to
  /// the first.
  int near_first = 0, near_last = 0;
  std::vector<double> ratio;
};

/// Dropped weights change a flux by less than least_weight / (1 - 0.70) = 3e-15 of the largest
/// value in the line: some ten roundings.
inline constexpr double least_weight = 1e-15;

[[nodiscard]] constexpr int known_faces(LineSolve solve, const LineScheme& scheme) noexcept {
  return solve == LineSolve::filter ? known_filter_faces : known_flux_faces(scheme.eighth_order);
}

/// Weights of the block [begin, end) of the line for the border at face `border` (a periodic line's
/// first face is 0). Where the block ends with the line, its four ghosts count too; those of a
/// mirrored end enter the filter through the nodes they copy.
[[nodiscard]] BorderWeights make_border_weights(const WholeLine& line, LineSolve solve, int border,
                                                int begin, int end);

}  // namespace ocublast::flow
