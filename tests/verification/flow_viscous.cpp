#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <numbers>
#include <vector>

#include "tests/verification/flow_run.hpp"

namespace ocublast::flow {
namespace {

using std::numbers::pi;

FlowOptions viscous_options(double mu, double prandtl) {
  FlowOptions o = unit_options();
  o.viscosity = Viscosity::constant;
  o.dynamic_viscosity = mu;
  o.prandtl = prandtl;
  o.artificial_diffusivity = false;
  return o;
}

/// Periodic direction of unit length, uniform or with +-30 % of spacing; refining three times keeps
/// the old nodes.
Axis periodic_axis(int n, bool stretched) {
  std::vector<double> nodes;
  for (int i = 0; i < n; ++i) {
    const double s = (i + 0.5) / n;
    nodes.push_back(stretched ? s + 0.3 / (2.0 * pi) * std::sin(2.0 * pi * s) : s);
  }
  return make_axis_from_nodes(0.0, 1.0, nodes, true);
}

/// Taylor and Green's vortices of speed `mach` c in the plane of the axes a and b.
Flow make_vortices(int n, bool stretched, double mach, const FlowOptions& o, std::size_t a = 0,
                   std::size_t b = 1) {
  Grid g;
  g.axis = {make_absent_axis(), make_absent_axis(), make_absent_axis()};
  if (a != 0) g.axis[0] = make_uniform_axis(0.0, 1.0, 8, true);
  g.axis[a] = g.axis[b] = periodic_axis(n, stretched);
  Flow flow(g, all_faces(BoundaryKind::periodic), o);
  const double U = mach * std::sqrt(1.4);
  flow.set_state([&](double x, double y, double z) {
    const double at[3] = {x, y, z}, k = 2.0 * pi;
    const double s = k * at[a], t = k * at[b];
    double u[3] = {};
    u[a] = U * std::sin(s) * std::cos(t);
    u[b] = -U * std::cos(s) * std::sin(t);
    return State{.rho = 1.0,
                 .u = u[0],
                 .v = u[1],
                 .w = u[2],
                 .p = 1.0 + 0.25 * U * U * (std::cos(2.0 * s) + std::cos(2.0 * t))};
  });
  return flow;
}

/// Velocity component `c` after `end`, in steps whose error is far below that of space.
std::vector<double> vortex_field(int n, bool stretched, int c) {
  FlowOptions o = viscous_options(0.01, 0.71);
  Flow flow = make_vortices(n, stretched, 0.5, o);
  constexpr double end = 0.1;
  const int steps = 2 * n;  // Courant number 0.18: the time error is below 1e-8
  for (int s = 0; s < steps; ++s) flow.advance(s * end / steps, end / steps);
  std::vector<double> out;
  const auto W = std::as_const(flow).primitives();
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) out.push_back(W(c, i, j, 0));
  }
  return out;
}

TEST(TaylorGreen, ConvergesWithSixthOrderAlsoOnAStretchedGrid) {
  for (const bool stretched : {false, true}) {
    constexpr int finest = 126;
    const std::vector<double> reference = vortex_field(finest, stretched, 1);
    std::vector<double> errors;
    for (const int n : {14, 42}) {
      const std::vector<double> u = vortex_field(n, stretched, 1);
      const int ratio = finest / n;
      double error = 0.0;
      for (int j = 0; j < n; ++j) {
        for (int i = 0; i < n; ++i) {
          const auto fine =
              static_cast<std::size_t>((ratio * j + ratio / 2) * finest + ratio * i + ratio / 2);
          error += std::abs(u[static_cast<std::size_t>(j * n + i)] - reference[fine]) / (n * n);
        }
      }
      errors.push_back(error);
    }
    const double order = std::log(errors[0] / errors[1]) / std::log(3.0);
    std::printf("Taylor-Green %s: L1(u) %.2e (14) -> %.2e (42), order %.2f\n",
                stretched ? "stretched" : "uniform", errors[0], errors[1], order);
    EXPECT_GT(order, 5.0);
  }
}

