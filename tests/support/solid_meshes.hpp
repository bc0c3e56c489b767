#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <random>
#include <vector>

#include "solid_solver/mesh/solid_mesh.hpp"

namespace ocublast::solid::test {

using Point = std::array<double, 3>;

struct BlockSize {
  std::array<int, 3> cells{1, 1, 1};
  Point size{1.0, 1.0, 1.0};  ///< m
  double distortion = 0.0;    ///< inner nodes moved by up to this times the cell size
};

inline std::int32_t block_node(const BlockSize& b, int i, int j, int k) {
  return i + (b.cells[0] + 1) * (j + (b.cells[1] + 1) * k);
}

/// Box of hexes from the origin, one tissue "block"; face sets x0 x1 y0 y1 z0 z1 and wet, node sets
/// of the same six names.
inline SolidMesh make_block(const BlockSize& b) {
  SolidMesh mesh;
  mesh.tissues = {"block"};
  std::mt19937 random(7);
  std::uniform_real_distribution<double> shift(-b.distortion, b.distortion);
  for (int k = 0; k <= b.cells[2]; ++k)
    for (int j = 0; j <= b.cells[1]; ++j)
      for (int i = 0; i <= b.cells[0]; ++i) {
        const std::array<int, 3> at{i, j, k};
        bool inner = true;
        for (std::size_t d = 0; d < 3; ++d) inner = inner && at[d] > 0 && at[d] < b.cells[d];
        for (std::size_t d = 0; d < 3; ++d) {
          const double h = b.size[d] / b.cells[d];
          const double s = shift(random);
          mesh.nodes.push_back(h * at[d] + (inner ? s * h : 0.0));
        }
        const auto n = block_node(b, i, j, k);
        const std::array<const char*, 6> names{"x0", "x1", "y0", "y1", "z0", "z1"};
        for (std::size_t d = 0; d < 3; ++d) {
          if (at[d] == 0) mesh.node_sets[names[2 * d]].push_back(n);
          if (at[d] == b.cells[d]) mesh.node_sets[names[2 * d + 1]].push_back(n);
        }
      }
  const auto face = [&](const char* name, std::int32_t a, std::int32_t c, std::int32_t d,
                        std::int32_t e) {
    mesh.face_sets[name].push_back({a, c, d, e});
    mesh.face_sets["wet"].push_back({a, c, d, e});
  };
  for (int k = 0; k < b.cells[2]; ++k)
    for (int j = 0; j < b.cells[1]; ++j)
      for (int i = 0; i < b.cells[0]; ++i) {
        const auto n = [&](int di, int dj, int dk) {
          return block_node(b, i + di, j + dj, k + dk);
        };
        for (const auto v : {n(0, 0, 0), n(1, 0, 0), n(1, 1, 0), n(0, 1, 0), n(0, 0, 1), n(1, 0, 1),
                             n(1, 1, 1), n(0, 1, 1)})
          mesh.of(Shape::hex8).nodes.push_back(v);
        mesh.of(Shape::hex8).tissue.push_back(0);
        if (i == 0) face("x0", n(0, 0, 0), n(0, 0, 1), n(0, 1, 1), n(0, 1, 0));
        if (i == b.cells[0] - 1) face("x1", n(1, 0, 0), n(1, 1, 0), n(1, 1, 1), n(1, 0, 1));
        if (j == 0) face("y0", n(0, 0, 0), n(1, 0, 0), n(1, 0, 1), n(0, 0, 1));
        if (j == b.cells[1] - 1) face("y1", n(0, 1, 0), n(0, 1, 1), n(1, 1, 1), n(1, 1, 0));
        if (k == 0) face("z0", n(0, 0, 0), n(0, 1, 0), n(1, 1, 0), n(1, 0, 0));
        if (k == b.cells[2] - 1) face("z1", n(0, 0, 1), n(1, 0, 1), n(1, 1, 1), n(0, 1, 1));
      }
  return mesh;
}

/// The same nodes with each hex cut into 6 tets round its diagonal 0-6 (Kuhn).
inline SolidMesh to_tets(SolidMesh mesh) {
  constexpr std::array<std::array<int, 2>, 6> edges{
      {{1, 2}, {2, 3}, {3, 7}, {7, 4}, {4, 5}, {5, 1}}};
  for (std::size_t h = 0; h < mesh.count(Shape::hex8); ++h) {
    const std::int32_t* n = &mesh.of(Shape::hex8).nodes[8 * h];
    for (const auto& e : edges) {
      for (const auto v : {n[0], n[e[0]], n[e[1]], n[6]}) mesh.of(Shape::tet4).nodes.push_back(v);
      mesh.of(Shape::tet4).tissue.push_back(mesh.of(Shape::hex8).tissue[h]);
    }
  }
  mesh.of(Shape::hex8).nodes.clear();
  mesh.of(Shape::hex8).tissue.clear();
  return mesh;
}

/// The same nodes with each hex cut into two wedges along the diagonal of its bottom.
inline SolidMesh to_wedges(SolidMesh mesh) {
  auto& hexes = mesh.of(Shape::hex8);
  auto& wedges = mesh.of(Shape::wedge6);
  for (std::size_t h = 0; h < hexes.tissue.size(); ++h) {
    const std::int32_t* n = &hexes.nodes[8 * h];
    for (const auto& half : {std::array<int, 3>{0, 1, 2}, std::array<int, 3>{0, 2, 3}}) {
      for (const int up : {0, 4})
        for (const int a : half) wedges.nodes.push_back(n[a + up]);
      wedges.tissue.push_back(hexes.tissue[h]);
    }
  }
  hexes = {};
  return mesh;
}

/// Quadratic tets: to_tets with nodes at the middles of the edges; node sets grow with them.
inline SolidMesh to_tet10(SolidMesh mesh) {
  mesh = to_tets(std::move(mesh));
  auto& tets = mesh.of(Shape::tet4);
  auto& result = mesh.of(Shape::tet10);
  std::map<std::pair<std::int32_t, std::int32_t>, std::int32_t> middles;
  constexpr std::array<std::array<int, 2>, 6> edges{
      {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}}};
  for (std::size_t t = 0; t < tets.tissue.size(); ++t) {
    const std::int32_t* n = &tets.nodes[4 * t];
    result.nodes.insert(result.nodes.end(), n, n + 4);
    for (const auto& e : edges) {
      const auto [low, high] = std::minmax(n[e[0]], n[e[1]]);
      const auto [entry, added] =
          middles.try_emplace({low, high}, static_cast<std::int32_t>(mesh.n_nodes()));
      if (added)
        for (std::size_t i = 0; i < 3; ++i)
          mesh.nodes.push_back(0.5 * (mesh.nodes[3 * static_cast<std::size_t>(low) + i] +
                                      mesh.nodes[3 * static_cast<std::size_t>(high) + i]));
      result.nodes.push_back(entry->second);
    }
    result.tissue.push_back(tets.tissue[t]);
  }
  tets = {};
  for (auto& [name, set] : mesh.node_sets) {
    std::vector<bool> in(mesh.n_nodes(), false);
    for (const auto n : set) in[static_cast<std::size_t>(n)] = true;
    for (const auto& [edge, middle] : middles)
      if (in[static_cast<std::size_t>(edge.first)] && in[static_cast<std::size_t>(edge.second)])
        set.push_back(middle);
  }
  return mesh;
}

