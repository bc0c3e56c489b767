// Paths of walls, nodes that come out of bodies, thin plates and gaps.
#include "flow_solver/immersed/immersed_boundary.hpp"

#include <gtest/gtest.h>

#include <cstdio>

#include "flow_solver/immersed/wall_path.hpp"
#include "tests/unit/immersed_boundary_rig.hpp"

namespace ocublast::flow {
namespace {

using namespace testing;

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
