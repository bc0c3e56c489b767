#include "flow_solver/immersed/immersed_boundary.hpp"

#include <gtest/gtest.h>

#include <cstdio>

#include "flow_solver/immersed/surface.hpp"
#include "flow_solver/immersed/wall_path.hpp"
#include "tests/unit/immersed_shapes.hpp"

namespace ocublast::flow {
namespace {

using namespace testing;

constexpr double p0 = 1e5;
constexpr double T0 = 300.0;

/// Half space below a line inclined by `degrees`, as a block much larger than the grid.
Body make_ramp(double degrees, WallSlip slip, double T_wall, bool moves) {
  const double angle = degrees * std::numbers::pi / 180.0;
  const double c = std::cos(angle), s = std::sin(angle);
  const auto at = [&](double t, double n) {
    return std::array<double, 2>{.5 + c * t - s * n, .37 + s * t + c * n};
  };
  // The wall in pieces of two cells, so that the read-out finds facets inside the grid.
  std::vector<std::array<double, 2>> polygon = {at(-3, -2), at(3, -2)};
  for (int n = 96; n >= -96; --n) polygon.push_back(at(n / 32.0, 0));
  return {.name = "ramp",
          .surface = make_prism(polygon, -1.0, 2.0),
          .slip = slip,
          .wall_temperature = T_wall,
          .moves = moves};
}

struct RampFrame {
  Vec3 n, t, foot;
  explicit RampFrame(double degrees) {
    const double angle = degrees * std::numbers::pi / 180.0;
    t = {{std::cos(angle), std::sin(angle), 0}};
    n = {{-std::sin(angle), std::cos(angle), 0}};
    foot = {{.5, .37, 0}};
  }
  [[nodiscard]] double height(double x, double y) const { return dot(Vec3{{x, y, 0}} - foot, n); }
};

/// Calls check(height of the ghost node above the wall, ghost state, layer) for all ghosts.
template <class Check>
void for_all_ghosts(const Grid& grid, const ImmersedBoundary& bodies, const RampFrame& frame,
                    const Check& check) {
  for (int a = 0; a < 2; ++a) {
    const CutLines& lines = bodies.lines(a);
    for (const Segment& s : lines.segments) {
      for (const int side : {-1, 1}) {
        const int wall = side < 0 ? s.wall_low : s.wall_high;
        if (wall < 0) continue;
        for (int layer = 0; layer < n_ghost; ++layer) {
          const int along = side < 0 ? s.begin - 1 - layer : s.end + layer;
          const double x = a == 0 ? grid.axis[0].x(along) : grid.axis[0].x(s.b);
          const double y = a == 1 ? grid.axis[1].x(along) : grid.axis[1].x(s.b);
          // Near the grid's rim the image lies beyond its ghosts.
          if (std::min({x, y, 1 - x, 1 - y}) < .2) continue;
          check(frame.height(x, y),
                &lines.ghost[(static_cast<std::size_t>(wall) * n_ghost + layer) * n_primitive],
                layer);
        }
      }
    }
  }
}

TEST(ImmersedGhosts, AreExactForNormalVelocityLinearInTheDistance) {
  const Gas gas;
  const Grid grid = uniform_grid(32, 32, 1, 1.0);
  const RampFrame frame(17.0);
  for (const WallSlip slip : {WallSlip::slip, WallSlip::no_slip}) {
    for (const double T_wall : {0.0, 320.0}) {
      ImmersedBoundary bodies(grid, gas, {make_ramp(17.0, slip, T_wall, false)}, {});
      const double shear = slip == WallSlip::no_slip ? 40.0 : 0.0;
      const double T_slope = T_wall > 0.0 ? 100.0 : 0.0;
      Fields W(grid);
      W.set(grid, gas, [&](double x, double y, double) {
        const double d = frame.height(x, y);
        const Vec3 u = (25.0 * d) * frame.n + (slip == WallSlip::slip ? 70.0 : shear * d) * frame.t;
        return std::array<double, 5>{p0, T_wall > 0.0 ? T_wall + T_slope * d : T0, u[0], u[1],
                                     3.0 * (slip == WallSlip::slip)};
      });
      bodies.update_topology(W.view());
      bodies.compute_ghosts(W.view());
      double worst = 0.0;
      int n = 0;
      for_all_ghosts(grid, bodies, frame, [&](double d, const double* g, int) {
        if (-d > 3.4 / 32) return;  // deeper ghosts are continued as a constant
        const Vec3 u = (25.0 * d) * frame.n + (slip == WallSlip::slip ? 70.0 : shear * d) * frame.t;
        const double T = T_wall > 0.0 ? T_wall + T_slope * d : T0;
        worst = std::max({worst, std::abs(g[prim_u] - u[0]), std::abs(g[prim_v] - u[1]),
                          std::abs(g[prim_T] - T),
                          std::abs(pressure(gas, g[prim_rho], g[prim_T]) - p0) / p0});
        ++n;
      });
      EXPECT_GT(n, 80);
      // Sums of eight products of numbers up to 400: 1e-12; the foot's place: 1e-14 of slopes of
      // 100.
      EXPECT_LT(worst, 1e-11);
      EXPECT_EQ(bodies.n_fallbacks(), 0U);
    }
  }
}

TEST(ImmersedGhosts, ContinueUniformFlowAlongAWallUnchanged) {
  const Gas gas;
  const Grid grid = uniform_grid(32, 32, 1, 1.0);
  for (const double degrees : {0.0, 30.0, 45.0, -71.0}) {
    const RampFrame frame(degrees);
    ImmersedBoundary bodies(grid, gas, {make_ramp(degrees, WallSlip::slip, 0.0, false)}, {});
    Fields W(grid);
    W.set(grid, gas, [&](double, double, double) {
      return std::array<double, 5>{p0, T0, 200 * frame.t[0], 200 * frame.t[1], 10.0};
    });
    bodies.update_topology(W.view());
    bodies.compute_ghosts(W.view());
    double worst = 0.0;
    for_all_ghosts(grid, bodies, frame, [&](double, const double* g, int) {
      worst = std::max({worst, std::abs(g[prim_u] - 200 * frame.t[0]),
                        std::abs(g[prim_v] - 200 * frame.t[1]), std::abs(g[prim_T] - T0),
                        std::abs(g[prim_w] - 10.0)});
    });
    EXPECT_LT(worst, 1e-11);  // rounding of unit normals times 200 m/s, of weights times 300 K
    // All fields of band nodes are finite and continue the flow as well.
    std::size_t n = 0;
    for (int j = 0; j < 32; ++j)
      for (int i = 0; i < 32; ++i, ++n)
        if (bodies.tags()[n] == tag_band) {
          ASSERT_NEAR(W.view()(prim_T, i, j, 0), T0, 1e-10);
        }
  }
}

/// Moves all vertices by the same path of constant acceleration over [0, t].
void set_uniform_acceleration(ImmersedBoundary& bodies, std::size_t b, double t, const Vec3& a) {
  std::vector<double> x(bodies.position(b).begin(), bodies.position(b).end());
  std::vector<double> v(x.size());
  for (std::size_t n = 0; n < x.size(); ++n) {
    x[n] += .5 * a.c[n % 3] * t * t;
    v[n] = a.c[n % 3] * t;
  }
  bodies.set_path(b, 0.0, t, x, v);
}

TEST(ImmersedGhosts, TakeThePressureSlopeOfAnAcceleratedWall) {
  const Gas gas;
  const Grid grid = uniform_grid(32, 32, 1, 1.0);
  const RampFrame frame(17.0);
  ImmersedBoundary bodies(grid, gas, {make_ramp(17.0, WallSlip::slip, 0.0, true)}, {});
  const double rho = density(gas, p0, T0);
  const double a_n = 1e4;
  Fields W(grid);
  W.set(grid, gas, [&](double x, double y, double) {
    const double p = p0 - rho * a_n * frame.height(x, y);
    return std::array<double, 5>{p, p / (rho * gas.gas_constant), 0, 0, 0};
  });
  bodies.update_topology(W.view());
  set_uniform_acceleration(bodies, 0, 1e-6, a_n * frame.n);
  bodies.move_to(0.0);
  bodies.compute_ghosts(W.view());
  double worst = 0.0;
  for_all_ghosts(grid, bodies, frame, [&](double d, const double* g, int) {
    worst = std::max(worst, std::abs(pressure(gas, g[prim_rho], g[prim_T]) - (p0 - rho * a_n * d)));
  });
  // The acceleration of the path is a difference of positions: 1e-16 * 1 m / (1e-6 s)^2 * 6 = 6e-4
  // of 1e4 m/s^2, times rho * 0.2 m.
  EXPECT_LT(worst, 1e-3);

  // The read-out at the wall is exact for the same field.
  std::vector<double> p(bodies.position(0).size() / 3);
  const BodyLoad load = bodies.load(W.view(), 0, p0);
  EXPECT_GT(load.exposed_area, 0.0);
  EXPECT_NEAR(load.force[0] / load.exposed_area, 0.0, 1e-3);
  EXPECT_NEAR(load.force[1] / load.exposed_area, 0.0, 1e-3);
}

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

TEST(ImmersedPath, EndsExactlyAndIsConsistentInVelocityAndAcceleration) {
  const std::vector<double> start = {0, 1, 2, -1, .5, .25};
  WallPath path(start);
  const std::vector<double> x1 = {.1, 1.2, 1.9, -1.1, .4, .3}, v1 = {2, -1, .3, 0, 4, 1};
  const std::vector<double> x2 = {.3, 1.1, 1.8, -1.0, .6, .2}, v2 = {1, 1, 1, -2, 0, 3};
  std::vector<double> x, v, a, xm, vm, am, xp, vp, ap;
  path.set_cubic(1.0, 1.1, x1, v1);
  path.evaluate(1.1, x, v, a);
  EXPECT_EQ(x, x1);
  EXPECT_EQ(v, v1);
  path.set_cubic(1.1, 1.3, x2, v2);
  path.evaluate(1.1, x, v, a);
  EXPECT_EQ(x, x1);
  EXPECT_EQ(v, v1);
  path.evaluate(1.3, x, v, a);
  EXPECT_EQ(x, x2);
  EXPECT_EQ(v, v2);
  const double e = 1e-5;
  for (const double t : {1.12, 1.2, 1.29}) {
    path.evaluate(t - e, xm, vm, am);
    path.evaluate(t, x, v, a);
    path.evaluate(t + e, xp, vp, ap);
    for (std::size_t n = 0; n < x.size(); ++n) {
      // A cubic: the central difference of position errs by c e^2, c < 1e3; of velocity not at all;
      // rounding: 1e-16 / e.
      EXPECT_NEAR((xp[n] - xm[n]) / (2 * e), v[n], 1e-6);
      EXPECT_NEAR((vp[n] - vm[n]) / (2 * e), a[n], 1e-8 * std::max(1.0, std::abs(a[n])) + 1e-9);
    }
  }
  // The acceleration at the ends is the limit from inside.
  path.evaluate(1.3, x, v, a);
  path.evaluate(1.3 - 1e-7, xm, vm, am);
  for (std::size_t n = 0; n < x.size(); ++n) EXPECT_NEAR(a[n], am[n], 1e-2);
  path.evaluate(2.0, x, v, a);
  EXPECT_EQ(x, x2);
  EXPECT_EQ(v, std::vector<double>(6, 0.0));
  path.set_straight(1.3, 1.5, x1);
  path.evaluate(1.4, x, v, a);
  for (std::size_t n = 0; n < x.size(); ++n) {
    EXPECT_NEAR(x[n], .5 * (x1[n] + x2[n]), 1e-15);
    EXPECT_NEAR(v[n], (x1[n] - x2[n]) / .2, 1e-13);
    EXPECT_NEAR(a[n], 0.0, 1e-13);  // rounding of the velocity over the interval
  }
}

/// Shifts body 0 along x by `shift` in a window of unit length starting at t.
void shift_body(ImmersedBoundary& bodies, double t, double shift) {
  std::vector<double> x(bodies.position(0).begin(), bodies.position(0).end());
  for (std::size_t n = 0; n < x.size(); n += 3) x[n] += shift;
  bodies.set_straight_path(0, t, t + 1.0, x);
  bodies.move_to(t + 1.0);
}

TEST(ImmersedFreshNodes, KeepTheValueTheyHeldInTheBody) {
  const Gas gas;
  const Grid grid = uniform_grid(40, 1, 1, 1.0);
  // Body from .3 to .7125 (node 28 is at .7125): its right wall moves left over node 28.
  ImmersedBoundary bodies(
      grid, gas,
      {{.name = "piston", .surface = make_box({.3, -1, -1}, {.715, 2, 2}), .moves = true}}, {});
  Fields W(grid);
  W.set(grid, gas, [&](double x, double, double) {
    return std::array<double, 5>{p0 * (1 + x), T0, 0, 0, 0};
  });
  bodies.update_topology(W.view());
  bodies.compute_ghosts(W.view());
  EXPECT_EQ(bodies.tags()[28], tag_band);
  const double held = W.view()(prim_rho, 28, 0, 0);
  shift_body(bodies, 0.0, -.005);
  const TopologyReport report = bodies.update_topology(W.view());
  EXPECT_EQ(report.fresh_nodes, 1U);
  EXPECT_EQ(report.rebuilt_nodes, 0U);
  EXPECT_EQ(bodies.tags()[28], tag_fluid);
  EXPECT_EQ(W.view()(prim_rho, 28, 0, 0), held);
  // Nothing moved since: the same topology, no fresh nodes.
  EXPECT_EQ(bodies.update_topology(W.view()).fresh_nodes, 0U);
}

TEST(ImmersedFreshNodes, OfAThinPlateAreRebuiltFromTheSideTheyComeOutOn) {
  const Gas gas;
  const Grid grid = uniform_grid(40, 1, 1, 1.0);
  const double h = .025;
  // A plate of 0.2 cells with node 20 (x = .5125) inside, close behind its right wall; high
  // pressure on its left.
  const double left = .5125 - .15 * h;
  ImmersedBoundary bodies(grid, gas,
                          {{.name = "plate",
                            .surface = make_box({left, -1, -1}, {left + .2 * h, 2, 2}),
                            .moves = true}},
                          {});
  Fields W(grid);
  W.set(grid, gas, [&](double x, double, double) {
    return std::array<double, 5>{x < left ? 3 * p0 : p0, T0, 0, 0, 0};
  });
  const auto p20 = [&] {
    return pressure(gas, W.view()(prim_rho, 20, 0, 0), W.view()(prim_T, 20, 0, 0));
  };
  bodies.update_topology(W.view());
  bodies.compute_ghosts(W.view());
  EXPECT_EQ(bodies.tags()[20], tag_band);
  EXPECT_NEAR(p20(), p0, 1e-9 * p0);  // held from the nearest side, the right
  shift_body(bodies, 0.0, .18 * h);
  const TopologyReport report = bodies.update_topology(W.view());
  EXPECT_EQ(report.fresh_nodes, 1U);
  EXPECT_EQ(report.rebuilt_nodes, 1U);
  EXPECT_EQ(bodies.tags()[20], tag_fluid);
  EXPECT_NEAR(p20(), 3 * p0, 1e-9 * p0);
}

TEST(ImmersedStep, IsLimitedByHalfTheThicknessAndByAThirdOfACell) {
  const Gas gas;
  const Grid grid = uniform_grid(40, 1, 1, 1.0);
  const double h = .025;
  for (const double thickness : {5 * h, .2 * h}) {
    ImmersedBoundary bodies(grid, gas,
                            {{.name = "plate",
                              .surface = make_box({.5, -1, -1}, {.5 + thickness, 2, 2}),
                              .moves = true}},
                            {});
    Fields W(grid);
    W.set(grid, gas, [&](double, double, double) {
      return std::array<double, 5>{p0, T0, 0, 0, 0};
    });
    bodies.update_topology(W.view());
    EXPECT_EQ(bodies.wall_step_limit(), HUGE_VAL);
    std::vector<double> x(bodies.position(0).begin(), bodies.position(0).end());
    for (std::size_t n = 0; n < x.size(); n += 3) x[n] += 1e-3;
    bodies.set_straight_path(0, 0.0, 1e-4, x);  // 10 m/s
    EXPECT_NEAR(bodies.wall_step_limit(), std::min(.3 * h, .5 * thickness) / 10.0, 1e-12);
  }
}

TEST(ImmersedWalls, OfAPlateDoNotSeeTheOtherSide) {
  const Gas gas;
  const Grid grid = uniform_grid(40, 40, 1, 1.0);
  // Two thin plates 1.6 cells apart: three regions with pressures that must not mix.
  const double c = std::cos(.3), s = std::sin(.3);
  const auto plate = [&](double offset) {
    const auto at = [&](double n, double t) {
      return std::array<double, 2>{.5 + c * n - s * t, .5 + s * n + c * t};
    };
    return make_prism(
        {at(offset, -1), at(offset + .0025, -1), at(offset + .0025, 1), at(offset, 1)}, -1, 2);
  };
  ImmersedBoundary bodies(
      grid, gas, {{.name = "a", .surface = plate(0)}, {.name = "b", .surface = plate(.04)}}, {});
  const auto region = [&](double x, double y) {
    const double n = c * (x - .5) + s * (y - .5);
    return n < .00125 ? 0 : (n < .04125 ? 1 : 2);
  };
  Fields W(grid);
  W.set(grid, gas, [&](double x, double y, double) {
    return std::array<double, 5>{p0 * (1 + 2 * region(x, y)), T0, 0, 0, 0};
  });
  bodies.update_topology(W.view());
  bodies.compute_ghosts(W.view());
  int wrong = 0, n = 0;
  for (int a = 0; a < 2; ++a) {
    for (const Segment& seg : bodies.lines(a).segments) {
      const double x = grid.axis[0].x(a == 0 ? seg.begin : seg.b);
      const double y = grid.axis[1].x(a == 1 ? seg.begin : seg.b);
      // At the rim the ghosts of the domain are those of this field, not of a mirror.
      if (seg.b < 8 || seg.b >= 32) continue;
      for (const int wall : {seg.wall_low, seg.wall_high}) {
        if (wall < 0) continue;
        for (int layer = 0; layer < n_ghost; ++layer, ++n) {
          const double* g =
              &bodies.lines(a)
                   .ghost[(static_cast<std::size_t>(wall) * n_ghost + layer) * n_primitive];
          wrong += std::abs(pressure(gas, g[0], g[4]) / p0 - (1 + 2 * region(x, y))) > 1e-9 ? 1 : 0;
        }
      }
    }
  }
  EXPECT_GT(n, 300);
  EXPECT_EQ(wrong, 0);
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

TEST(ImmersedGap, UnderABodyCloseToAWallOfTheDomainIsBlockedOnRequest) {
  const Gas gas;
  const Grid grid = uniform_grid(40, 20, 1, 2.0);  // h = 0.05
  ImmersedOptions options;
  Fields W(grid);
  W.set(grid, gas, [](double, double, double) { return std::array<double, 5>{p0, T0, 0, 0, 0}; });
  for (const bool is_wall : {false, true}) {
    options.domain_wall[2] = is_wall;
    ImmersedBoundary bodies(
        grid, gas, {{.name = "lid", .surface = make_box({.5, .04, -1}, {1.5, .5, 2}, 8)}}, options);
    const TopologyReport report = bodies.update_topology(W.view());
    EXPECT_EQ(report.blocked_segments, is_wall ? 20U : 0U);  // the 20 columns under the lid
    bodies.compute_ghosts(W.view());
    EXPECT_EQ(bodies.n_fallbacks(), 0U);
  }
}

}  // namespace
}  // namespace ocublast::flow