TEST(TaylorGreen, DecaysAtTheRateOfTheGas) {
  constexpr double nu = 0.01, mach = 0.05;
  for (const auto& [a, b] : {std::pair<std::size_t, std::size_t>{0, 1}, {0, 2}, {1, 2}}) {
    Flow flow = make_vortices(24, false, mach, viscous_options(nu, 0.71), a, b);
    const auto kinetic = [&] {
      double sum = 0.0;
      const auto W = std::as_const(flow).primitives();
      const Grid& g = flow.grid();
      for (int k = 0; k < g.axis[2].n; ++k) {
        for (int j = 0; j < g.axis[1].n; ++j) {
          for (int i = 0; i < g.axis[0].n; ++i) {
            for (int c = 1; c < 4; ++c) sum += W(0, i, j, k) * W(c, i, j, k) * W(c, i, j, k);
          }
        }
      }
      return sum;
    };
    const double before = kinetic();
    constexpr double end = 0.5;
    run_to(flow, end);
    const double rate = -std::log(kinetic() / before) / end, exact = 4.0 * nu * 4.0 * pi * pi;
    std::printf("Taylor-Green in %c%c, Mach %.2f: decay %.5f, incompressible %.5f\n", "xyz"[a],
                "xyz"[b], mach, rate, exact);
    // Compressibility changes the decay by Mach^2 = 2.5e-3.
    EXPECT_NEAR(rate, exact, 2.5e-3 * exact);
  }
}

struct CouetteError {
  double temperature, velocity, mass;
};

/// Couette flow between isothermal walls, the upper one moving with Mach 0.8, along `axis`; started
/// from a linear temperature. Largest errors relative to the wall's values.
CouetteError couette(int n, int axis, double growth) {
  constexpr double mu = 0.2, prandtl = 0.71, T0 = 1.0, T1 = 1.2, cp = 3.5;
  const double U = 0.8 * std::sqrt(1.4);
  FlowOptions o = viscous_options(mu, prandtl);
  const std::size_t a = static_cast<std::size_t>(axis), along = axis == 0 ? 1 : 0;
  Grid g;
  g.axis = {make_absent_axis(), make_absent_axis(), make_absent_axis()};
  g.axis[along] = make_uniform_axis(0.0, 1.0, 8, true);
  std::vector<double> nodes;
  for (int i = 0; i < n; ++i) {
    const double s = (i + 0.5) / n;
    nodes.push_back(s - growth / (2.0 * pi) * std::sin(2.0 * pi * s));  // finer at the walls
  }
  g.axis[a] = make_axis_from_nodes(0.0, 1.0, nodes, false);
  Boundaries faces = all_faces(BoundaryKind::periodic);
  faces[2 * a] = {
      .kind = BoundaryKind::wall, .state = {}, .wall = {.temperature = T0}, .incoming = {}};
  faces[2 * a + 1] = {
      .kind = BoundaryKind::wall, .state = {}, .wall = {.temperature = T1}, .incoming = {}};
  faces[2 * a + 1].wall.velocity[along] = U;
  Flow flow(g, faces, o);
  flow.set_state([&](double x, double y, double z) {
    const double s = axis == 0 ? x : (axis == 1 ? y : z), T = T0 + (T1 - T0) * s;
    return State{
        .rho = 1.0 / T, .u = along == 0 ? U * s : 0.0, .v = along == 1 ? U * s : 0.0, .p = 1.0};
  });
  const double mass = flow.totals().mass;
  // Slowest mode: exp(-kappa pi^2 t / (rho cp)) with kappa/(rho cp) >= 0.2: 1e-13 at t = 15.
  run_to(flow, 15.0);
  CouetteError e{0.0, 0.0, std::abs(flow.totals().mass / mass - 1.0)};
  const auto W = std::as_const(flow).primitives();
  for (int i = 0; i < n; ++i) {
    const int at[3] = {axis == 0 ? i : 0, axis == 1 ? i : 0, axis == 2 ? i : 0};
    const double s = nodes[static_cast<std::size_t>(i)];
    const double T = T0 + (T1 - T0) * s + prandtl * U * U / (2.0 * cp) * s * (1.0 - s);
    e.temperature = std::max(e.temperature, std::abs(W(4, at[0], at[1], at[2]) - T) / T0);
    e.velocity =
        std::max(e.velocity, std::abs(W(along == 0 ? 1 : 2, at[0], at[1], at[2]) - U * s) / U);
  }
  return e;
}

TEST(Couette, ReachesTheExactProfileBetweenIsothermalWalls) {
  for (const auto& [axis, growth] : {std::pair{0, 0.0}, {1, 0.0}, {2, 0.0}, {1, 0.3}}) {
    const CouetteError e = couette(16, axis, growth);
    std::printf(
        "Couette along %c, stretched %.0f %%: 16 cells, largest error of T %.1e, u %.1e, mass "
        "%.1e\n",
        "xyz"[axis], 100.0 * growth, e.temperature, e.velocity, e.mass);
    EXPECT_LT(e.temperature, growth > 0.0 ? 1e-4 : 1e-9);
    EXPECT_LT(e.velocity, growth > 0.0 ? 1e-4 : 1e-9);
    EXPECT_LT(e.mass, 1e-12);
  }
}

