#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <numbers>
#include <string>

#include "coupler/base/errors.hpp"
#include "coupler/mapping/interface_map.hpp"
#include "coupler/mapping/surface_search.hpp"

using namespace ocublast;
using namespace ocublast::coupler;
using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

constexpr double epsilon = std::numeric_limits<double>::epsilon();

/// Octahedron divided `level` times, its vertices on a sphere of radius 1 about `center`, turned.
link::InterfaceMesh sphere(int level, double turn,
                           const Vector3d& center = Vector3d(0.3, -0.2, 0.5)) {
  std::vector<Vector3d> points{Vector3d::UnitX(),  Vector3d::UnitY(),  Vector3d::UnitZ(),
                               -Vector3d::UnitX(), -Vector3d::UnitY(), -Vector3d::UnitZ()};
  std::vector<std::int32_t> triangles{0, 1, 2, 1, 3, 2, 3, 4, 2, 4, 0, 2,
                                      1, 0, 5, 3, 1, 5, 4, 3, 5, 0, 4, 5};
  for (int l = 0; l < level; ++l) {
    std::map<std::pair<int, int>, std::int32_t> middles;
    const auto middle = [&](std::int32_t a, std::int32_t b) {
      const auto [place, fresh] = middles.try_emplace({std::min(a, b), std::max(a, b)},
                                                      static_cast<std::int32_t>(points.size()));
      if (fresh)
        points.push_back((points[static_cast<std::size_t>(a)] + points[static_cast<std::size_t>(b)])
                             .normalized());
      return place->second;
    };
    std::vector<std::int32_t> finer;
    for (std::size_t t = 0; t < triangles.size(); t += 3) {
      const auto a = triangles[t], b = triangles[t + 1], c = triangles[t + 2];
      const auto ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {a, ab, ca, b, bc, ab, c, ca, bc, ab, bc, ca});
    }
    triangles = finer;
  }
  const Matrix3d R =
      Eigen::AngleAxisd(turn, Vector3d(1.0, 2.0, 3.0).normalized()).toRotationMatrix();
  link::InterfaceMesh mesh{.name = "sphere", .vertices = {}, .triangles = triangles};
  for (const Vector3d& p : points) {
    const Vector3d x = R * p + center;
    mesh.vertices.insert(mesh.vertices.end(), x.begin(), x.end());
  }
  return mesh;
}

/// A closed plate [0, 1] x [0, 1] x [0, thickness] with n x m cells; the sides one cell high.
link::InterfaceMesh plate(int n, int m, double thickness) {
  link::InterfaceMesh mesh{.name = "plate", .vertices = {}, .triangles = {}};
  const auto number = [&](int i, int j, int k) {
    return static_cast<std::int32_t>((k * (m + 1) + j) * (n + 1) + i);
  };
  for (int k = 0; k < 2; ++k)
    for (int j = 0; j <= m; ++j)
      for (int i = 0; i <= n; ++i)
        mesh.vertices.insert(mesh.vertices.end(), {1.0 * i / n, 1.0 * j / m, k * thickness});
  const auto quad = [&](std::int32_t a, std::int32_t b, std::int32_t c, std::int32_t d) {
    mesh.triangles.insert(mesh.triangles.end(), {a, b, c, a, c, d});
  };
  for (int j = 0; j < m; ++j)
    for (int i = 0; i < n; ++i) {
      quad(number(i, j, 1), number(i + 1, j, 1), number(i + 1, j + 1, 1), number(i, j + 1, 1));
      quad(number(i, j, 0), number(i, j + 1, 0), number(i + 1, j + 1, 0), number(i + 1, j, 0));
    }
  for (int i = 0; i < n; ++i) {
    quad(number(i, 0, 0), number(i + 1, 0, 0), number(i + 1, 0, 1), number(i, 0, 1));
    quad(number(i + 1, m, 0), number(i, m, 0), number(i, m, 1), number(i + 1, m, 1));
  }
  for (int j = 0; j < m; ++j) {
    quad(number(0, j + 1, 0), number(0, j, 0), number(0, j, 1), number(0, j + 1, 1));
    quad(number(n, j, 0), number(n, j + 1, 0), number(n, j + 1, 1), number(n, j, 1));
  }
  return mesh;
}

std::vector<double> at_vertices(const link::InterfaceMesh& mesh, auto field) {
  std::vector<double> values;
  for (std::size_t v = 0; v < mesh.n_vertices(); ++v) {
    const Vector3d u = field(point_of(mesh.vertices, v));
    values.insert(values.end(), u.begin(), u.end());
  }
  return values;
}

