// States behind walls: exact for what the wall conditions say.
#include <gtest/gtest.h>

#include <cstdio>

#include "flow_solver/immersed/immersed_boundary.hpp"
#include "tests/unit/immersed_boundary_rig.hpp"

namespace ocublast::flow {
namespace {

using namespace testing;

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

}  // namespace
}  // namespace ocublast::flow
