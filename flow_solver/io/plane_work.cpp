#include "flow_solver/io/plane_work.hpp"

#include <algorithm>

#include "flow_solver/ranks/gather.hpp"

namespace ocublast::flow::inline OCU_PRECISION {
namespace {

// Work of what bodies bring, in round figures of that of a node of gas in a step (some 120 ns): a
// node in a body is passed over by most kernels, one on a cut line goes through a transposed
// scratch; a wall end has four ghosts to find, follow and interpolate in five passes. At a border
// the lines cut near it are summed one by one (some thousand of them take less than a thousandth of
// a step), and the wall ends near it are looked after by both ranks.
constexpr double body_node_work = 0.3;
constexpr double cut_node_work = 0.4;
constexpr double wall_end_work = 10.0;
constexpr double cut_border_work = 1.0;
constexpr int cut_border_reach = 40;

void add_work_of_lines(const Grid& grid, const CutLines& lines, std::size_t a, PlaneWork& work) {
  const std::size_t b = a == 0 ? 1 : 0, c = a == 2 ? 1 : 2;
  const auto add = [](std::vector<double>& planes, int at, double value) {
    planes[static_cast<std::size_t>(at)] += value;
  };
  for (const Segment& s : lines.segments) {
    for (int i = s.begin; i < s.end; ++i) add(work.of_plane[a], i, cut_node_work);
    add(work.of_plane[b], s.b, cut_node_work * (s.end - s.begin));
    add(work.of_plane[c], s.c, cut_node_work * (s.end - s.begin));
    for (const bool low : {true, false}) {
      if ((low ? s.wall_low : s.wall_high) < 0) continue;
      const int end = low ? s.begin : s.end - 1;
      add(work.of_plane[a], end, wall_end_work);
      add(work.of_plane[b], s.b, wall_end_work);
      add(work.of_plane[c], s.c, wall_end_work);
      const int from = std::max(s.begin + 1, low ? s.begin + 1 : s.end - cut_border_reach);
      const int to = std::min(s.end, low ? s.begin + cut_border_reach : s.end);
      for (int i = from; i < to; ++i) add(work.of_border[a], i, cut_border_work);
      std::array<int, 3> at{};
      at[a] = end;
      at[b] = s.b;
      at[c] = s.c;
      for (std::size_t d = 0; d < 3; ++d) {
        for (int i = std::max(0, at[d] - n_ghost); i < std::min(grid.axis[d].n, at[d] + n_ghost);
             ++i)
          add(work.of_border[d], i, wall_end_work);
      }
    }
  }
}

}  // namespace

PlaneWork work_of_planes(const Grid& grid, const ImmersedBoundary& bodies) {
  PlaneWork work;
  for (std::size_t a = 0; a < 3; ++a) {
    work.of_plane[a].assign(static_cast<std::size_t>(grid.axis[a].n), 0.0);
    work.of_border[a] = work.of_plane[a];
  }
  const auto tags = bodies.tags();
  for_nodes({{0, 0, 0}, {grid.axis[0].n, grid.axis[1].n, grid.axis[2].n}},
            [&](int i, int j, int k) {
              const double node = tags[place_of(grid, i, j, k)] == tag_fluid ? 1.0 : body_node_work;
              work.of_plane[0][static_cast<std::size_t>(i)] += node;
              work.of_plane[1][static_cast<std::size_t>(j)] += node;
              work.of_plane[2][static_cast<std::size_t>(k)] += node;
            });
  for (std::size_t a = 0; a < 3; ++a)
    if (grid.axis[a].present) add_work_of_lines(grid, bodies.lines(static_cast<int>(a)), a, work);
  return work;
}

}  // namespace ocublast::flow