double largest_difference(std::span<const double> a, std::span<const double> b) {
  double most = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) most = std::max(most, std::abs(a[i] - b[i]));
  return most;
}

double rms_difference(std::span<const double> a, std::span<const double> b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
  return std::sqrt(sum / static_cast<double>(a.size()));
}

struct Resultant {
  Vector3d force = Vector3d::Zero(), moment = Vector3d::Zero();
};
Resultant of_nodes(std::span<const double> force, std::span<const double> x) {
  Resultant r;
  for (std::size_t v = 0; v < force.size() / 3; ++v) {
    r.force += point_of(force, v);
    r.moment += point_of(x, v).cross(point_of(force, v));
  }
  return r;
}
/// Of a pressure that is linear on each facet: three points, exact for its product with x.
Resultant of_pressure(const link::InterfaceMesh& mesh, std::span<const double> p,
                      std::span<const double> x) {
  Resultant r;
  for (std::size_t t = 0; t < mesh.triangles.size(); t += 3) {
    const auto v = [&](std::size_t k) { return static_cast<std::size_t>(mesh.triangles[t + k]); };
    const Vector3d push =
        -0.5 * (point_of(x, v(1)) - point_of(x, v(0))).cross(point_of(x, v(2)) - point_of(x, v(0)));
    for (std::size_t q = 0; q < 3; ++q) {
      Vector3d place = Vector3d::Zero();
      double value = 0.0;
      for (std::size_t k = 0; k < 3; ++k) {
        const double N = k == q ? 2.0 / 3.0 : 1.0 / 6.0;
        place += N * point_of(x, v(k));
        value += N * p[v(k)];
      }
      r.force += value / 3.0 * push;
      r.moment += place.cross(value / 3.0 * push);
    }
  }
  return r;
}

link::InterfaceMesh without_triangles(link::InterfaceMesh mesh) {
  mesh.triangles.clear();
  return mesh;
}

struct Pair {
  const char* name;
  link::InterfaceMesh flow, solid;
};
std::vector<Pair> pairs() {
  return {{"finer solid", sphere(3, 0.7), sphere(4, 0.0)},
          {"coarser solid", sphere(4, 0.7), sphere(3, 0.0)},
          {"scattered solid", sphere(4, 0.7), without_triangles(sphere(4, 0.0))},
          {"plate, finer solid", plate(7, 5, 0.01), plate(20, 12, 0.01)},
          {"plate, coarser solid", plate(20, 12, 0.01), plate(7, 5, 0.01)}};
}

const auto linear = [](const Vector3d& x) -> Vector3d {
  Matrix3d G;
  G << 0.3, -1.2, 0.4, 0.9, 0.1, -0.5, 0.2, 0.8, -0.7;
  return G * x + Vector3d(0.1, -2.0, 0.4);
};
const auto smooth = [](const Vector3d& x) -> Vector3d {
  return {std::sin(2.0 * x[0]) * std::cos(x[1]), std::exp(0.5 * x[2]),
          std::sin(x[0] + x[1] - x[2])};
};
double smooth_pressure(const Vector3d& x) {
  return 2.0 + std::sin(2.0 * x[0]) * std::cos(1.5 * x[1]) + x[2];
}
std::vector<double> pressures(const link::InterfaceMesh& mesh) {
  std::vector<double> p;
  for (std::size_t v = 0; v < mesh.n_vertices(); ++v)
    p.push_back(smooth_pressure(point_of(mesh.vertices, v)));
  return p;
}

}  // namespace

TEST(InterfaceMap, ReproducesConstantAndLinearMotion) {
  for (const Pair& pair : pairs()) {
    const InterfaceMap map(pair.flow, pair.solid, {});
    const auto constant =
        at_vertices(pair.solid, [](const Vector3d&) { return Vector3d(1.0, -2.0, 3.0); });
    std::vector<double> found(pair.flow.vertices.size());
    map.map_vectors(constant, found);
    // Sums of at most 20 weights of order 1 (radial basis: up to 1e2 in a system of condition 1e4).
    const double rounding = map.method() == "radial basis" ? 1e-10 : 100.0 * epsilon;
    EXPECT_LT(largest_difference(
                  found,
                  at_vertices(pair.flow, [](const Vector3d&) { return Vector3d(1.0, -2.0, 3.0); })),
              3.0 * rounding)
        << pair.name;
    map.map_vectors(at_vertices(pair.solid, linear), found);
    EXPECT_LT(largest_difference(found, at_vertices(pair.flow, linear)), 10.0 * rounding)
        << pair.name;
    std::printf("%-22s %-18s gap %.2e m\n", pair.name, map.method().c_str(), map.largest_gap());
  }
}

