// Pressure and load read at surfaces.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

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

/// A cylinder pushed through a pressure linear in x, by a fiftieth of a spacing at a time.
TEST(ImmersedReadOut, ChangesSmoothlyWhenTheWallPassesNodes) {
  const Gas gas;
  const int n = 48;
  const double h = 1.0 / n, slope = 1e4, step = h / 50;
  const Grid grid = uniform_grid(n, n, 1, 1.0);
  ImmersedBoundary bodies(
      grid, gas,
      {{.name = "cylinder", .surface = make_cylinder(.4, .5, 8.5 * h, 60), .moves = true}}, {});
  Fields W(grid);
  W.set(grid, gas, [&](double x, double, double) {
    return std::array<double, 5>{p0 + slope * x, T0, 0, 0, 0};
  });
  bodies.update_topology(W.view());
  std::vector<double> x(bodies.position(0).begin(), bodies.position(0).end());
  std::vector<double> read(x.size() / 3), before;
  double worst = 0.0;
  for (int s = 0; s < 60; ++s) {
    bodies.read_overpressure(W.view(), 0, p0, read);
    for (std::size_t a = 0; a < before.size(); ++a)
      worst = std::max(worst, std::abs(read[a] - before[a] - slope * step));
    before = read;
    for (std::size_t a = 0; a < x.size(); a += 3) x[a] += step;
    bodies.set_straight_path(0, s, s + 1, x);
    bodies.move_to(s + 1);
    bodies.update_topology(W.view());
  }
  std::printf(
      "cylinder through a linear pressure, 0.02 h at a time: off the slope by up to %.3f h of it\n",
      worst / slope / h);
  // A weight changes by 0.04 of itself in such a step, at nodes up to 2 h in front of the wall. A
  // node that came with its weight at once would count by some tenths of h.
  EXPECT_LT(worst, .04 * 2 * h * slope);
}

struct PeakErrors {
  double mean = 0.0, worst = 0.0;  ///< of the top read, of the exact one
};

/// A round peak of pressure of half width w spacings on a cylinder or a ball, e^(-ln 2 (s^2 + d^2)
/// / w^2) at way s along the wall and distance d from it: as high as p0, its top in any direction,
/// the body anywhere among the nodes.
PeakErrors read_peak(bool ball, double cells_per_radius, double w, int places) {
  const Gas gas;
  const int n = static_cast<int>(2 * cells_per_radius) + 12;
  const double h = 1.0 / n, R = cells_per_radius * h;
  const Grid grid = uniform_grid(n, n, ball ? n : 1, 1.0);
  PeakErrors errors;
  for (int q = 0; q < places; ++q) {
    const double turn = std::fmod(.37 * q, 1.0), other = std::fmod(.23 * q, 1.0);
    const Vec3 c = {{.5 + turn * h, .5 + other * h, ball ? .5 + .5 * (turn + other) * h : .5}};
    const double angle = 2 * std::numbers::pi * std::fmod(.618 * q, 1.0),
                 up = ball ? 1.6 * other - .8 : 0.0;
    const double flat = std::sqrt(1 - up * up);
    const Vec3 top = {{flat * std::cos(angle), flat * std::sin(angle), up}};
    const auto p = [&](double x, double y, double z) {
      const Vec3 r = {{x - c[0], y - c[1], ball ? z - c[2] : 0.0}};
      const double s = R * std::acos(std::clamp(dot(r, top) / norm(r), -1.0, 1.0)), d = norm(r) - R;
      return p0 * (1 + std::exp(-std::log(2.0) * (s * s + d * d) / (w * w * h * h)));
    };
    ImmersedBoundary bodies(
        grid, gas,
        {{.name = "body",
          .surface = ball ? make_sphere(c.c, R, 5)
                          : make_cylinder(c[0], c[1], R, static_cast<int>(12 * cells_per_radius))}},
        {});
    Fields W(grid);
    W.set(grid, gas, [&](double x, double y, double z) {
      return std::array<double, 5>{p(x, y, z), T0, 0, 0, 0};
    });
    bodies.update_topology(W.view());
    std::vector<double> read(bodies.position(0).size() / 3);
    bodies.read_overpressure(W.view(), 0, p0, read);
    const double error = *std::max_element(read.begin(), read.end()) / p0 - 1;
    errors.mean += error / places;
    errors.worst = std::min(errors.worst, error);
  }
  return errors;
}

TEST(ImmersedReadOut, SeesThePeaksThatTheNodesResolve) {
  struct Row {
    bool ball;
    double cells_per_radius, w, mean, worst;
  };
  // A peak of half width w has the curvature 2 ln 2 / w^2. A mean over .75 spacings along the wall
  // and from it, of a fit without curvature, takes .78 / w^2 of it away in two directions (19 and 9
  // %), in three a half more. A fit of second order is wrong by fourth derivatives, 12 (ln 2)^2 /
  // w^4 times 1/24 of the fourth power of the nodes' distances, 1.1 spacings in the mean: 2.2 % in
  // each direction at half width 2, 0.4 % at 3; the damping of its terms takes a tenth of what the
  // fit adds, facets of half a spacing round the top off by .6 and .3 %.
  for (const Row& row : {Row{false, 16, 2, .05, .07}, Row{false, 16, 3, .02, .03},
                         Row{true, 8, 2, .09, .10}, Row{true, 8, 3, .035, .04}}) {
    const PeakErrors e = read_peak(row.ball, row.cells_per_radius, row.w, row.ball ? 6 : 24);
    std::printf(
        "peak of half width %.0f h on a %s, R/h %.0f: top read %+.1f %%, at worst %+.1f %%\n",
        row.w, row.ball ? "ball" : "cylinder", row.cells_per_radius, 100 * e.mean, 100 * e.worst);
    EXPECT_LT(std::abs(e.mean), row.mean);
    EXPECT_LT(std::abs(e.worst), row.worst);
  }
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
  // Buried vertices carry nothing, exposed ones the pressure, changed by the part that keeps the
  // force: the smear of the rim is second order in facet size over radius (0.6 %), and rim facets,
  // 12 % of the area, count by sixteenths (to 1/32: 0.4 %).
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
    const double mean = (p[s.triangles[f]] + p[s.triangles[f + 1]] + p[s.triangles[f + 2]]) / 3.0;
    force = force - (0.5 * mean) * cross(b - a, c - a);
  }
  for (int a = 0; a < 3; ++a) {
    EXPECT_NEAR(force[a], ball.force[static_cast<std::size_t>(a)], 1e-9 * std::abs(ball.force[2]));
  }
}

