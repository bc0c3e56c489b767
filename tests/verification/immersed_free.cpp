// Rigid bodies that the gas carries: a plate thrown by a shock against the exact motion, from heavy
// to lighter than the gas it moves; the cylinder lifted by a Mach 3 shock.
#include <gtest/gtest.h>

#include "flow_solver/immersed/free_body.hpp"
#include "tests/verification/immersed_rig.hpp"

namespace ocublast::flow {
namespace {

using namespace testing;

/// Runs body 0 free; `after(t, load)` with the corrected state.
template <class After>
RunCounts run_free(Flow& flow, ImmersedBoundary& bodies, FreeBody& body, double t_end,
                   const After& after) {
  body.start(bodies.load(flow.primitives(), 0, 1.0));
  std::vector<double> x, v;
  double step = 0.0;
  return run(
      flow, bodies, t_end,
      [&](double t, double& dt) {
        step = dt;
        body.predict(dt, x, v);
        bodies.set_path(0, t, t + dt, x, v);
      },
      [&](double t) {
        const BodyLoad load = bodies.load(flow.primitives(), 0, 1.0);
        body.correct(step, load);
        after(t, load);
      });
}

struct Throw {
  double velocity_error = 0.0;  ///< rms over the second half of the time, of the last velocity
  double theta = 0.0;           ///< largest rho c dt / mass per area
};

/// Plate of mass m per area between gas at rest and a shock of Mach 1.5 that has just reflected at
/// it. In front the expansion of the reflected gas, behind a compression: m du/dt = p5 (1 - (g -
/// 1)/2 u/c5)^(2g/(g-1)) - p0 (1 + (g-1)/2 u/c0)^(2g/(g-1)), as long as no wave has come back. A
/// light plate drives a shock at once, with the pressure of Rankine and Hugoniot at u.
Throw throw_plate(int n, double m) {
  const double h = 1.0 / n;
  const Grid grid{{make_uniform_axis(0, 1, n), make_absent_axis(), make_absent_axis()}};
  const flow::State behind = behind_shock(1.5);
  const double p5 = reflected_pressure(behind.p);
  const double rho5 = behind.rho * (1 + behind.u / reflected_speed(behind));
  const double front = .4537;
  Boundaries boundaries = walls_all_round();
  boundaries[0] = {.kind = BoundaryKind::fixed_state, .state = behind};
  boundaries[1] = {.kind = BoundaryKind::outflow, .state = {.rho = 1, .p = 1}};
  const FlowOptions options = unit_gas_options();
  Flow flow(grid, boundaries, options);
  // The reflected gas at rest in front of the plate, gas at rest behind it: released at t = 0.
  flow.set_state([&](double x, double, double) {
    return x < front + h ? flow::State{.rho = rho5, .p = p5} : flow::State{.rho = 1, .p = 1};
  });
  boundaries[0] = {.kind = BoundaryKind::symmetry};
  const BodySurface plate = make_box({front, -1, -1}, {front + 2 * h, 2, 2});
  ImmersedBoundary bodies(grid, options.gas, {{.name = "plate", .surface = plate, .moves = true}},
                          {});
  immerse(flow, bodies);
  MassProperties mass = mass_of_surface(plate, 1.0);
  mass.mass = 9.0 * m;  // the box's faces are 3 by 3
  FreeBody body(plate, mass,
                {.translates = {true, false, false}, .rotates = {false, false, false}});
  const double c5 = std::sqrt(g * p5 / rho5), c0 = std::sqrt(g);
  const auto rate = [&](double u) {
    const double a = (g + 1) / 4 * u / c0;
    const double behind_it = m > .05 ? std::pow(1 + .5 * (g - 1) * u / c0, 2 * g / (g - 1))
                                     : 1 + g * u / c0 * (a + std::sqrt(1 + a * a));
    return (p5 * std::pow(1 - .5 * (g - 1) * u / c5, 2 * g / (g - 1)) - behind_it) / m;
  };
  Throw result;
  double t_last = 0.0, u = 0.0, sum2 = 0.0;
  int count = 0;
  const double t_end = .22;  // before the echo of the tube's left end
  run_free(flow, bodies, body, t_end, [&](double t, const BodyLoad& load) {
    const int parts = 1 + static_cast<int>((t - t_last) / (.002 * std::min(m, 1.0)));
    const double dt = (t - t_last) / parts;
    for (int q = 0; q < parts; ++q) {
      const double k1 = rate(u), k2 = rate(u + .5 * dt * k1), k3 = rate(u + .5 * dt * k2),
                   k4 = rate(u + dt * k3);
      u += dt / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
    }
    result.theta = std::max(result.theta, load.largest_impedance * (t - t_last) / m);
    t_last = t;
    const double off = body.state().velocity[0] - u;
    if (t < .5 * t_end) return;
    sum2 += off * off;
    ++count;
  });
  result.velocity_error = std::sqrt(sum2 / count) / u;
  return result;
}

TEST(ImmersedFreePlate, IsThrownByAShockAsTheExactMotionSays) {
  for (const double m : {10.0, 1.0, .1, .01, .001}) {
    const Throw coarse = throw_plate(100, m), fine = throw_plate(200, m);
    std::printf(
        "free plate of mass %.3f (gas 1), n 100 200: velocity rms error %.1e %.1e of the last, "
        "theta %.2g %.2g\n",
        m, coarse.velocity_error, fine.velocity_error, coarse.theta, fine.theta);
    // At a mass of .1 the compression steepens into a shock within the run: the velocity then
    // belongs to neither law, which differ by 6e-3 here.
    EXPECT_LT(fine.velocity_error, m == .1 ? 6e-3 : 1.5e-3);
  }
}

struct Lift {
  std::array<double, 2> middle{}, last{};  ///< center at t = .1641 and .30085
  double momentum = 0.0;                   ///< residual of gas + body, of what the shock brought
  double leak = 0.0;                       ///< mass, of that in the domain
  RunCounts counts;
};

/// Falcovitz, Alfandary and Hanoch (1997): a light cylinder on the floor of a tube, hit by a Mach 3
/// shock. 1 x 0.2, shock at .08, gas ahead (1.4, 0, 1), behind (5.4, 2.2222, 10.3333), radius .05
/// at
/// (.15, .05), density 10.77.
Lift lift_cylinder(int cells_per_radius, double t_end = .30085) {
  const double R = .05, h = R / cells_per_radius;
  const Grid grid{{make_uniform_axis(0, 1, 20 * cells_per_radius),
                   make_uniform_axis(0, .2, 4 * cells_per_radius), make_absent_axis()}};
  const flow::State ahead{.rho = 1.4, .p = 1.0};
  const flow::State behind{.rho = 5.4, .u = 20.0 / 9.0, .p = 31.0 / 3.0};
  Boundaries boundaries = walls_all_round();
  boundaries[0] = {.kind = BoundaryKind::fixed_state, .state = behind};
  boundaries[1] = {.kind = BoundaryKind::outflow, .state = ahead};
  const FlowOptions options = unit_gas_options();
  Flow flow(grid, boundaries, options);
  flow.set_state([&](double x, double, double) {
    const double share = .5 * (1.0 - std::tanh((x - .08) / (.5 * h)));
    return flow::State{.rho = ahead.rho + share * (behind.rho - ahead.rho),
                       .u = share * behind.u,
                       .p = 1 + share * (behind.p - 1)};
  });
  const BodySurface surface = make_cylinder(.15, .05, R, 8 * cells_per_radius);
  ImmersedBoundary bodies(grid, options.gas,
                          {{.name = "cylinder", .surface = surface, .moves = true}},
                          {.domain_wall = {false, false, true, true, false, false}});
  immerse(flow, bodies);
  const MassProperties mass = mass_of_surface(surface, 10.77);
  FreeBody body(surface, mass,
                {.translates = {true, true, false}, .rotates = {false, false, true}});
  const auto momentum = [&] {  // the cylinder is 3 deep, the gas 1
    return flow.totals().momentum[0] + bodies.wall_cells(flow.primitives()).momentum[0] +
           body.momentum()[0] / 3.0;
  };
  const double before = momentum();
  const double mass_before = flow.totals().mass + bodies.wall_cells(flow.primitives()).mass;
  Lift lift;
  double brought = 0.0, brought_mass = 0.0, t_last = 0.0;
  const double flux = .2 * (behind.p + behind.rho * behind.u * behind.u - ahead.p);
  lift.counts = run_free(flow, bodies, body, t_end, [&](double t, const BodyLoad&) {
    brought += flux * (t - t_last);
    brought_mass += .2 * behind.rho * behind.u * (t - t_last);
    t_last = t;
    // The reflected waves reach the inflow at about .06, the shock the outflow at .26: the balance
    // is taken before.
    if (t < .05) {
      lift.momentum = (momentum() - before - brought) / brought;
      lift.leak = (flow.totals().mass + bodies.wall_cells(flow.primitives()).mass - mass_before -
                   brought_mass) /
                  mass_before;
    }
    const Vec3& c = body.state().center;
    if (t < .1641) lift.middle = {c[0], c[1]};
  });
  const Vec3& c = body.state().center;
  lift.last = {c[0], c[1]};
  return lift;
}

void print_lift(int n, const Lift& l) {
  std::printf(
      "light cylinder, R/h %d: (%.4f, %.4f) at .1641, (%.4f, %.4f) at .30085; momentum of gas and "
      "body to %.1e of what the shock brought, mass to %.1e; %d steps, %d redone, %zu fresh "
      "nodes\n",
      n, l.middle[0], l.middle[1], l.last[0], l.last[1], l.momentum, l.leak, l.counts.steps,
      l.counts.redone, l.counts.fresh);
}

TEST(ImmersedFreeCylinder, AndTheGasKeepTheMomentumTheMoreTheFinerTheGrid) {
  std::array<Lift, 2> l;
  for (const std::size_t q : {0U, 1U}) l[q] = lift_cylinder(8 << q, .05);
  const double order = std::log2(l[0].momentum / l[1].momentum);
  std::printf(
      "light cylinder, R/h 8 16, after .05: momentum of gas and body %+.1e %+.1e of what the shock "
      "brought (order "
      "%.2f), mass %+.1e %+.1e\n",
      l[0].momentum, l[1].momentum, order, l[0].leak, l[1].leak);
  // All of it is lost while the shock runs along the body, some tenths of a cell of the gas behind
  // it: where it strikes, in the steps in which the gas is stopped by more than the pressure that
  // is read there.
  EXPECT_LT(std::abs(l[1].momentum), .01);
  EXPECT_GT(order, .6);
}

TEST(ImmersedFreeCylinder, IsLiftedByAShock) {
  for (const int n : {8}) {
    const Lift l = lift_cylinder(n);
    print_lift(n, l);
    // Places that a prototype in two dimensions found with different gap rules and normals: x .634
    // to .675, y .143 to .151 at the end.
    EXPECT_NEAR(l.middle[0], .36, .01);
    EXPECT_NEAR(l.last[0], .66, .03);
    EXPECT_NEAR(l.last[1], .15, .012);
    EXPECT_LT(std::abs(l.momentum), .02);
    EXPECT_LT(std::abs(l.leak), 5e-3);
  }
}

}  // namespace
}  // namespace ocublast::flow