TEST(InterfaceMap, FollowsALargeRotationExactly) {
  const Matrix3d R =
      Eigen::AngleAxisd(2.5, Vector3d(1.0, -1.0, 0.5).normalized()).toRotationMatrix();
  const auto turned = [&](const Vector3d& x) -> Vector3d {
    return R * x + Vector3d(5.0, 6.0, 7.0);
  };
  const InterfaceMap map(sphere(3, 0.7), sphere(4, 0.0), {});
  std::vector<double> found(3 * map.n_flow());
  map.map_position(at_vertices(sphere(4, 0.0), turned), found);
  EXPECT_LT(largest_difference(found, at_vertices(sphere(3, 0.7), turned)), 500.0 * epsilon);
}

TEST(InterfaceMap, KeepsTotalForceAndMomentInTheDeformedState) {
  for (const Pair& pair : pairs()) {
    const InterfaceMap map(pair.flow, pair.solid, {});
    const auto bent = [](const Vector3d& x) -> Vector3d { return x + 0.2 * smooth(x); };
    const auto x_solid = at_vertices(pair.solid, bent);
    std::vector<double> x_flow(pair.flow.vertices.size()), force(pair.solid.vertices.size());
    map.map_position(x_solid, x_flow);
    const auto p = pressures(pair.flow);
    map.map_force(p, x_flow, x_solid, force);
    const Resultant given = of_pressure(pair.flow, p, x_flow), taken = of_nodes(force, x_solid);
    double size = 0.0;
    for (const double f : force) size += std::abs(f);
    const double force_error = (given.force - taken.force).norm() / size;
    const double moment_error = (given.moment - taken.moment).norm() / size;
    std::printf("%-22s force %.1e, moment %.1e of the sum of |force| (x 1 m)\n", pair.name,
                force_error, moment_error);
    // Rounding of sums over a few thousand nodes, random: sqrt(1e4) epsilon.
    EXPECT_LT(force_error, 100.0 * epsilon) << pair.name;
    EXPECT_LT(moment_error, 100.0 * epsilon) << pair.name;
  }
}

TEST(InterfaceMap, LoadsEveryNodeOfAFinerSolidEvenly) {
  // A uniform pressure of 1 Pa: nodal forces of the facets' own areas, although the flow has a
  // sixteenth of them.
  const auto solid = plate(32, 32, 0.05);
  const InterfaceMap map(plate(8, 8, 0.05), solid, {});
  std::vector<double> force(solid.vertices.size());
  map.map_force(std::vector<double>(map.n_flow(), 1.0), map.flow_mesh().vertices, solid.vertices,
                force);
  const double cell = 1.0 / (32.0 * 32.0);
  for (std::size_t v = 0; v < solid.n_vertices(); ++v) {
    const Vector3d x = point_of(solid.vertices, v);
    const bool inside = x[0] > 0.04 && x[0] < 0.96 && x[1] > 0.04 && x[1] < 0.96;
    if (!inside) continue;
    // A piece of a flow facet does not end at the solid's edges where they cut it: 1/16 of a node's
    // area at most.
    EXPECT_NEAR(std::abs(force[3 * v + 2]), cell, 0.07 * cell) << v;
  }
}

