#include "flow_solver/ranks/rank_part.hpp"

#include <utility>

#include <fmt/format.h>

#include "coupler/base/errors.hpp"

namespace ocublast::flow {
namespace {

bool fits(const Grid& grid, const std::array<int, 3>& parts) {
  for (std::size_t a = 0; a < 3; ++a) {
    if (parts[a] > 1 && (!grid.axis[a].present || grid.axis[a].n < parts[a] * least_block)) return false;
  }
  return true;
}

/// Nodes that face another rank.
double area_between(const Grid& grid, const std::array<int, 3>& parts) {
  double area = 0.0;
  for (std::size_t a = 0; a < 3; ++a) {
    area += (parts[a] - 1) * static_cast<double>(grid.n_cells()) / grid.axis[a].n;
  }
  return area;
}

Axis cut_axis(const Axis& axis, int begin, int end) {
  if (!axis.present) return axis;
  Axis part;
  part.n = end - begin;
  part.present = true;
  const auto face = [&](int i) { return 0.5 * (axis.x(i - 1) + axis.x(i)); };
  part.min = begin == 0 ? axis.min : face(begin);
  part.max = end == axis.n ? axis.max : face(end);
  const auto cut = [&](const std::vector<double>& v) {
    return std::vector<double>(v.begin() + begin, v.begin() + end + 2 * n_ghost);
  };
  part.node = cut(axis.node);
  part.jacobian = cut(axis.jacobian);
  part.inverse = cut(axis.inverse);
  return part;
}

}  // namespace

RankBlocks cut_grid(const Grid& grid, int n_ranks, const std::array<int, 3>& wanted) {
  RankBlocks blocks;
  bool found = false;
  double least = 0.0;
  for (int x = 1; x <= n_ranks; ++x) {
    for (int y = 1; x * y <= n_ranks; ++y) {
      if (n_ranks % (x * y) != 0) continue;
      const std::array<int, 3> parts{x, y, n_ranks / (x * y)};
      if (!fits(grid, parts) || (wanted[0] > 0 && parts != wanted)) continue;
      const double area = area_between(grid, parts);
      if (found && area >= least) continue;  // the first of equals has the fewest cuts along x, then y
      found = true;
      least = area;
      blocks.parts = parts;
    }
  }
  if (!found) {
    const auto& a = grid.axis;
    throw CaseError(fmt::format(
        "flow: {} ranks cannot share {} x {} x {} nodes{}: a block needs at least {} nodes along a direction that is "
        "divided; take fewer ranks or a finer grid", n_ranks, a[0].n, a[1].n, a[2].n,
        wanted[0] > 0 ? fmt::format(" in {} x {} x {} blocks", wanted[0], wanted[1], wanted[2]) : "", least_block));
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (int p = 0; p <= blocks.parts[axis]; ++p) {
      blocks.begin[axis].push_back(static_cast<int>(static_cast<long>(grid.axis[axis].n) * p / blocks.parts[axis]));
    }
  }
  return blocks;
}

RankPart::RankPart(const Ranks& ranks_in, Grid grid_in, const Boundaries& boundaries_in,
                   const std::array<int, 3>& wanted)
    : ranks(&ranks_in),
      whole(std::move(grid_in)),
      whole_boundaries(boundaries_in),
      blocks(cut_grid(whole, ranks_in.size(), wanted)),
      block(blocks.block_of(ranks_in.rank())),
      boundaries(boundaries_in) {
  grid.geometry = whole.geometry;
  for (std::size_t a = 0; a < 3; ++a) {
    const auto at = static_cast<std::size_t>(block[a]);
    begin[a] = blocks.begin[a][at];
    end[a] = blocks.begin[a][at + 1];
    grid.axis[a] = cut_axis(whole.axis[a], begin[a], end[a]);
    for (const bool low : {true, false}) {
      if (neighbour(static_cast<int>(a), low) >= 0) boundaries[2 * a + (low ? 0 : 1)] = {.kind = BoundaryKind::neighbour};
    }
  }
}

int RankPart::neighbour(int axis, bool low) const {
  const auto a = static_cast<std::size_t>(axis);
  const int parts = blocks.parts[a];
  if (parts == 1) return -1;
  std::array<int, 3> at = block;
  at[a] += low ? -1 : 1;
  if (at[a] < 0 || at[a] == parts) {
    if (whole_boundaries[2 * a].kind != BoundaryKind::periodic) return -1;
    at[a] = (at[a] + parts) % parts;
  }
  return blocks.rank_of(at);
}

}  // namespace ocublast::flow
