#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "flow_solver/immersed/snapped_grid.hpp"
#include "flow_solver/immersed/surface.hpp"

namespace ocublast::flow {

/// A facet on a grid line.
struct Crossing {
  double position = 0.0;  ///< along the line, in units of the snapped grid
  std::int32_t facet = 0;
  std::int32_t turn = 0;  ///< +1: the line enters the body here (going up), -1: it leaves
};

/// All crossings of one body with the lines of one direction: those of line l are
/// list[first[l]] .. list[first[l + 1] - 1], ascending. Line l = c * n_b + b, see Segment.
struct LineCrossings {
  std::vector<std::uint32_t> first;
  std::vector<Crossing> list;
  std::size_t open_lines = 0;  ///< lines whose turns do not add up to zero: a hole in the surface
};

/// The two directions across direction a, ascending.
[[nodiscard]] constexpr std::array<int, 2> across(int a) noexcept {
  return {a == 0 ? 1 : 0, a == 2 ? 1 : 2};
}

/// Does the line along direction a through (u, w) (the coordinates across, in units) pass through
/// the triangle? Exact; a line through an edge or a vertex counts as moved by (eps, eps^2), so that
/// it meets exactly one of the facets around. Returns the turn, 0: no; sets `position`.
[[nodiscard]] int meet_triangle(const Point64& p0, const Point64& p1, const Point64& p2, int a,
                                std::int64_t u, std::int64_t w, double& position) noexcept;

/// Crossings of a closed surface with all lines of direction a. Cost: proportional to the facets
/// and to the lines under each.
[[nodiscard]] LineCrossings compute_crossings(const SnappedGrid& grid, int a,
                                              const SurfaceTopology& topology,
                                              std::span<const Point64> vertices);

}  // namespace ocublast::flow
