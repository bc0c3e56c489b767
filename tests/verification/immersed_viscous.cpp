// Viscous gas between immersed cylinders, the inner one turning: exact velocity, torque,
// temperature and heat flux, whatever the angle between wall and grid.
#include <gtest/gtest.h>

#include "flow_solver/immersed/rigid_motion.hpp"
#include "tests/verification/immersed_rig.hpp"

namespace ocublast::flow {
namespace {

using namespace testing;

/// Steady flow between coaxial cylinders without radial motion, exact for a compressible gas of
/// constant viscosity: u = A r + B / r, and the heat of its friction is led away: T = a + b ln r -
/// mu B^2 / (k r^2).
struct Annulus {
  double inner = .5, outer = 1.0;  ///< m
  double omega = .6;               ///< rad/s, of the inner cylinder
  double T_inner = 1.0, T_outer = 1.1;
  double mu = .02, prandtl = .71;
  double x = .013, y = .007;  ///< of the axis

  [[nodiscard]] double conductivity() const { return mu * g / (g - 1) / prandtl; }
  [[nodiscard]] double B() const {
    return omega * inner * inner * outer * outer / (outer * outer - inner * inner);
  }
  [[nodiscard]] double A() const { return -B() / (outer * outer); }
  [[nodiscard]] double heating() const { return mu * B() * B() / conductivity(); }
  [[nodiscard]] double b() const {
    const double i2 = 1 / (inner * inner), o2 = 1 / (outer * outer);
    return (T_outer - T_inner + heating() * (o2 - i2)) / std::log(outer / inner);
  }
  [[nodiscard]] double speed(double r) const { return A() * r + B() / r; }
  [[nodiscard]] double temperature(double r) const {
    return T_inner + heating() * (1 / (inner * inner) - 1 / (r * r)) + b() * std::log(r / inner);
  }
  /// d ln p / dr = u^2 / (R T r), from 1 at the inner wall.
  [[nodiscard]] double pressure(double r) const {
    const int n = 200;
    double sum = 0.0;
    for (int m = 0; m < n; ++m) {
      const double q = inner + (m + .5) * (r - inner) / n;
      sum += speed(q) * speed(q) / (temperature(q) * q) * (r - inner) / n;
    }
    return std::exp(sum);
  }
  /// Per depth: moment of the gas on the inner cylinder, heat into it and into the outer one.
  [[nodiscard]] double torque() const { return -4 * std::numbers::pi * mu * B(); }
  [[nodiscard]] double heat_at(double r) const {
    const double slope = b() / r + 2 * heating() / (r * r * r);
    return 2 * std::numbers::pi * r * conductivity() * slope;
  }
  [[nodiscard]] flow::State state(double at_x, double at_y) const {
    const double dx = at_x - x, dy = at_y - y, r = std::clamp(std::hypot(dx, dy), inner, outer);
    const double p = pressure(r), u = speed(r) / r;
    return {.rho = p / temperature(r), .u = -u * dy, .v = u * dx, .p = p};
  }
};

struct Errors {
  double torque_inner = 0.0, torque_outer = 0.0;  ///< relative
  double heat_inner = 0.0, heat_outer = 0.0;      ///< of the larger of the two fluxes
  double velocity = 0.0, temperature = 0.0;       ///< mean over the gas, of wall speed and of 0.1
};

/// From the exact state until what the walls do wrong has spread over the gap.
Errors turn(const Annulus& a, int n, double t_end) {
  const double half = 1.1;
  const int cells = static_cast<int>(2 * half * n + .5);
  const Grid grid{{make_uniform_axis(-half, half, cells), make_uniform_axis(-half, half, cells),
                   make_absent_axis()}};
  FlowOptions options = unit_gas_options();
  options.viscosity = Viscosity::constant;
  options.dynamic_viscosity = a.mu;
  options.prandtl = a.prandtl;
  options.artificial_diffusivity = false;  // no shocks here
  Flow flow(grid, walls_all_round(), options);
  flow.set_state([&](double x, double y, double) { return a.state(x, y); });
  const bool turns = a.omega != 0.0;
  ImmersedBoundary bodies(
      grid, options.gas,
      {{.name = "inner",
        .surface = make_cylinder(a.x, a.y, a.inner, 6 * n),
        .slip = WallSlip::no_slip,
        .wall_temperature = a.T_inner,
        .moves = turns},
       {.name = "outer",
        .surface = make_ring(a.x, a.y, a.outer, 3.0, 12 * n),
        .slip = WallSlip::no_slip,
        .wall_temperature = a.T_outer}},
      {.gap_block = 0.0, .transport = {.viscosity = a.mu, .prandtl = a.prandtl}});
  immerse(flow, bodies);
  std::vector<double> x, v;
  run(
      flow, bodies, t_end,
      [&](double t, double& dt) {
        if (!turns) return;
        const RigidPath path{.rotation_axis = {0, 0, 1},
                             .rotation_center = {a.x, a.y, 0},
                             .angular_velocity = a.omega};
        place_vertices(bodies.body(0).surface.vertices, Vec3{{a.x, a.y, 0}}, path.at(t + dt), x, v);
        bodies.set_path(0, t, t + dt, x, v);
      },
      nothing_after);
  const BodyLoad inner = bodies.load(flow.primitives(), 0, 1.0),
                 outer = bodies.load(flow.primitives(), 1, 1.0);
  const double depth = 3.0;
  const double flux = std::max(std::abs(a.heat_at(a.inner)), std::abs(a.heat_at(a.outer)));
  Errors e{.heat_inner = (inner.heat / depth - a.heat_at(a.inner)) / flux,
           .heat_outer = (outer.heat / depth + a.heat_at(a.outer)) / flux};
  if (turns) {
    const auto about_axis = [&](const BodyLoad& l) {
      return l.moment[2] - a.x * l.force[1] + a.y * l.force[0];
    };
    e.torque_inner = about_axis(inner) / depth / a.torque() - 1;
    e.torque_outer = -about_axis(outer) / depth / a.torque() - 1;
  }
  int count = 0;
  for (int j = 0; j < cells; ++j) {
    for (int i = 0; i < cells; ++i) {
      if (bodies.tags()[static_cast<std::size_t>(j * cells + i)] != tag_fluid) continue;
      const double dx = grid.axis[0].x(i) - a.x, dy = grid.axis[1].x(j) - a.y,
                   r = std::hypot(dx, dy);
      const auto W = flow.primitives();
      const double u_theta = (dx * W(prim_v, i, j, 0) - dy * W(prim_u, i, j, 0)) / r;
      if (turns) e.velocity += std::abs(u_theta - a.speed(r)) / (a.omega * a.inner);
      e.temperature += std::abs(W(prim_T, i, j, 0) - a.temperature(r)) / .1;
      ++count;
    }
  }
  e.velocity /= count;
  e.temperature /= count;
  return e;
}

void print(const char* what, int n, const Errors& e) {
  std::printf(
      "%s, %d cells across the gap: torque %+.2f %% inner, %+.2f %% outer, heat %+.2f %% inner, "
      "%+.2f %% outer, "
      "velocity %.1e, temperature %.1e in the mean\n",
      what, n / 2, 100 * e.torque_inner, 100 * e.torque_outer, 100 * e.heat_inner,
      100 * e.heat_outer, e.velocity, e.temperature);
}

TEST(ImmersedAnnulus, LeadsHeatBetweenItsWalls) {
  const Annulus a{.omega = 0.0};
  const Errors coarse = turn(a, 16, 1.0), fine = turn(a, 32, 1.0);
  print("heat between cylinders at rest", 16, coarse);
  print("heat between cylinders at rest", 32, fine);
  std::printf("orders: temperature %.1f\n", std::log2(coarse.temperature / fine.temperature));
  EXPECT_LT(std::abs(fine.heat_inner), .02);
  EXPECT_LT(std::abs(fine.heat_outer), .02);
  EXPECT_GT(std::log2(coarse.temperature / fine.temperature), 1.5);
}

TEST(ImmersedAnnulus, TurnsTheGasWithTheExactTorque) {
  const Annulus a;
  const Errors coarse = turn(a, 16, 1.0), fine = turn(a, 32, 1.0);
  print("inner cylinder turning", 16, coarse);
  print("inner cylinder turning", 32, fine);
  std::printf("orders: velocity %.1f, temperature %.1f\n",
              std::log2(coarse.velocity / fine.velocity),
              std::log2(coarse.temperature / fine.temperature));
  EXPECT_LT(std::abs(fine.torque_inner), .02);
  EXPECT_LT(std::abs(fine.torque_outer), .02);
  EXPECT_GT(std::log2(coarse.velocity / fine.velocity), 1.5);
}

}  // namespace
}  // namespace ocublast::flow
