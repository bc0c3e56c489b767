#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "flow_solver/immersed/bodies.hpp"
#include "flow_solver/immersed/cut_lines.hpp"

namespace ocublast::flow {

/// The end of a segment at a body. Order: that of the segments, lower end first.
struct WallEnd {
  std::int32_t line = 0;  ///< c * n_b + b
  std::int32_t node = 0;  ///< last fluid node of the segment
  std::int32_t side = 0;  ///< +1: the wall is above that node, -1: below
  std::int32_t body = -1;
  std::int32_t facet =
      -1;                 ///< crossed facet; -1: the mouth of a blocked gap, a wall without a facet
  double position = 0.0;  ///< m, along the line
};

/// Result of cutting all lines: tags, segments, wall ends.
struct CutGrid {
  std::vector<std::uint8_t> tag;  ///< [n_k, n_j, n_i] fluid, body or blocked
  std::array<CutLines, 3> lines;  ///< without ghosts
  std::array<std::vector<WallEnd>, 3> walls;
  /// bit a: a body thinner than the spacing lies between this node and the next one along a
  std::vector<std::uint8_t> thin_cut;
  std::size_t n_thin = 0;  ///< cuts between two fluid nodes
  std::size_t blocked_segments = 0;
  std::size_t open_lines = 0;
  double smallest_gap = 0.0;  ///< in cells, 0: none
};

/// Tags every node from the lines of the first present direction and cuts the lines of all. A
/// segment between two walls closer than `gap_block` cells is tagged blocked and all lines are cut
/// anew, at most four times. `domain_wall`: faces of the domain that count as walls for this rule.
/// Uses the memory of what `cut` held before.
void cut_grid(const Grid& grid, const Bodies& bodies, double gap_block,
              const std::array<bool, 6>& domain_wall, CutGrid& cut);

}  // namespace ocublast::flow