TEST(FreeStream, StaysOnAStretchedGridWithViscosity) {
  for (const bool paper : {false, true}) {
    FlowOptions o = viscous_options(0.01, 0.71);
    o.viscosity = Viscosity::sutherland;
    o.sutherland_reference = 1.0;
    o.sutherland_temperature = 0.4;
    o.artificial_diffusivity = true;
    if (paper) {
      o.diffusivity_form = DiffusivityForm::paper;
      o.sensor = Sensor::strain;
    }
    Grid g;
    g.axis = {periodic_axis(24, true), periodic_axis(16, true), periodic_axis(12, true)};
    const State free{.rho = 1.1, .u = 0.7, .v = -0.4, .w = 0.3, .p = 0.9};
    Flow flow(g, all_faces(BoundaryKind::periodic), o);
    flow.set_state([&](double, double, double) { return free; });
    double t = 0.0;
    for (int s = 0; s < 10; ++s) {
      const double dt = flow.stable_step();
      flow.advance(t, dt);
      t += dt;
    }
    double largest = 0.0;
    const auto W = std::as_const(flow).primitives();
    for (int k = 0; k < 12; ++k) {
      for (int j = 0; j < 16; ++j) {
        for (int i = 0; i < 24; ++i) {
          largest = std::max({largest, std::abs(W(0, i, j, k) - free.rho),
                              std::abs(W(1, i, j, k) - free.u), std::abs(W(2, i, j, k) - free.v),
                              std::abs(W(3, i, j, k) - free.w)});
        }
      }
    }
    std::printf("free stream, stretched, viscous, %s form: largest change %.1e\n",
                paper ? "paper's" : "recommended", largest);
    // 40 stages of some 100 roundings of values near 1, which add like a random walk.
    EXPECT_LT(largest, 2e-14);
  }
}

TEST(IsothermalSlipWall, LetsHeatThroughAndNoMass) {
  // Still gas between slip walls of two temperatures: with constant conductivity T becomes linear.
  constexpr int n = 24;
  constexpr double T0 = 1.0, T1 = 1.5;
  Boundaries faces = all_faces(BoundaryKind::symmetry);
  faces[0] = {.kind = BoundaryKind::wall,
              .state = {},
              .wall = {.slip = true, .temperature = T0},
              .incoming = {}};
  faces[1] = {.kind = BoundaryKind::wall,
              .state = {},
              .wall = {.slip = true, .temperature = T1},
              .incoming = {}};
  Flow flow(uniform_grid({n, 1, 1}, {0, 0, 0}, {1, 1, 1}), faces, viscous_options(0.2, 0.71));
  flow.set_state([](double, double, double) { return State{.rho = 1.0, .p = 1.2}; });
  const double mass = flow.totals().mass;
  run_to(flow, 20.0);
  double largest = 0.0;
  const auto W = std::as_const(flow).primitives();
  for (int i = 0; i < n; ++i)
    largest = std::max(largest, std::abs(W(4, i, 0, 0) - (T0 + (T1 - T0) * (i + 0.5) / n)));
  std::printf("heat between isothermal slip walls: largest error of T %.1e, mass %.1e\n", largest,
              std::abs(flow.totals().mass / mass - 1.0));
  // The slowest mode has decayed by exp(-0.28 pi^2 20 / 1.4) = 1e-17; the filter acts on rho = p/(R
  // T), whose eighth difference on 24 cells is below 1e-9.
  EXPECT_LT(largest, 1e-7);
  EXPECT_LT(std::abs(flow.totals().mass / mass - 1.0), 1e-12);
}

/// Shock structure at Prandtl number 3/4 (Becker 1922): total enthalpy is constant through the
/// shock, and (4/3) mu u' = m (gamma + 1)/(2 gamma) (u - u1)(u - u2)/u.
class Becker {
 public:
  Becker(double mach, double mu) : u1_(mach * std::sqrt(g)), mu_(mu) {
    u2_ = u1_ * ((g - 1.0) * mach * mach + 2.0) / ((g + 1.0) * mach * mach);
    H_ = g / (g - 1.0) + 0.5 * u1_ * u1_;
  }
  /// State at x, with the velocity half-way at x = 0; rho = p = 1 in front, flow along +x.
  [[nodiscard]] State at(double x) const {
    double low = u2_ * (1.0 + 1e-16), high = u1_;
    for (int n = 0; n < 200; ++n) {
      const double u = 0.5 * (low + high);
      (place(u) > x ? low : high) = u;
    }
    const double u = 0.5 * (low + high), rho = u1_ / u;
    return {.rho = rho, .u = u, .p = rho * (g - 1.0) / g * (H_ - 0.5 * u * u)};
  }
  /// Width by the steepest slope.
  [[nodiscard]] double width() const { return 4.0 * length() * u1_ / (u1_ - u2_); }

