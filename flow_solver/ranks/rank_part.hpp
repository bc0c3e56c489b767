#pragma once

#include <array>
#include <vector>

#include "coupler/base/ranks.hpp"
#include "flow_solver/boundary/boundary.hpp"
#include "flow_solver/grid/grid.hpp"
#include "flow_solver/grid/precision.hpp"
#include "flow_solver/ranks/plane_work.hpp"

namespace ocublast::flow::inline OCU_PRECISION {

/// Least nodes of a block along a direction that is divided: both ends' known faces and the
/// filter's stencil fit (as on a whole line).
inline constexpr int least_block = 8;

/// A grid cut into blocks, one per rank: rank = (block_z n_y + block_y) n_x + block_x.
struct RankBlocks {
  std::array<int, 3> parts{1, 1, 1};
  std::array<std::vector<int>, 3>
      begin;  ///< [parts + 1] first node of each part along each direction

  [[nodiscard]] int rank_of(const std::array<int, 3>& block) const {
    return (block[2] * parts[1] + block[1]) * parts[0] + block[0];
  }
  [[nodiscard]] std::array<int, 3> block_of(int rank) const {
    return {rank % parts[0], rank / parts[0] % parts[1], rank / (parts[0] * parts[1])};
  }
};

/// Cuts the grid into `n_ranks` blocks, by `wanted` if it is not zero, else with the least area
/// between them; equal areas: along z rather than y rather than x, as messages along z travel
/// during the sweeps. Where the work is given, blocks have equal work instead of equally many
/// nodes, and borders that add work are moved or avoided. Throws CaseError when a block would have
/// fewer than least_block nodes along a divided direction.
[[nodiscard]] RankBlocks cut_grid(const Grid& grid, int n_ranks, const std::array<int, 3>& wanted,
                                  const PlaneWork& work = {});

/// This rank's part of a grid.
struct RankPart {
  RankPart(const Ranks& ranks, Grid grid, const Boundaries& boundaries,
           const std::array<int, 3>& wanted, const PlaneWork& work = {});

  const Ranks* ranks;
  Grid whole;
  Boundaries whole_boundaries;
  RankBlocks blocks;
  std::array<int, 3> block{};
  std::array<int, 3> begin{}, end{};  ///< nodes of the whole grid
  Grid grid;                          ///< the block; ghosts lie where the neighbours' nodes do
  Boundaries boundaries;              ///< of kind neighbour where another rank goes on

  [[nodiscard]] bool split(int axis) const {
    return blocks.parts[static_cast<std::size_t>(axis)] > 1;
  }
  /// Rank beyond the low or high end of the block; -1: the domain ends there.
  [[nodiscard]] int neighbour(int axis, bool low) const;
};

}  // namespace ocublast::flow
