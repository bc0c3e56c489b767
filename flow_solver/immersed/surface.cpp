#include "flow_solver/immersed/surface.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>
#include <numeric>

namespace ocublast::flow {
namespace {

/// Directed edge of a facet.
struct Edge {
  std::int32_t from = 0;
  std::int32_t to = 0;
  std::int32_t facet = 0;
  std::int32_t side = 0;
  [[nodiscard]] bool before(std::int32_t a, std::int32_t b) const {
    return from != a ? from < a : to < b;
  }
};

/// A facet counts as empty when its area is below this share of its longest edge squared: its
/// normal would then be rounding noise of coordinates given to about 1e-7 (single precision).
constexpr double empty_facet = 1e-7;
/// Faults listed per body; a wrong file has thousands of the same.
constexpr std::size_t most_faults = 8;

Corners corners(const BodySurface& s, std::size_t f) {
  return {s.triangles[3 * f], s.triangles[3 * f + 1], s.triangles[3 * f + 2]};
}

std::vector<Edge> sorted_edges(const BodySurface& surface) {
  std::vector<Edge> edges;
  edges.reserve(surface.triangles.size());
  for (std::size_t f = 0; f < surface.triangles.size() / 3; ++f) {
    const Corners v = corners(surface, f);
    for (std::size_t e = 0; e < 3; ++e) {
      edges.push_back({.from = v[e],
                       .to = v[(e + 1) % 3],
                       .facet = static_cast<std::int32_t>(f),
                       .side = static_cast<std::int32_t>(e)});
    }
  }
  std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) {
    return a.before(b.from, b.to) || (a.from == b.from && a.to == b.to && a.facet < b.facet);
  });
  return edges;
}

const Edge* find_edge(const std::vector<Edge>& edges, std::int32_t from, std::int32_t to) {
  const auto at =
      std::lower_bound(edges.begin(), edges.end(), to,
                       [&](const Edge& e, std::int32_t b) { return e.before(from, b); });
  return at != edges.end() && at->from == from && at->to == to ? &*at : nullptr;
}

void find_facet_faults(const Body& body, std::vector<std::string>& faults) {
  const auto n_vertices = static_cast<std::int32_t>(body.surface.vertices.size() / 3);
  for (std::size_t f = 0; f < body.surface.triangles.size() / 3; ++f) {
    const Corners v = corners(body.surface, f);
    if (*std::min_element(v.begin(), v.end()) < 0 ||
        *std::max_element(v.begin(), v.end()) >= n_vertices) {
      faults.push_back(
          fmt::format("body '{}': facet {} has the vertices {}, {}, {}; accepted 0 to {}",
                      body.name, f, v[0], v[1], v[2], n_vertices - 1));
      continue;
    }
    const Vec3 a = row(body.surface.vertices, v[0]);
    const Vec3 b = row(body.surface.vertices, v[1]);
    const Vec3 c = row(body.surface.vertices, v[2]);
    const double longest2 = std::max({norm2(b - a), norm2(c - b), norm2(a - c)});
    if (!(0.5 * norm(cross(b - a, c - a)) > empty_facet * longest2)) {
      faults.push_back(fmt::format(
          "body '{}': facet {} (vertices {}, {}, {}) has no area; merge its vertices or remove it",
          body.name, f, v[0], v[1], v[2]));
    }
  }
}

void find_edge_faults(const Body& body, std::vector<std::string>& faults) {
  const std::vector<Edge> edges = sorted_edges(body.surface);
  for (std::size_t n = 0; n < edges.size(); ++n) {
    const Edge& e = edges[n];
    if (n + 1 < edges.size() && edges[n + 1].from == e.from && edges[n + 1].to == e.to) {
      faults.push_back(fmt::format(
          "body '{}': facets {} and {} run through the edge of vertices {} and {} the same way; "
          "one "
          "of them is inverted: orient all facets outward, each edge between two facets",
          body.name, e.facet, edges[n + 1].facet, e.from, e.to));
    }
    if (find_edge(edges, e.to, e.from) == nullptr) {
      faults.push_back(fmt::format(
          "body '{}': the edge of vertices {} and {} of facet {} has no facet on its other side; "
          "close the surface (or merge vertices at the same place)",
          body.name, e.from, e.to, e.facet));
    }
  }
}