 private:
  static constexpr double g = 1.4;
  [[nodiscard]] double length() const { return 8.0 * g * mu_ / (3.0 * u1_ * (g + 1.0)); }
  [[nodiscard]] double place(double u) const {
    const auto f = [&](double v) { return u1_ * std::log(u1_ - v) - u2_ * std::log(v - u2_); };
    return length() * (f(u) - f(0.5 * (u1_ + u2_))) / (u1_ - u2_);
  }
  double u1_, u2_ = 0.0, H_ = 0.0, mu_;
};

struct ProfileError {
  double mean, largest;
};

/// Errors of the velocity, relative to its jump, after the gas has crossed the shock many times.
ProfileError becker_error(int n, int axis, bool stretched) {
  constexpr double mach = 2.0, mu = 0.05;
  const Becker exact(mach, mu);
  const double half = 1.0;
  Grid g;
  g.axis = {make_absent_axis(), make_absent_axis(), make_absent_axis()};
  if (axis != 0) g.axis[0] = make_uniform_axis(0.0, 1.0, 8, true);
  std::vector<double> nodes;
  for (int i = 0; i < n; ++i) {
    const double s = (i + 0.5) / n;
    const double middle = s - 0.5;  // stretched: finer at the shock
    nodes.push_back(2.0 * half *
                    (middle - (stretched ? 0.3 / (2.0 * pi) * std::sin(2.0 * pi * middle) : 0.0)));
  }
  const auto a = static_cast<std::size_t>(axis);
  g.axis[a] = make_axis_from_nodes(-half, half, nodes, false);
  const auto turned = [&](double x) {
    State s = exact.at(x);
    const double u = s.u;
    s.u = 0.0;
    (axis == 0 ? s.u : (axis == 1 ? s.v : s.w)) = u;
    return s;
  };
  Boundaries faces = all_faces(BoundaryKind::periodic);
  faces[2 * a] = {
      .kind = BoundaryKind::fixed_state, .state = turned(-half), .wall = {}, .incoming = {}};
  faces[2 * a + 1] = {
      .kind = BoundaryKind::outflow, .state = turned(half), .wall = {}, .incoming = {}};
  Flow flow(g, faces, viscous_options(mu, 0.75));
  flow.set_state(
      [&](double x, double y, double z) { return turned(axis == 0 ? x : (axis == 1 ? y : z)); });
  run_to(flow, 1.0, 0.3);
  const auto W = std::as_const(flow).primitives();
  const double jump = exact.at(-half).u - exact.at(half).u;
  ProfileError e{0.0, 0.0};
  for (int i = 0; i < n; ++i) {
    const double u = W(1 + axis, axis == 0 ? i : 0, axis == 1 ? i : 0, axis == 2 ? i : 0);
    const double error = std::abs(u - exact.at(nodes[static_cast<std::size_t>(i)]).u) / jump;
    e.mean += error / n;
    e.largest = std::max(e.largest, error);
  }
  return e;
}

TEST(ShockStructure, FollowsBeckersSolution) {
  std::printf("Becker shock, Mach 2, Prandtl 3/4: width %.3f\n", Becker(2.0, 0.05).width());
  for (const bool stretched : {false, true}) {
    std::vector<ProfileError> e;
    for (const int n : {48, 96, 192}) {
      e.push_back(becker_error(n, 0, stretched));
      std::printf("  %s %d cells: error of u, mean %.2e, largest %.2e of the jump\n",
                  stretched ? "stretched" : "uniform", n, e.back().mean, e.back().largest);
    }
    for (std::size_t m = 0; m + 1 < e.size(); ++m)
      std::printf("  order %.2f\n", std::log2(e[m].mean / e[m + 1].mean));
    EXPECT_LT(e[0].largest, 0.01);
    EXPECT_GT(std::log2(e[1].mean / e[2].mean), 5.0);
  }
  const ProfileError x = becker_error(48, 0, false), y = becker_error(48, 1, false),
                     z = becker_error(48, 2, false);
  std::printf("  along x, y, z: %.6e %.6e %.6e\n", x.mean, y.mean, z.mean);
  EXPECT_NEAR(y.mean, x.mean, 0.05 * x.mean);
  EXPECT_NEAR(z.mean, x.mean, 0.05 * x.mean);
}

}  // namespace
}  // namespace ocublast::flow