/// Quads in the plane z = 0 from a block of one layer: its bottom; edges in the face sets.
inline SolidMesh to_quads(const SolidMesh& block) {
  SolidMesh mesh;
  mesh.tissues = block.tissues;
  std::vector<std::int32_t> number(block.n_nodes(), -1);
  for (const auto n : block.node_sets.at("z0")) {
    number[static_cast<std::size_t>(n)] = static_cast<std::int32_t>(mesh.n_nodes());
    mesh.nodes.insert(mesh.nodes.end(), {block.nodes[3 * static_cast<std::size_t>(n)],
                                         block.nodes[3 * static_cast<std::size_t>(n) + 1], 0.0});
  }
  const auto& hexes = block.of(Shape::hex8);
  for (std::size_t h = 0; h < hexes.tissue.size(); ++h) {
    for (std::size_t a = 0; a < 4; ++a)
      mesh.of(Shape::quad4)
          .nodes.push_back(number[static_cast<std::size_t>(hexes.nodes[8 * h + a])]);
    mesh.of(Shape::quad4).tissue.push_back(hexes.tissue[h]);
  }
  for (const auto& [name, set] : block.node_sets)
    for (const auto n : set)
      if (number[static_cast<std::size_t>(n)] >= 0)
        mesh.node_sets[name].push_back(number[static_cast<std::size_t>(n)]);
  for (const auto& [name, facets] : block.face_sets)
    for (const auto& f : facets) {
      Facet edge{-1, -1, -1, -1};
      std::size_t k = 0;
      for (std::size_t a = 0; a < 4; ++a) {
        const auto n = number[static_cast<std::size_t>(f[a])];
        if (n >= 0 && k < 2) edge[k++] = n;
      }
      // A side face has two bottom nodes; run through (.., bottom last, bottom first) they turn.
      const auto first = number[static_cast<std::size_t>(f[0])];
      const auto last = number[static_cast<std::size_t>(f[3])];
      if (k == 2 && first >= 0 && last >= 0) edge = {last, first, -1, -1};
      if (k == 2 && name != "z0") mesh.face_sets[name].push_back(edge);
    }
  return mesh;
}