/// Root of a corner's group, with path halving.
std::int32_t root(std::vector<std::int32_t>& parent, std::int32_t corner) {
  while (parent[corner] != corner) corner = parent[corner] = parent[parent[corner]];
  return corner;
}

void find_neighbours(const BodySurface& surface, SurfaceTopology& topology) {
  const std::vector<Edge> edges = sorted_edges(surface);
  topology.neighbour.assign(topology.facet.size(), Corners{-1, -1, -1});
  for (const Edge& e : edges) {
    const Edge* back = find_edge(edges, e.to, e.from);
    topology.neighbour[e.facet][e.side] = back != nullptr ? back->facet : e.facet;
  }
}

void find_facets_around(std::size_t n_vertices, SurfaceTopology& topology) {
  topology.around_first.assign(n_vertices + 1, 0);
  for (const Corners& v : topology.facet) {
    for (const std::int32_t a : v) ++topology.around_first[a + 1];
  }
  std::partial_sum(topology.around_first.begin(), topology.around_first.end(),
                   topology.around_first.begin());
  topology.around.resize(3 * topology.facet.size());
  std::vector<std::int32_t> next(topology.around_first.begin(), topology.around_first.end() - 1);
  for (std::size_t f = 0; f < topology.facet.size(); ++f) {
    for (const std::int32_t a : topology.facet[f]) {
      topology.around[next[a]++] = static_cast<std::int32_t>(f);
    }
  }
}

/// Facets 2 q and 2 q + 1 are quad q; each has one corner that the other lacks.
void find_quad_halves(std::size_t n_quads, SurfaceTopology& topology) {
  topology.quad_half.assign(topology.facet.size(), {});
  for (std::size_t f = 0; f < 2 * n_quads; ++f) {
    const Corners& mine = topology.facet[f];
    const Corners& other = topology.facet[f ^ 1U];
    const auto lacks = [](const Corners& v, std::int32_t a) {
      return std::find(v.begin(), v.end(), a) == v.end();
    };
    const auto apex =
        std::find_if(mine.begin(), mine.end(), [&](std::int32_t a) { return lacks(other, a); });
    const auto fourth =
        std::find_if(other.begin(), other.end(), [&](std::int32_t a) { return lacks(mine, a); });
    topology.quad_half[f] = {.fourth = *fourth,
                             .apex = static_cast<std::int32_t>(apex - mine.begin())};
  }
}

std::int32_t corner_of(const SurfaceTopology& topology, std::int32_t f, std::int32_t vertex) {
  const Corners& v = topology.facet[f];
  return 3 * f + (v[0] == vertex ? 0 : (v[1] == vertex ? 1 : 2));
}

void find_smooth_vertices(SurfaceTopology& topology, const std::vector<Vec3>& normal,
                          double smallest_cosine) {
  const std::size_t n = topology.facet.size();
  std::vector<std::int32_t> parent(3 * n);
  std::iota(parent.begin(), parent.end(), 0);
  topology.sharp.assign(n, 0);
  for (std::size_t f = 0; f < n; ++f) {
    for (std::size_t e = 0; e < 3; ++e) {
      const std::int32_t g = topology.neighbour[f][e];
      if (dot(normal[f], normal[g]) < smallest_cosine) {
        topology.sharp[f] = static_cast<std::uint8_t>(topology.sharp[f] | (1U << e));
        continue;
      }
      for (const std::size_t corner : {e, (e + 1) % 3}) {
        const std::int32_t there = corner_of(topology, g, topology.facet[f][corner]);
        parent[root(parent, static_cast<std::int32_t>(3 * f + corner))] = root(parent, there);
      }
    }
  }
  std::vector<std::int32_t> number(3 * n, -1);
  topology.smooth_vertex.resize(n);
  for (std::size_t c = 0; c < 3 * n; ++c) {
    std::int32_t& group = number[root(parent, static_cast<std::int32_t>(c))];
    if (group < 0) group = topology.n_smooth_vertices++;
    topology.smooth_vertex[c / 3][c % 3] = group;
  }
}

}  // namespace

