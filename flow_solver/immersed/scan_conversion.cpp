// Scan conversion of a closed triangulated surface along grid lines. Vertices and lines have
// integer coordinates, so the orientation of (edge, line) has an exact sign; ties are broken by a
// symbolic shift of the line, the same for all facets: every line of a closed surface closes.
#include "flow_solver/immersed/scan_conversion.hpp"

#include <omp.h>

#include <algorithm>
#include <numeric>
#include <utility>

namespace ocublast::flow {
namespace {

__extension__ typedef __int128 Int128;

/// Products of differences below this fit in 64 bits with room for one sum.
constexpr std::int64_t largest_short_extent = std::int64_t{1} << 30;

/// Twice the area of (from, to, line), positive with the line on the left.
template <class Wide>
struct EdgeTest {
  Wide du, dw, value;
  EdgeTest(std::int64_t fu, std::int64_t fw, std::int64_t tu, std::int64_t tw, std::int64_t u,
           std::int64_t w)
      : du(tu - fu),
        dw(tw - fw),
        value(du * static_cast<Wide>(w - fw) - dw * static_cast<Wide>(u - fu)) {}
  /// On the left after the shift of the line by (eps, eps^2).
  [[nodiscard]] bool left() const {
    return value > 0 || (value == 0 && (dw < 0 || (dw == 0 && du > 0)));
  }
};

template <class Wide>
int meet(const Point64* p, int a, std::int64_t u, std::int64_t w, double& position) noexcept {
  const auto [b, c] = across(a);
  const Point64* q1 = p + 1;
  const Point64* q2 = p + 2;
  const Wide area = static_cast<Wide>((*q1)[b] - p[0][b]) * static_cast<Wide>((*q2)[c] - p[0][c]) -
                    static_cast<Wide>((*q1)[c] - p[0][c]) * static_cast<Wide>((*q2)[b] - p[0][b]);
  if (area == 0) return 0;
  if (area < 0) std::swap(q1, q2);
  const EdgeTest<Wide> e01(p[0][b], p[0][c], (*q1)[b], (*q1)[c], u, w);
  if (!e01.left()) return 0;
  const EdgeTest<Wide> e12((*q1)[b], (*q1)[c], (*q2)[b], (*q2)[c], u, w);
  if (!e12.left()) return 0;
  const EdgeTest<Wide> e20((*q2)[b], (*q2)[c], p[0][b], p[0][c], u, w);
  if (!e20.left()) return 0;
  // Differences from one vertex: exact where the facet is square to the line.
  const double twice = static_cast<double>(area < 0 ? -area : area);
  position = static_cast<double>(p[0][a]) +
             (static_cast<double>(e20.value) * static_cast<double>((*q1)[a] - p[0][a]) +
              static_cast<double>(e01.value) * static_cast<double>((*q2)[a] - p[0][a])) /
                 twice;
  // The normal's component along a has the sign of the area, reversed for a = 1 (ascending, not
  // cyclic, order of the two directions across). It points out of the body.
  const bool normal_up = (area > 0) != (a == 1);
  return normal_up ? -1 : 1;
}

struct LineHit {
  std::uint32_t line = 0;
  Crossing crossing;
};

/// Index range [first, last) of nodes inside [low, high].
std::pair<int, int> nodes_between(const std::vector<std::int64_t>& node, std::int64_t low,
                                  std::int64_t high) {
  const auto from = std::lower_bound(node.begin(), node.end(), low);
  const auto to = std::upper_bound(from, node.end(), high);
  return {static_cast<int>(from - node.begin()), static_cast<int>(to - node.begin())};
}

void scan_facet(const SnappedGrid& grid, int a, std::span<const Point64> vertices, const Corners& v,
                std::int32_t f, std::vector<LineHit>& hits) {
  const auto [b, c] = across(a);
  const Point64& p0 = vertices[v[0]];
  const Point64& p1 = vertices[v[1]];
  const Point64& p2 = vertices[v[2]];
  const auto [b0, b1] =
      nodes_between(grid.node(b), std::min({p0[b], p1[b], p2[b]}), std::max({p0[b], p1[b], p2[b]}));
  if (b0 == b1) return;
  const auto [c0, c1] =
      nodes_between(grid.node(c), std::min({p0[c], p1[c], p2[c]}), std::max({p0[c], p1[c], p2[c]}));
  const auto n_b = static_cast<int>(grid.node(b).size());
  for (int n = c0; n < c1; ++n) {
    for (int m = b0; m < b1; ++m) {
      Crossing crossing{.facet = f};
      crossing.turn =
          meet_triangle(p0, p1, p2, a, grid.node(b)[m], grid.node(c)[n], crossing.position);
      if (crossing.turn != 0) hits.push_back({static_cast<std::uint32_t>(n * n_b + m), crossing});
    }
  }
}

/// Entering before leaving at the same place: bodies face to face leave no sliver of gas between.
bool comes_before(const Crossing& x, const Crossing& y) {
  if (x.position != y.position) return x.position < y.position;
  return x.turn != y.turn ? x.turn > y.turn : x.facet < y.facet;
}

LineCrossings sort_by_line(const std::vector<std::vector<LineHit>>& parts, std::size_t n_lines) {
  LineCrossings lines;
  lines.first.assign(n_lines + 1, 0);
  for (const auto& part : parts) {
    for (const LineHit& hit : part) ++lines.first[hit.line + 1];
  }
  std::partial_sum(lines.first.begin(), lines.first.end(), lines.first.begin());
  lines.list.resize(lines.first.back());
  std::vector<std::uint32_t> next(lines.first.begin(), lines.first.end() - 1);
  for (const auto& part : parts) {
    for (const LineHit& hit : part) lines.list[next[hit.line]++] = hit.crossing;
  }
  for (std::size_t l = 0; l < n_lines; ++l) {
    const auto begin = lines.list.begin() + lines.first[l];
    const auto end = lines.list.begin() + lines.first[l + 1];
    if (begin == end) continue;
    std::sort(begin, end, comes_before);
    int sum = 0;
    for (auto at = begin; at != end; ++at) sum += at->turn;
    lines.open_lines += sum != 0 ? 1 : 0;
  }
  return lines;
}

}  // namespace

int meet_triangle(const Point64& p0, const Point64& p1, const Point64& p2, int a, std::int64_t u,
                  std::int64_t w, double& position) noexcept {
  const auto [b, c] = across(a);
  const auto [b_low, b_high] = std::minmax({p0[b], p1[b], p2[b], u});
  const auto [c_low, c_high] = std::minmax({p0[c], p1[c], p2[c], w});
  const Point64 p[3] = {p0, p1, p2};
  const bool is_short =
      b_high - b_low < largest_short_extent && c_high - c_low < largest_short_extent;
  return is_short ? meet<std::int64_t>(p, a, u, w, position) : meet<Int128>(p, a, u, w, position);
}

LineCrossings compute_crossings(const SnappedGrid& grid, int a, const SurfaceTopology& topology,
                                std::span<const Point64> vertices) {
  const auto [b, c] = across(a);
  const int n_parts = omp_get_max_threads();
  std::vector<std::vector<LineHit>> parts(static_cast<std::size_t>(n_parts));
  const std::size_t n = topology.facet.size();
#pragma omp parallel for schedule(static, 1) if (n > 2000)
  for (int part = 0; part < n_parts; ++part) {
    auto& hits = parts[static_cast<std::size_t>(part)];
    const std::size_t begin =
        n * static_cast<std::size_t>(part) / static_cast<std::size_t>(n_parts);
    const std::size_t end =
        n * static_cast<std::size_t>(part + 1) / static_cast<std::size_t>(n_parts);
    for (std::size_t f = begin; f < end; ++f) {
      scan_facet(grid, a, vertices, topology.facet[f], static_cast<std::int32_t>(f), hits);
    }
  }
  return sort_by_line(parts, grid.node(b).size() * grid.node(c).size());
}

}  // namespace ocublast::flow