/// A block of cells of any shape (quads: its bottom, with radius at least size[0] / 2 if it is to
/// be turned about y).
inline SolidMesh make_block_of(Shape shape, const BlockSize& b, double shift_x = 0.0) {
  auto mesh = make_block(b);
  for (std::size_t n = 0; n < mesh.n_nodes(); ++n) mesh.nodes[3 * n] += shift_x;
  if (shape == Shape::tet4) return to_tets(std::move(mesh));
  if (shape == Shape::tet10) return to_tet10(std::move(mesh));
  if (shape == Shape::wedge6) return to_wedges(std::move(mesh));
  if (shape == Shape::quad4) return to_quads(mesh);
  return mesh;
}

/// Ball of hexes: a cube of n^3 cells blown up to a sphere of `radius`, centre at the origin;
/// tissue and sets as make_block.
inline SolidMesh make_ball(int n, double radius) {
  SolidMesh mesh = make_block({.cells = {n, n, n}, .size = {2.0, 2.0, 2.0}});
  for (std::size_t a = 0; a < mesh.n_nodes(); ++a) {
    Point p{};
    double largest = 0.0;
    double norm = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
      p[i] = mesh.nodes[3 * a + i] - 1.0;
      largest = std::max(largest, std::abs(p[i]));
      norm += p[i] * p[i];
    }
    norm = std::sqrt(norm);
    // Cube of half side m -> between a cube (m small) and a sphere (m = 1).
    for (std::size_t i = 0; i < 3; ++i) {
      const double sphere = norm > 0.0 ? p[i] * largest / norm : 0.0;
      const double cube = p[i] * 0.62;
      mesh.nodes[3 * a + i] = radius * ((1.0 - largest) * cube + largest * sphere);
    }
  }
  return mesh;
}

/// Spherical shell of hexes: six caps of n x n cells, `layers` through the wall. Wet set: outer and
/// inner surface; face sets "outer", "inner".
inline SolidMesh make_shell(int n, int layers, double inner, double outer) {
  SolidMesh mesh;
  mesh.tissues = {"shell"};
  std::map<std::array<long, 3>, std::int32_t> numbers;
  const auto node = [&](const Point& p) {
    const std::array<long, 3> key{std::lround(p[0] / outer * 1e6), std::lround(p[1] / outer * 1e6),
                                  std::lround(p[2] / outer * 1e6)};
    const auto [entry, added] = numbers.try_emplace(key, static_cast<std::int32_t>(numbers.size()));
    if (added) mesh.nodes.insert(mesh.nodes.end(), p.begin(), p.end());
    return entry->second;
  };
  for (int cap = 0; cap < 6; ++cap) {
    const auto at = [&](int i, int j, int k) {
      const double a = std::tan((2.0 * i / n - 1.0) * 0.78539816339744830962);
      const double b = std::tan((2.0 * j / n - 1.0) * 0.78539816339744830962);
      const double r = (inner + (outer - inner) * k / layers) / std::sqrt(1.0 + a * a + b * b);
      // (a, b, 1) turned so that a x b points outward on every cap.
      const std::array<Point, 6> turned{{{r, r * a, r * b},
                                         {r * b, r, r * a},
                                         {r * a, r * b, r},
                                         {-r, r * b, r * a},
                                         {r * a, -r, r * b},
                                         {r * b, r * a, -r}}};
      return node(turned[static_cast<std::size_t>(cap)]);
    };
    for (int k = 0; k < layers; ++k)
      for (int j = 0; j < n; ++j)
        for (int i = 0; i < n; ++i) {
          const std::array<std::int32_t, 8> v{
              at(i, j, k),     at(i + 1, j, k),     at(i + 1, j + 1, k),     at(i, j + 1, k),
              at(i, j, k + 1), at(i + 1, j, k + 1), at(i + 1, j + 1, k + 1), at(i, j + 1, k + 1)};
          mesh.of(Shape::hex8).nodes.insert(mesh.of(Shape::hex8).nodes.end(), v.begin(), v.end());
          mesh.of(Shape::hex8).tissue.push_back(0);
          if (k == 0) mesh.face_sets["inner"].push_back({v[0], v[3], v[2], v[1]});
          if (k == layers - 1) mesh.face_sets["outer"].push_back({v[4], v[5], v[6], v[7]});
        }
  }
  return mesh;
}

}  // namespace ocublast::solid::test