TEST(InterfaceMap, IsOfSecondOrder) {
  for (const bool scattered : {false, true}) {
    double last_motion = 0.0, first_work = 0.0, last_pressure = 0.0;
    for (const int level : {3, 4, 5}) {
      auto solid = sphere(level, 0.0);
      const auto flow = sphere(level - 1, 0.7);
      const InterfaceMap map(flow, scattered ? without_triangles(solid) : solid, {});
      std::vector<double> found(flow.vertices.size()), force(solid.vertices.size()),
          p(solid.n_vertices());
      map.map_vectors(at_vertices(solid, smooth), found);
      const double motion = rms_difference(found, at_vertices(flow, smooth));
      // Work of the nodal forces on a smooth motion, against the integral of p n . u over a finer
      // sphere.
      map.map_force(pressures(flow), flow.vertices, solid.vertices, force);
      const auto u = at_vertices(solid, smooth);
      double work = 0.0;
      for (std::size_t i = 0; i < force.size(); ++i) work += force[i] * u[i];
      static const double exact = [] {
        const auto fine = sphere(7, 0.2);
        const auto areas = area_vectors(fine.vertices, fine.triangles);
        double sum = 0.0;
        for (std::size_t t = 0; t < areas.size(); ++t) {
          Vector3d x = Vector3d::Zero();
          for (std::size_t k = 0; k < 3; ++k)
            x += point_of(fine.vertices, static_cast<std::size_t>(fine.triangles[3 * t + k])) / 3.0;
          sum -= smooth_pressure(x) * areas[t].dot(smooth(x));
        }
        return sum;
      }();
      const double work_error = std::abs(work - exact) / std::abs(exact);
      map.map_pressure(pressures(flow), p);
      const double pressure = rms_difference(p, pressures(solid));
      std::printf("%s, level %d: motion %.2e, work %.2e, pressure %.2e",
                  scattered ? "radial basis" : "projection", level, motion, work_error, pressure);
      if (last_motion > 0.0) {
        // Work is one number, whose parts of either sign cancel by chance: from the first level on.
        const double order_work = std::log2(first_work / work_error) / (level - 3);
        std::printf("; orders %.2f, %.2f, %.2f", std::log2(last_motion / motion), order_work,
                    std::log2(last_pressure / pressure));
        // Linear interpolation: h^2; facets that do not halve exactly leave some percent.
        EXPECT_GT(std::log2(last_motion / motion), 1.8);
        EXPECT_GT(order_work, 1.8);
        EXPECT_GT(std::log2(last_pressure / pressure), 1.8);
      }
      std::printf("\n");
      last_motion = motion;
      if (level == 3) first_work = work_error;
      last_pressure = pressure;
    }
  }
}

TEST(InterfaceMap, KeepsTheSidesOfAThinPlateApart) {
  const auto flow = plate(9, 9, 1e-6), solid = plate(4, 4, 1e-6);
  const InterfaceMap map(flow, solid, {});
  // Load on the upper side only: none of it may reach the middle of the lower one.
  std::vector<double> p(flow.n_vertices(), 0.0), force(solid.vertices.size());
  for (std::size_t v = 0; v < flow.n_vertices(); ++v)
    p[v] = flow.vertices[3 * v + 2] > 0.0 ? 1.0 : 0.0;
  map.map_force(p, flow.vertices, solid.vertices, force);
  for (std::size_t v = 0; v < solid.n_vertices(); ++v) {
    const Vector3d x = point_of(solid.vertices, v);
    const bool inside = x[0] > 0.1 && x[0] < 0.9 && x[1] > 0.1 && x[1] < 0.9;
    // The balancing field is all that is left: the moment of pressure on sides 1e-6 m high.
    if (inside && x[2] == 0.0) {
      EXPECT_LT(std::abs(force[3 * v + 2]), 1e-8);
    }
  }
}

TEST(InterfaceMap, RefusesMeshesThatDoNotBelongTogether) {
  const auto text_of = [](const link::InterfaceMesh& flow, const link::InterfaceMesh& solid,
                          MappingOptions options = {}) {
    try {
      const InterfaceMap map(flow, solid, options);
    } catch (const LinkError& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  auto shifted = sphere(3, 0.0, {0.3, -0.2, 0.7});
  EXPECT_NE(text_of(shifted, sphere(3, 0.0)).find("coupling.mapping_gap"), std::string::npos);
  EXPECT_EQ(text_of(shifted, sphere(3, 0.0), {.largest_gap = 10.0}), "accepted");
  auto inside_out = sphere(3, 0.0);
  for (std::size_t t = 0; t < inside_out.triangles.size(); t += 3)
    std::swap(inside_out.triangles[t], inside_out.triangles[t + 1]);
  EXPECT_NE(text_of(inside_out, sphere(3, 0.0)), "accepted");
  // A flow that covers half of the solid: the solid's uncovered vertices are named.
  auto half = sphere(4, 0.0);
  std::vector<std::int32_t> kept;
  for (std::size_t t = 0; t < half.triangles.size(); t += 3)
    if (half.vertices[3 * static_cast<std::size_t>(half.triangles[t])] > 0.3)
      kept.insert(kept.end(), half.triangles.begin() + static_cast<long>(t),
                  half.triangles.begin() + static_cast<long>(t) + 3);
  half.triangles = kept;
  EXPECT_NE(text_of(half, sphere(4, 0.0)).find("vertex"), std::string::npos);
  EXPECT_NE(text_of(sphere(3, 0.0), without_triangles(sphere(3, 0.0)),
                    {.kind = MappingKind::nearest_projection})
                .find("no triangles"),
            std::string::npos);
  EXPECT_NE(text_of(without_triangles(sphere(3, 0.0)), sphere(3, 0.0)).find("no triangles"),
            std::string::npos);
}