std::vector<std::string> find_surface_faults(const Body& body) {
  const BodySurface& s = body.surface;
  std::vector<std::string> faults;
  if (s.triangles.empty() || s.vertices.size() % 3 != 0 || s.triangles.size() % 3 != 0) {
    faults.push_back(
        fmt::format("body '{}': surface of {} coordinates and {} vertex numbers; "
                    "accepted three of each per vertex and facet, at least four facets",
                    body.name, s.vertices.size(), s.triangles.size()));
    return faults;
  }
  for (std::size_t n = 0; n < s.vertices.size(); ++n) {
    if (!std::isfinite(s.vertices[n])) {
      faults.push_back(fmt::format("body '{}': vertex {} is not finite", body.name, n / 3));
      return faults;
    }
  }
  find_facet_faults(body, faults);
  if (faults.empty()) find_edge_faults(body, faults);
  if (faults.empty() && enclosed_volume(s) == 0.0) {
    faults.push_back(fmt::format("body '{}': the surface encloses no volume", body.name));
  }
  if (faults.size() > most_faults) {
    const std::size_t more = faults.size() - most_faults;
    faults.resize(most_faults);
    faults.push_back(fmt::format("body '{}': {} more faults of this kind", body.name, more));
  }
  return faults;
}

double enclosed_volume(const BodySurface& surface) {
  const Vec3 origin = row(surface.vertices, surface.triangles.front());
  double six_volumes = 0.0;
  for (std::size_t f = 0; f < surface.triangles.size() / 3; ++f) {
    const Corners v = corners(surface, f);
    six_volumes +=
        dot(row(surface.vertices, v[0]) - origin,
            cross(row(surface.vertices, v[1]) - origin, row(surface.vertices, v[2]) - origin));
  }
  return six_volumes / 6.0;
}

void orient_outward(BodySurface& surface) {
  if (enclosed_volume(surface) >= 0.0) return;
  for (std::size_t f = 0; f < surface.triangles.size() / 3; ++f) {
    std::swap(surface.triangles[3 * f + 1], surface.triangles[3 * f + 2]);
  }
}

SurfaceTopology make_surface_topology(const BodySurface& surface, double smooth_below_degrees) {
  SurfaceTopology topology;
  topology.facet.resize(surface.triangles.size() / 3);
  for (std::size_t f = 0; f < topology.facet.size(); ++f) topology.facet[f] = corners(surface, f);
  find_neighbours(surface, topology);
  find_facets_around(surface.vertices.size() / 3, topology);
  find_quad_halves(surface.n_quads, topology);
  std::vector<Vec3> normal(topology.facet.size());
  for (std::size_t f = 0; f < normal.size(); ++f) {
    const Corners& v = topology.facet[f];
    const Vec3 a = row(surface.vertices, v[0]);
    normal[f] = unit(cross(row(surface.vertices, v[1]) - a, row(surface.vertices, v[2]) - a));
  }
  find_smooth_vertices(topology, normal, std::cos(smooth_below_degrees * std::numbers::pi / 180.0));
  return topology;
}

void compute_facet_geometry(const SurfaceTopology& topology, std::span<const double> position,
                            FacetGeometry& geometry) {
  const std::size_t n = topology.facet.size();
  geometry.normal.resize(n);
  geometry.area.resize(n);
  geometry.smooth_normal.assign(static_cast<std::size_t>(topology.n_smooth_vertices), Vec3{});
  for (std::size_t f = 0; f < n; ++f) {
    const Corners& v = topology.facet[f];
    const std::array<Vec3, 3> x = {row(position, v[0]), row(position, v[1]), row(position, v[2])};
    const std::array<Vec3, 3> edge = {x[1] - x[0], x[2] - x[1], x[0] - x[2]};
    const std::array<double, 3> length2 = {norm2(edge[0]), norm2(edge[1]), norm2(edge[2])};
    const Vec3 twice = cross(edge[0], x[2] - x[0]);
    geometry.area[f] = 0.5 * norm(twice);
    geometry.normal[f] = unit(twice);
    for (std::size_t c = 0; c < 3; ++c) {
      Vec3& sum = geometry.smooth_normal[topology.smooth_vertex[f][c]];
      sum = sum + (1.0 / (length2[c] * length2[(c + 2) % 3])) * twice;
    }
  }
  for (Vec3& m : geometry.smooth_normal) m = unit(m);
}

}  // namespace ocublast::flow
