#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

#include "flow_solver/grid/make_grid.hpp"
#include "flow_solver/immersed/immersed_boundary.hpp"

/// Surfaces and fields shared by the tests of the immersed boundary.
namespace ocublast::flow::testing {

using P3 = std::array<double, 3>;

inline Grid uniform_grid(int n_i, int n_j, int n_k, double length) {
  const auto axis = [&](int n, double h) {
    return n > 1 ? make_uniform_axis(0.0, n * h, n) : make_absent_axis();
  };
  const double h = length / n_i;
  return {{axis(n_i, h), axis(n_j, h), axis(n_k, h)}};
}

/// Box with each face divided into n x n squares of two triangles.
inline BodySurface make_box(const P3& low, const P3& high, int n = 1) {
  BodySurface s;
  std::map<std::array<int, 3>, std::int32_t> number;
  const auto vertex = [&](const std::array<int, 3>& at) {
    const auto [entry, is_new] = number.try_emplace(at, static_cast<std::int32_t>(number.size()));
    if (is_new) {
      for (std::size_t a = 0; a < 3; ++a) {
        const double t = static_cast<double>(at[a]) / n;
        s.vertices.push_back(at[a] == n ? high[a] : low[a] + t * (high[a] - low[a]));
      }
    }
    return entry->second;
  };
  for (std::size_t a = 0; a < 3; ++a) {
    const std::size_t b = (a + 1) % 3;
    const std::size_t c = (a + 2) % 3;
    for (const int side : {0, n}) {
      for (int m = 0; m < n; ++m) {
        for (int k = 0; k < n; ++k) {
          const auto corner = [&](int db, int dc) {
            std::array<int, 3> at{};
            at[a] = side;
            at[b] = m + db;
            at[c] = k + dc;
            return vertex(at);
          };
          const std::int32_t p = corner(0, 0), q = corner(1, 0), r = corner(1, 1), t = corner(0, 1);
          if (side == n) {
            s.triangles.insert(s.triangles.end(), {p, q, r, p, r, t});
          } else {
            s.triangles.insert(s.triangles.end(), {p, r, q, p, t, r});
          }
        }
      }
    }
  }
  return s;
}

/// Octahedron divided `levels` times and pushed onto the sphere; 8 * 4^levels facets, vertices on
/// the axes.
inline BodySurface make_sphere(const P3& centre, double radius, int levels) {
  std::vector<P3> points = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  std::vector<std::array<std::int32_t, 3>> facets = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                                                     {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  for (int level = 0; level < levels; ++level) {
    std::map<std::pair<std::int32_t, std::int32_t>, std::int32_t> middle;
    const auto between = [&](std::int32_t a, std::int32_t b) {
      const auto [entry, is_new] =
          middle.try_emplace(std::minmax(a, b), static_cast<std::int32_t>(points.size()));
      if (is_new) {
        P3 m{};
        double length2 = 0.0;
        for (std::size_t d = 0; d < 3; ++d) {
          m[d] = points[a][d] + points[b][d];
          length2 += m[d] * m[d];
        }
        for (double& x : m) x /= std::sqrt(length2);
        points.push_back(m);
      }
      return entry->second;
    };
    std::vector<std::array<std::int32_t, 3>> finer;
    for (const auto& f : facets) {
      const auto x = between(f[0], f[1]), y = between(f[1], f[2]), z = between(f[2], f[0]);
      finer.insert(finer.end(), {{f[0], x, z}, {x, f[1], y}, {z, y, f[2]}, {x, y, z}});
    }
    facets = std::move(finer);
  }
  BodySurface s;
  for (const P3& p : points) {
    for (std::size_t d = 0; d < 3; ++d) s.vertices.push_back(centre[d] + radius * p[d]);
  }
  for (const auto& f : facets) s.triangles.insert(s.triangles.end(), f.begin(), f.end());
  return s;
}

/// Polygon (counter-clockwise, convex) extruded along z.
inline BodySurface make_prism(const std::vector<std::array<double, 2>>& polygon, double z_low,
                              double z_high) {
  BodySurface s;
  const auto n = static_cast<std::int32_t>(polygon.size());
  std::array<double, 2> centre{};
  for (const auto& p : polygon) {
    centre[0] += p[0] / n;
    centre[1] += p[1] / n;
  }
  for (const double z : {z_low, z_high}) {
    for (const auto& p : polygon) s.vertices.insert(s.vertices.end(), {p[0], p[1], z});
  }
  for (const double z : {z_low, z_high})
    s.vertices.insert(s.vertices.end(), {centre[0], centre[1], z});
  for (std::int32_t a = 0; a < n; ++a) {
    const std::int32_t b = (a + 1) % n;
    s.triangles.insert(s.triangles.end(), {a, b, n + b, a, n + b, n + a});
    s.triangles.insert(s.triangles.end(), {2 * n, b, a, 2 * n + 1, n + a, n + b});
  }
  return s;
}

inline BodySurface make_cylinder(double x, double y, double radius, int sides) {
  std::vector<std::array<double, 2>> polygon;
  for (int n = 0; n < sides; ++n) {
    const double angle = 2.0 * std::numbers::pi * n / sides;
    polygon.push_back({x + radius * std::cos(angle), y + radius * std::sin(angle)});
  }
  return make_prism(polygon, -1.0, 2.0);
}

/// Cylinder with a round hole through it, along z.
inline BodySurface make_ring(double x, double y, double inner, double outer, int sides) {
  BodySurface s;
  for (const double z : {-1.0, 2.0}) {
    for (const double radius : {inner, outer}) {
      for (int n = 0; n < sides; ++n) {
        const double angle = 2.0 * std::numbers::pi * n / sides;
        s.vertices.insert(s.vertices.end(),
                          {x + radius * std::cos(angle), y + radius * std::sin(angle), z});
      }
    }
  }
  // Circles 0 and 1 below (inner, outer), 2 and 3 above; a band joins two of them.
  const auto band = [&](int from, int to) {
    for (int n = 0; n < sides; ++n) {
      const auto at = [&](int circle, int m) {
        return static_cast<std::int32_t>(circle * sides + m % sides);
      };
      s.triangles.insert(s.triangles.end(), {at(from, n), at(from, n + 1), at(to, n + 1)});
      s.triangles.insert(s.triangles.end(), {at(from, n), at(to, n + 1), at(to, n)});
    }
  };
  band(1, 3);
  band(3, 2);
  band(2, 0);
  band(0, 1);
  return s;
}

/// A set of fields of its own, rows of all fields side by side.
class Fields {
 public:
  explicit Fields(const Grid& grid) {
    const int g_i = grid.axis[0].ghosts(), g_j = grid.axis[1].ghosts(), g_k = grid.axis[2].ghosts();
    const std::ptrdiff_t row = grid.axis[0].n + 2 * g_i;
    view_.stride_f = row;
    view_.stride_j = row * n_primitive;
    view_.stride_k = view_.stride_j * (grid.axis[1].n + 2 * g_j);
    values_.assign(static_cast<std::size_t>(view_.stride_k * (grid.axis[2].n + 2 * g_k)),
                   std::numeric_limits<Real>::quiet_NaN());
    view_.data = values_.data() + g_i + g_j * view_.stride_j + g_k * view_.stride_k;
  }
  /// Sets all nodes and ghosts from a function of position: p, T, u, v, w.
  template <class State>
  void set(const Grid& grid, const Gas& gas, const State& state) {
    for (int k = -grid.axis[2].ghosts(); k < grid.axis[2].n + grid.axis[2].ghosts(); ++k) {
      for (int j = -grid.axis[1].ghosts(); j < grid.axis[1].n + grid.axis[1].ghosts(); ++j) {
        for (int i = -grid.axis[0].ghosts(); i < grid.axis[0].n + grid.axis[0].ghosts(); ++i) {
          const std::array<double, 5> s =
              state(grid.axis[0].x(i), grid.axis[1].x(j), grid.axis[2].x(k));
          view_(prim_rho, i, j, k) = static_cast<Real>(density(gas, s[0], s[1]));
          for (int a = 0; a < 3; ++a)
            view_(prim_u + a, i, j, k) = static_cast<Real>(s[static_cast<std::size_t>(2 + a)]);
          view_(prim_T, i, j, k) = static_cast<Real>(s[1]);
        }
      }
    }
  }
  [[nodiscard]] FieldsView<Real> view() { return view_; }

 private:
  std::vector<Real> values_;
  FieldsView<Real> view_;
};

}  // namespace ocublast::flow::testing
