#include "flow_solver/ranks/rank_part.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "coupler/base/errors.hpp"

namespace ocublast::flow::inline OCU_PRECISION {
namespace {

bool fits(const Grid& grid, const std::array<int, 3>& parts) {
  for (std::size_t a = 0; a < 3; ++a) {
    if (parts[a] > 1 && (!grid.axis[a].present || grid.axis[a].n < parts[a] * least_block))
      return false;
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

/// Work of a node at a border, in that of a step at a node: two ranks on 128^3 nodes take 15 %
/// longer than half the time of one, for 64 planes each.
constexpr double border_node_work = 10.0;

/// First node of each part: parts of equal work, a border as near to its place as what it adds
/// allows.
std::vector<int> cut_by_work(const std::vector<double>& of_plane,
                             const std::vector<double>& of_border, int parts) {
  const int n = static_cast<int>(of_plane.size());
  std::vector<double> before(of_plane.size() + 1, 0.0);
  for (int i = 0; i < n; ++i)
    before[static_cast<std::size_t>(i) + 1] =
        before[static_cast<std::size_t>(i)] + of_plane[static_cast<std::size_t>(i)];
  std::vector<int> begin{0};
  for (int p = 1; p < parts; ++p) {
    const double goal = before.back() * p / parts;
    int best = 0;
    double least = 0.0;
    for (int i = begin.back() + least_block; i <= n - (parts - p) * least_block; ++i) {
      const auto at = static_cast<std::size_t>(i);
      const double cost = std::abs(before[at] - goal) + of_border[at];
      if (best > 0 && cost >= least) continue;
      best = i;
      least = cost;
    }
    begin.push_back(best);
  }
  begin.push_back(n);
  return begin;
}

/// First nodes of the parts along an axis.
std::vector<int> cut_axis_at(const Grid& grid, std::size_t axis, int parts, const PlaneWork& work) {
  if (parts > 1 && !work.of_plane[axis].empty())
    return cut_by_work(work.of_plane[axis], work.of_border[axis], parts);
  std::vector<int> begin;
  for (int p = 0; p <= parts; ++p)
    begin.push_back(static_cast<int>(static_cast<long>(grid.axis[axis].n) * p / parts));
  return begin;
}

/// What the slowest rank has to do, as far as the planes tell: the shares of its planes along each
/// axis, its borders' nodes and what they add.
double work_of_slowest(const Grid& grid, const std::array<int, 3>& parts, const PlaneWork& work) {
  double share = 1.0, all = 0.0, borders = 0.0;
  const int n_ranks = parts[0] * parts[1] * parts[2];
  for (std::size_t a = 0; a < 3; ++a) {
    if (work.of_plane[a].empty()) continue;
    const std::vector<int> begin = cut_axis_at(grid, a, parts[a], work);
    double total = 0.0, largest = 0.0, added = 0.0;
    for (std::size_t p = 0; p + 1 < begin.size(); ++p) {
      double part = 0.0;
      for (int i = begin[p]; i < begin[p + 1]; ++i)
        part += work.of_plane[a][static_cast<std::size_t>(i)];
      total += part;
      largest = std::max(largest, part);
      if (p == 0) continue;
      const double face = static_cast<double>(grid.n_cells()) / grid.axis[a].n;
      added = std::max(
          added, border_node_work * face + work.of_border[a][static_cast<std::size_t>(begin[p])]);
    }
    share *= largest / total;
    all = total;
    borders += added * parts[a] * std::min(2, parts[a] - 1) / n_ranks;
  }
  return share * all + borders;
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

RankBlocks cut_grid(const Grid& grid, int n_ranks, const std::array<int, 3>& wanted,
                    const PlaneWork& work) {
  const bool by_work = std::any_of(work.of_plane.begin(), work.of_plane.end(),
                                   [](const auto& w) { return !w.empty(); });
  RankBlocks blocks;
  bool found = false;
  double least = 0.0;
  for (int x = 1; x <= n_ranks; ++x) {
    for (int y = 1; x * y <= n_ranks; ++y) {
      if (n_ranks % (x * y) != 0) continue;
      const std::array<int, 3> parts{x, y, n_ranks / (x * y)};
      if (!fits(grid, parts) || (wanted[0] > 0 && parts != wanted)) continue;
      const double area = by_work ? work_of_slowest(grid, parts, work) : area_between(grid, parts);
      if (found && area >= least)
        continue;  // the first of equals has the fewest cuts along x, then y
      found = true;
      least = area;
      blocks.parts = parts;
    }
  }
  if (!found) {
    const auto& a = grid.axis;
    throw CaseError(fmt::format(
        "flow: {} ranks cannot share {} x {} x {} nodes{}: a block needs at least {} nodes along a "
        "direction that is "
        "divided; take fewer ranks or a finer grid",
        n_ranks, a[0].n, a[1].n, a[2].n,
        wanted[0] > 0 ? fmt::format(" in {} x {} x {} blocks", wanted[0], wanted[1], wanted[2])
                      : "",
        least_block));
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    blocks.begin[axis] = cut_axis_at(grid, axis, blocks.parts[axis], work);
  }
  return blocks;
}

RankPart::RankPart(const Ranks& ranks_in, Grid grid_in, const Boundaries& boundaries_in,
                   const std::array<int, 3>& wanted, const PlaneWork& work)
    : ranks(&ranks_in),
      whole(std::move(grid_in)),
      whole_boundaries(boundaries_in),
      blocks(cut_grid(whole, ranks_in.size(), wanted, work)),
      block(blocks.block_of(ranks_in.rank())),
      boundaries(boundaries_in) {
  grid.geometry = whole.geometry;
  for (std::size_t a = 0; a < 3; ++a) {
    const auto at = static_cast<std::size_t>(block[a]);
    begin[a] = blocks.begin[a][at];
    end[a] = blocks.begin[a][at + 1];
    grid.axis[a] = cut_axis(whole.axis[a], begin[a], end[a]);
    for (const bool low : {true, false}) {
      if (neighbour(static_cast<int>(a), low) >= 0)
        boundaries[2 * a + (low ? 0 : 1)] = {.kind = BoundaryKind::neighbour};
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
