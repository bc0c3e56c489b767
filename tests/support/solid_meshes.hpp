#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
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
          mesh.hex8.push_back(v);
        mesh.hex_tissue.push_back(0);
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
  for (std::size_t h = 0; h < mesh.n_hex(); ++h) {
    const std::int32_t* n = &mesh.hex8[8 * h];
    for (const auto& e : edges) {
      for (const auto v : {n[0], n[e[0]], n[e[1]], n[6]}) mesh.tet4.push_back(v);
      mesh.tet_tissue.push_back(mesh.hex_tissue[h]);
    }
  }
  mesh.hex8.clear();
  mesh.hex_tissue.clear();
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
          mesh.hex8.insert(mesh.hex8.end(), v.begin(), v.end());
          mesh.hex_tissue.push_back(0);
          if (k == 0) mesh.face_sets["inner"].push_back({v[0], v[3], v[2], v[1]});
          if (k == layers - 1) mesh.face_sets["outer"].push_back({v[4], v[5], v[6], v[7]});
        }
  }
  return mesh;
}

}  // namespace ocublast::solid::test