/// Forces at the vertices of `surface`, sunk into a block up to z = .43 under a pressure that
/// varies, against force, moment and power of its facets.
void compare_forces_with_facets(const char* name, BodySurface surface) {
  const Gas gas;
  const Grid grid = uniform_grid(32, 32, 32, 1.0);
  ImmersedBoundary bodies(grid, gas,
                          {{.name = name, .surface = std::move(surface), .moves = true},
                           {.name = "block", .surface = make_box({.1, .1, .1}, {.9, .9, .43}, 8)}},
                          {});
  Fields W(grid);
  W.set(grid, gas, [](double x, double y, double z) {
    return std::array<double, 5>{p0 * (1.1 + .1 * x - .2 * y * z), T0, 0, 0, 0};
  });
  // A velocity that no rigid body has.
  const std::vector<double> x(bodies.position(0).begin(), bodies.position(0).end());
  std::vector<double> v(x.size());
  for (std::size_t n = 0; n < v.size(); n += 3) {
    v[n] = 3.0 * x[n + 2];
    v[n + 1] = 1.0 - x[n] * x[n];
    v[n + 2] = std::sin(20.0 * x[n]) + x[n + 1];
  }
  bodies.set_path(0, 0.0, 1e-4, x, v);
  bodies.move_to(1e-4);
  bodies.update_topology(W.view());
  std::vector<double> force(x.size());
  bodies.read_force(W.view(), 0, p0, force);
  const BodyLoad load = bodies.load(W.view(), 0, p0);
  Vec3 sum, moment;
  double power = 0.0, power_size = 0.0;
  for (std::size_t n = 0; n < x.size(); n += 3) {
    const Vec3 f{{force[n], force[n + 1], force[n + 2]}};
    const double part = dot(f, Vec3{{v[n], v[n + 1], v[n + 2]}});
    sum = sum + f;
    moment = moment + cross(Vec3{{x[n], x[n + 1], x[n + 2]}}, f);
    power += part;
    power_size += std::abs(part);
  }
  std::printf("%s: power of facets %.4f W, of forces %.4f W\n", name, load.power, power);
  // The same sums in another order: rounding of some 2000 terms.
  const double size = norm(sum);
  for (int a = 0; a < 3; ++a) {
    EXPECT_NEAR(sum[a], load.force[static_cast<std::size_t>(a)], 1e-12 * size);
    EXPECT_NEAR(moment[a], load.moment[static_cast<std::size_t>(a)], 1e-12 * size);
  }
  EXPECT_NEAR(power, load.power, 1e-12 * power_size);
}

BodySurface box_of_quads(const P3& low, const P3& high, int n) {
  BodySurface box = make_box(low, high, n);
  box.n_quads = box.triangles.size() / 6;
  return box;
}

TEST(ImmersedLoad, GivesForcesThatHaveForceMomentAndPowerOfCutFacets) {
  compare_forces_with_facets("ball of triangles", make_sphere({.5, .5, .4}, .25, 3));
  compare_forces_with_facets("box of quads", box_of_quads({.3, .3, .2}, {.7, .7, .61}, 7));
}

TEST(ImmersedLoad, LoadsAllCornersOfAQuadAlike) {
  const Gas gas;
  const Grid grid = uniform_grid(24, 24, 24, 1.0);
  for (const bool quads : {true, false}) {
    BodySurface box = box_of_quads({.3, .3, .3}, {.7, .7, .7}, 5);
    if (!quads) box.n_quads = 0;
    ImmersedBoundary bodies(grid, gas, {{.name = "box", .surface = box}}, {});
    Fields W(grid);
    W.set(grid, gas, [](double, double, double) {
      return std::array<double, 5>{1.5 * p0, T0, 0, 0, 0};
    });
    bodies.update_topology(W.view());
    std::vector<double> force(box.vertices.size());
    bodies.read_force(W.view(), 0, p0, force);
    const double whole = .5 * p0 * .08 * .08;  // of a square
    // A corner of the box has a quarter of a square on each of its three faces.
    double smallest = whole, largest = 0.0;
    for (std::size_t v = 0; v < force.size(); v += 3) {
      const double* x = &box.vertices[v];
      if (std::any_of(x, x + 3, [](double c) { return c > .31 && c < .69; })) continue;
      for (std::size_t a = 0; a < 3; ++a) {
        smallest = std::min(smallest, std::abs(force[v + a]));
        largest = std::max(largest, std::abs(force[v + a]));
      }
    }
    std::printf("%s: corners of a box carry %.4f to %.4f of a square's load\n",
                quads ? "quads" : "triangles", smallest / whole, largest / whole);
    if (!quads) continue;
    EXPECT_NEAR(smallest, .25 * whole,
                1e-12 * whole);  // rounding of a uniform p: some 10 operations on 1e5 Pa
    EXPECT_NEAR(largest, .25 * whole, 1e-12 * whole);
  }
}

}  // namespace
}  // namespace ocublast::flow
