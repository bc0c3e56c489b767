// Pressure and load read at surfaces.
#include <gtest/gtest.h>

#include <cstdio>

#include "flow_solver/immersed/immersed_boundary.hpp"
#include "tests/unit/immersed_boundary_rig.hpp"

namespace ocublast::flow {
namespace {

using namespace testing;

TEST(ImmersedReadOut, IsExactForPressureLinearAlongAPlane) {
  const Gas gas;
  const Grid grid = uniform_grid(24, 24, 24, 1.0);
  ImmersedBoundary bodies(
      grid, gas, {{.name = "slab", .surface = make_box({-1, -1, -1}, {2, 2, .4137}, 30)}}, {});
  Fields W(grid);
  const auto p = [](double x, double y) { return p0 + 3e3 * x - 2e3 * y; };
  W.set(grid, gas, [&](double x, double y, double) {
    return std::array<double, 5>{p(x, y), T0, 0, 0, 0};
  });
  bodies.update_topology(W.view());
  std::vector<double> read(bodies.position(0).size() / 3);
  bodies.read_overpressure(W.view(), 0, p0, read);
  int n = 0;
  for (std::size_t v = 0; v < read.size(); ++v) {
    const double x = bodies.position(0)[3 * v], y = bodies.position(0)[3 * v + 1],
                 z = bodies.position(0)[3 * v + 2];
    if (z < .41 || std::min({x, y, 1 - x, 1 - y}) < .15) continue;
    ++n;
    // Linear on facets of equal shape around each vertex: their means give the vertex's own value.
    EXPECT_NEAR(read[v], p(x, y) - p0, 1e-9);
  }
  EXPECT_GT(n, 30);
}

struct SphereErrors {
  double pressure = 0.0;  ///< root mean square over the vertices
  double force = 0.0;
};

/// Sphere at rest in the pressure p0 + a.x (1 + R^3/(2 r^3)): no slope normal to its surface.
SphereErrors read_sphere(int n, int levels, bool accelerated) {
  const Gas gas;
  const Grid grid = uniform_grid(n, n, n, 1.0);
  const Vec3 centre = {{.503, .497, .511}};
  const double R = .23;
  const Vec3 slope = {{1e3, 7e2, -4e2}};
  ImmersedBoundary bodies(
      grid, gas,
      {{.name = "ball", .surface = make_sphere(centre.c, R, levels), .moves = accelerated}}, {});
  const double rho = density(gas, p0, T0);
  Fields W(grid);
  W.set(grid, gas, [&](double x, double y, double z) {
    const Vec3 r = Vec3{{x, y, z}} - centre;
    const double d = std::max(norm(r), .5 * R);
    const double p = p0 + dot(slope, r) * (accelerated ? 1.0 : 1.0 + .5 * std::pow(R / d, 3));
    return std::array<double, 5>{p, p / (rho * gas.gas_constant), 0, 0, 0};
  });
  bodies.update_topology(W.view());
  if (accelerated) {
    // Gas and ball fall together: rho a = -grad p.
    set_uniform_acceleration(bodies, 0, 1e-4, (-1.0 / rho) * slope);
    bodies.move_to(0.0);
  }
  std::vector<double> read(bodies.position(0).size() / 3);
  bodies.read_overpressure(W.view(), 0, p0, read);
  const double factor = accelerated ? 1.0 : 1.5;
  SphereErrors errors;
  for (std::size_t v = 0; v < read.size(); ++v) {
    const double exact =
        factor * dot(slope, row(bodies.position(0), static_cast<std::int32_t>(v)) - centre);
    errors.pressure += (read[v] - exact) * (read[v] - exact);
  }
  errors.pressure =
      std::sqrt(errors.pressure / static_cast<double>(read.size())) / (factor * norm(slope) * R);
  const BodyLoad load = bodies.load(W.view(), 0, p0);
  const double volume = 4.0 / 3.0 * std::numbers::pi * R * R * R;
  const Vec3 exact = (-factor * volume) * slope;
  errors.force = norm(Vec3{{load.force[0], load.force[1], load.force[2]}} - exact) / norm(exact);
  return errors;
}

TEST(ImmersedReadOut, OfASphereConvergesWithSecondOrder) {
  for (const bool accelerated : {false, true}) {
    const SphereErrors coarse = read_sphere(24, 3, accelerated);
    const SphereErrors middle = read_sphere(48, 4, accelerated);
    const SphereErrors fine = read_sphere(96, 5, accelerated);
    const double order_p = std::log2(middle.pressure / fine.pressure);
    const double order_f = std::log2(middle.force / fine.force);
    std::printf(
        "sphere %s, R/h 5.5 11 22: rms pressure error %.2e %.2e %.2e (order %.2f), "
        "force error %.2e %.2e %.2e (order %.2f)\n",
        accelerated ? "falling with the gas" : "at rest", coarse.pressure, middle.pressure,
        fine.pressure, order_p, coarse.force, middle.force, fine.force, order_f);
    EXPECT_GT(order_f, 1.7);
    // Vertices on the seams of the divided octahedron have lopsided facets around them: first order
    // there, on a share of the surface that falls with h, so 1.5 in the mean square.
    EXPECT_GT(order_p, 1.4);
    EXPECT_LT(fine.force, 1e-2);
  }
}

TEST(ImmersedLoad, CountsTheExposedPartOfBodiesThatOverlap) {
  const Gas gas;
  const Grid grid = uniform_grid(32, 32, 32, 1.0);
  const double R = .25;
  // A ball sunk to its equator into a block, uniform overpressure on both.
  ImmersedBoundary bodies(grid, gas,
                          {{.name = "ball", .surface = make_sphere({.5, .5, .4}, R, 4)},
                           {.name = "block", .surface = make_box({.1, .1, .1}, {.9, .9, .4}, 32)}},
                          {});
  Fields W(grid);
  W.set(grid, gas, [](double, double, double) {
    return std::array<double, 5>{p0 + 1e3, T0, 0, 0, 0};
  });
  bodies.update_topology(W.view());
  const BodyLoad ball = bodies.load(W.view(), 0, p0);
  const BodyLoad block = bodies.load(W.view(), 1, p0);
  const double half_sphere = 2 * std::numbers::pi * R * R, disc = std::numbers::pi * R * R;
  const double box = 2 * .64 + 4 * .8 * .3;
  std::printf(
      "half-sunk ball: exposed area %.4f (exact %.4f), lift %.2f (exact %.2f); block: area %.4f "
      "(exact %.4f)\n",
      ball.exposed_area, half_sphere, ball.force[2], -1e3 * disc, block.exposed_area, box - disc);
  // Chords of 8 * 4^4 facets take 0.4 % of the area; the block's facets (of .025) at the circle
  // count by quarters: at most a quarter of those cut, 1.5 % of the disc.
  EXPECT_NEAR(ball.exposed_area, half_sphere, .01 * half_sphere);
  EXPECT_NEAR(ball.force[2], -1e3 * disc, .01 * 1e3 * disc);
  EXPECT_NEAR(block.exposed_area, box - disc, .02 * disc);
  // Together they form a closed surface under uniform pressure: no force.
  EXPECT_NEAR(ball.force[2] + block.force[2], 0.0, .02 * 1e3 * disc);
  EXPECT_NEAR(ball.force[0] + block.force[0], 0.0, .01 * 1e3 * disc);
  // Buried vertices carry nothing, exposed ones the pressure, changed by the part that keeps the force:
  // the smear of the rim is second order in facet size over radius (0.6 %), and rim facets, 12 % of
  // the area, count by sixteenths (to 1/32: 0.4 %).
  std::vector<double> p(bodies.position(0).size() / 3);
  bodies.read_overpressure(W.view(), 0, p0, p);
  for (std::size_t v = 0; v < p.size(); ++v) {
    const double z = bodies.position(0)[3 * v + 2];
    if (z < .4 - .05) {
      EXPECT_EQ(p[v], 0.0);
    }
    if (z > .4 + .05) {
      EXPECT_NEAR(p[v], 1e3, 10.0);
    }
  }
  // What a structure integrates, pressure linear over each facet, is the force of the readings.
  const BodySurface& s = bodies.body(0).surface;
  Vec3 force;
  for (std::size_t f = 0; f < s.triangles.size(); f += 3) {
    const Vec3 a = row(s.vertices, s.triangles[f]), b = row(s.vertices, s.triangles[f + 1]),
               c = row(s.vertices, s.triangles[f + 2]);
    const double mean =
        (p[s.triangles[f]] + p[s.triangles[f + 1]] + p[s.triangles[f + 2]]) / 3.0;
    force = force - (0.5 * mean) * cross(b - a, c - a);
  }
  for (int a = 0; a < 3; ++a) {
    EXPECT_NEAR(force[a], ball.force[static_cast<std::size_t>(a)], 1e-9 * std::abs(ball.force[2]));
  }
}

}  // namespace
}  // namespace ocublast::flow
