// Bodies in the flow: shock reflection, pistons, plates, cylinder, sphere. Units: p0 = rho0 = 1 and
// a gas constant of 1, so that temperatures and pressures are of order one.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <vector>

#include "flow_solver/immersed/immersed_boundary.hpp"
#include "flow_solver/step.hpp"
#include "tests/unit/immersed_shapes.hpp"

namespace ocublast::flow {
namespace {

using namespace testing;

constexpr double g = 1.4;

FlowOptions unit_gas_options() {
  FlowOptions options;
  options.gas = {.heat_capacity_ratio = g, .gas_constant = 1.0};
  return options;
}

/// State behind a shock of Mach number `Ms` running into gas at rest with p = rho = 1.
flow::State behind_shock(double Ms) {
  const double p = 1.0 + 2.0 * g / (g + 1.0) * (Ms * Ms - 1.0);
  const double rho = (g + 1.0) * Ms * Ms / ((g - 1.0) * Ms * Ms + 2.0);
  return {.rho = rho, .u = Ms * std::sqrt(g) * (1.0 - 1.0 / rho), .p = p};
}

/// Pressure behind the shock reflected at a rigid wall, with the incident pressure p (p1 = 1).
double reflected_pressure(double p) {
  return p * ((3.0 * g - 1.0) * p - (g - 1.0)) / ((g - 1.0) * p + (g + 1.0));
}

/// The two states of a planar shock at x, spread by a tanh of half a cell: a jump between two nodes
/// would start with a second-order shift of the shock.
flow::State shock_at(double x, double at, double h, const flow::State& behind) {
  const double share = .5 * (1.0 - std::tanh((x - at) / (.5 * h)));
  return {.rho = 1.0 + share * (behind.rho - 1.0),
          .u = share * behind.u,
          .p = 1.0 + share * (behind.p - 1.0)};
}

Boundaries walls_all_round() {
  Boundaries b;
  for (Boundary& face : b) face.kind = BoundaryKind::symmetry;
  return b;
}

double pressure_at(const Flow& flow, int i, int j = 0, int k = 0) {
  const FieldsView<const double> W = flow.primitives();
  return pressure(flow.options().gas, W(prim_rho, i, j, k), W(prim_T, i, j, k));
}

/// Steps to time t_end; `before(t, dt)` sets paths and may shorten the step, `after(t)` measures.
template <class Before, class After>
double run(Flow& flow, ImmersedBoundary& bodies, double t_end, const Before& before,
           const After& after) {
  double t = 0.0;
  while (t < t_end * (1.0 - 1e-12)) {
    double dt = std::min({flow.stable_step(), bodies.wall_step_limit(), t_end - t});
    before(t, dt);
    flow.advance(t, dt);
    t += dt;
    after(t);
  }
  return t;
}

struct Reflection {
  double error = 0.0;      ///< of the plateau pressure
  double overshoot = 0.0;  ///< of the wall pressure, of p5
};

Reflection reflect_shock(double Ms, double offset) {
  const int n = 200;
  const double h = 1.0 / n;
  const Grid grid{{make_uniform_axis(0, 1, n), make_absent_axis(), make_absent_axis()}};
  const flow::State behind = behind_shock(Ms);
  Boundaries boundaries = walls_all_round();
  boundaries[0] = {.kind = BoundaryKind::fixed_state, .state = behind};
  const FlowOptions options = unit_gas_options();
  Flow flow(grid, boundaries, options);
  flow.set_state([&](double x, double, double) { return shock_at(x, .5, h, behind); });
  const double wall = (159 + .5 + offset) * h;
  ImmersedBoundary bodies(grid, options.gas,
                          {{.name = "wall", .surface = make_box({wall, -1, -1}, {2, 2, 2})}}, {});
  bodies.update_topology(flow.primitives());
  flow.immerse(&bodies);
  const double p5 = reflected_pressure(behind.p);
  Reflection result;
  // The shock needs .3 to the wall and .25 back at its reflected speed, that from mass balance.
  const double rho5 =
      behind.rho * ((g + 1) * p5 + (g - 1) * behind.p) / ((g - 1) * p5 + (g + 1) * behind.p);
  const double back = behind.u * behind.rho / (rho5 - behind.rho);
  const double t_end = (wall - .5) / (Ms * std::sqrt(g)) + .25 / back;
  run(
      flow, bodies, t_end, [](double, double) {},
      [&](double) {
        const BodyLoad load = bodies.load(flow.primitives(), 0, 0.0);
        result.overshoot = std::max(result.overshoot, load.force[0] / load.exposed_area / p5 - 1.0);
      });
  double mean = 0.0;
  int count = 0;
  for (int i = 0; i < n; ++i) {
    const double x = grid.axis[0].x(i);
    if (x < wall - .15 || x > wall - .03) continue;
    mean += pressure_at(flow, i);
    ++count;
  }
  result.error = std::abs(mean / count / p5 - 1.0);
  return result;
}

TEST(ImmersedShock, ReflectsAtAnySubCellPositionOfTheWall) {
  for (const double Ms : {1.5, 3.0}) {
    for (const double offset : {.05, .3, .5, .7, .95}) {
      const Reflection r = reflect_shock(Ms, offset);
      std::printf("shock Ms %.1f, wall at node + %.2f h: p5 error %.2e, overshoot %.2f %%\n", Ms,
                  offset, r.error, 100 * r.overshoot);
      // Plateau: 1.6e-3 was the worst of all treatments tried in one dimension, 2e-3 the demand.
      EXPECT_LT(r.error, 2e-3);
      EXPECT_LT(r.overshoot, .08);
    }
  }
}

struct PistonError {
  double deviation = 0.0;  ///< standard deviation of p / p_exact at the face
  double largest = 0.0;
};

/// Piston x = x0 + A (1 - cos w t) at the left end of a tube, until t_end; as long as its wave has
/// not steepened into a shock the face pressure is that of a simple wave. The first .03, in which
/// the pressure slope of the sudden acceleration has not reached the first nodes, are left out.
PistonError drive_piston(int n, double w, double t_end) {
  const double A = .02;
  const double x0 = .1034;
  const double length = 1.2;
  const Grid grid{{make_uniform_axis(0, length, static_cast<int>(std::lround(length * n))),
                   make_absent_axis(), make_absent_axis()}};
  Boundaries boundaries = walls_all_round();
  boundaries[1] = {.kind = BoundaryKind::outflow, .state = {.rho = 1, .p = 1}};
  FlowOptions options = unit_gas_options();
  options.cfl = .5;
  Flow flow(grid, boundaries, options);
  flow.set_state([](double, double, double) { return flow::State{.rho = 1, .p = 1}; });
  ImmersedBoundary bodies(
      grid, options.gas,
      {{.name = "piston", .surface = make_box({-1, -1, -1}, {x0, 2, 2}), .moves = true}}, {});
  bodies.update_topology(flow.primitives());
  flow.immerse(&bodies);
  const std::vector<double> rest(bodies.position(0).begin(), bodies.position(0).end());
  const double c0 = std::sqrt(g);
  double sum = 0.0, sum2 = 0.0, largest = 0.0;
  int count = 0;
  run(
      flow, bodies, t_end,
      [&](double t, double dt) {
        std::vector<double> x = rest, v(rest.size(), 0.0);
        for (std::size_t a = 0; a < x.size(); a += 3) {
          x[a] += A * (1 - std::cos(w * (t + dt)));
          v[a] = A * w * std::sin(w * (t + dt));
        }
        bodies.set_path(0, t, t + dt, x, v);
      },
      [&](double t) {
        if (t < .03) return;
        const BodyLoad load = bodies.load(flow.primitives(), 0, 0.0);
        const double p = -load.force[0] / load.exposed_area;
        const double exact =
            std::pow(1 + .5 * (g - 1) * A * w * std::sin(w * t) / c0, 2 * g / (g - 1));
        const double ratio = p / exact;
        sum += ratio;
        sum2 += (ratio - 1) * (ratio - 1);
        largest = std::max(largest, std::abs(ratio - 1));
        ++count;
      });
  const double mean = sum / count - 1;
  return {std::sqrt(sum2 / count - mean * mean), largest};
}

TEST(ImmersedPiston, HasTheFacePressureOfASimpleWave) {
  for (const double w : {6.0, 20.0}) {
    // At w = 20 the wave becomes a shock after 2 c0 / ((gamma + 1) A w^2) = 0.12.
    const double t_end = w < 10 ? 1.0 : .12;
    const PistonError coarse = drive_piston(100, w, t_end);
    const PistonError fine = drive_piston(200, w, t_end);
    std::printf(
        "piston w %.0f, n 100 200: standard deviation of p/p_exact %.2e %.2e (order %.2f), largest "
        "%.2e %.2e\n",
        w, coarse.deviation, fine.deviation, std::log2(coarse.deviation / fine.deviation),
        coarse.largest, fine.largest);
    // Prototypes in one dimension with four mirrored layers: 1.5e-4 and 4e-5 at w = 6, 3.6e-3 and
    // 1.1e-3 at w = 20.
    EXPECT_LT(coarse.deviation, w < 10 ? 2e-4 : 6e-3);
    EXPECT_LT(fine.deviation, w < 10 ? 6e-5 : 2e-3);
    EXPECT_GT(std::log2(coarse.deviation / fine.deviation), 1.5);
  }
}

TEST(ImmersedPlate, LetsNothingThroughHoweverThin) {
  const int n = 100;
  const double h = 1.0 / n;
  for (const double Ms : {1.5, 3.0}) {
    for (const double cells : {8.0, 2.0, 1.0, .5, .1}) {
      for (const double degrees : {0.0, 10.0}) {
        const Grid grid{
            {make_uniform_axis(0, 1, n), make_uniform_axis(0, 8 * h, 8), make_absent_axis()}};
        const flow::State behind = behind_shock(Ms);
        Boundaries boundaries = walls_all_round();
        boundaries[0] = {.kind = BoundaryKind::fixed_state, .state = behind};
        const FlowOptions options = unit_gas_options();
        Flow flow(grid, boundaries, options);
        flow.set_state([&](double x, double, double) { return shock_at(x, .35, h, behind); });
        const double c = std::cos(degrees * std::numbers::pi / 180),
                     s = std::sin(degrees * std::numbers::pi / 180);
        const auto at = [&](double t, double d) {
          return std::array<double, 2>{.5137 + c * d - s * t, 4 * h + s * d + c * t};
        };
        // Faces in pieces of a cell, so that the load finds facets inside the channel.
        std::vector<std::array<double, 2>> polygon;
        for (int q = 100; q >= -100; --q) polygon.push_back(at(q * h, 0));
        for (int q = -100; q <= 100; ++q) polygon.push_back(at(q * h, cells * h));
        ImmersedBoundary bodies(grid, options.gas,
                                {{.name = "plate", .surface = make_prism(polygon, -1, 2)}}, {});
        bodies.update_topology(flow.primitives());
        flow.immerse(&bodies);
        double peak = 0.0;
        run(
            flow, bodies, .2 / (Ms * std::sqrt(g)) + .05, [](double, double) {},
            [&](double) {
              const BodyLoad load = bodies.load(flow.primitives(), 0, 1.0);
              peak = std::max(peak, load.force[0] / (8 * h) / 3.0);  // the body is 3 deep
            });
        double leak = 0.0;
        for (int j = 0; j < 8; ++j)
          for (int i = 0; i < n; ++i) {
            const double d = c * (grid.axis[0].x(i) - .5137) + s * (grid.axis[1].x(j) - 4 * h);
            if (d > cells * h) leak = std::max(leak, std::abs(pressure_at(flow, i, j) - 1.0));
          }
        std::printf(
            "plate of %.1f cells at %.0f degrees, Ms %.1f: behind it |p - p0| <= %.1e, peak load "
            "in front %.3f of p5 - p0, fallbacks %llu\n",
            cells, degrees, Ms, leak, peak / (reflected_pressure(behind.p) - 1),
            static_cast<unsigned long long>(bodies.n_fallbacks()));
        EXPECT_LE(leak, 1e-12);
        EXPECT_GT(peak / (reflected_pressure(behind.p) - 1), .9);
      }
    }
  }
}

TEST(ImmersedCylinder, MovesThroughGasWithLittleNoise) {
  const double R = 1.0, h = R / 8;
  const Grid grid{{make_uniform_axis(0, 8, 64), make_uniform_axis(0, 6, 48), make_absent_axis()}};
  const FlowOptions options = unit_gas_options();
  Flow flow(grid, walls_all_round(), options);
  const double speed = .3 * std::sqrt(g);
  flow.set_state([](double, double, double) { return flow::State{.rho = 1, .p = 1}; });
  ImmersedBoundary bodies(
      grid, options.gas,
      {{.name = "cylinder", .surface = make_cylinder(2.503, 2.997, R, 50), .moves = true}}, {});
  bodies.update_topology(flow.primitives());
  flow.immerse(&bodies);
  const std::vector<double> rest(bodies.position(0).begin(), bodies.position(0).end());
  // Gentle start: speed grows over one radius of sound travel.
  const double ramp = 1.0;
  const auto place = [&](double t) {
    return t < ramp ? .5 * speed * t * t / ramp : speed * (t - .5 * ramp);
  };
  const auto rate = [&](double t) { return speed * std::min(t / ramp, 1.0); };
  std::vector<double> drag, lift;
  run(
      flow, bodies, 4.0,
      [&](double t, double dt) {
        std::vector<double> x = rest, v(rest.size(), 0.0);
        for (std::size_t a = 0; a < x.size(); a += 3) {
          x[a] += place(t + dt);
          v[a] = rate(t + dt);
        }
        bodies.set_path(0, t, t + dt, x, v);
      },
      [&](double t) {
        if (t < 1.5) return;
        const BodyLoad load = bodies.load(flow.primitives(), 0, 1.0);
        drag.push_back(load.force[0] / 3.0);
        lift.push_back(load.force[1] / 3.0);
      });
  // Noise: deviation from the parabola through 15 samples (least squares at the middle one).
  double noise2 = 0.0;
  int count = 0;
  for (std::size_t m = 7; m + 7 < drag.size(); ++m) {
    double s0 = 0, s2 = 0, s4 = 0, f0 = 0, f2 = 0;
    for (int q = -7; q <= 7; ++q) {
      s0 += 1;
      s2 += q * q;
      s4 += q * q * q * q;
      f0 += drag[m + q];
      f2 += q * q * drag[m + q];
    }
    const double middle = (s4 * f0 - s2 * f2) / (s0 * s4 - s2 * s2);
    noise2 += (drag[m] - middle) * (drag[m] - middle);
    ++count;
  }
  const double noise = std::sqrt(noise2 / count) / .5;
  // The gas keeps its volume, so its mean density, 1, measures what walls gain or lose.
  const auto n_fluid =
      static_cast<double>(std::count(bodies.tags().begin(), bodies.tags().end(), tag_fluid));
  const double leak = flow.totals().mass / (n_fluid * h * h) - 1.0;
  std::printf(
      "cylinder at 0.3 c, R/h = %.0f: force noise %.1e of 0.5 p0 R (rms), last drag %.3f, lift "
      "%.1e, mass change %.1e, %zu steps\n",
      R / h, noise, drag.back(), lift.back(), leak, drag.size());
  EXPECT_LT(std::abs(leak), 1e-3);
  // A prototype had 1.4e-2 at this resolution; its mass changed by 1e-4 of a box of this size.
  EXPECT_LT(noise, 1e-2);
  EXPECT_LT(drag.back(), 0.0);
  EXPECT_EQ(bodies.n_fallbacks(), 0U);
}

struct PlateError {
  double front = 0.0;  ///< rms of p / p_exact - 1
  double rear = 0.0;
};

/// A plate x = x0 + A (1 - cos w t) between two gases at rest, both faces in simple waves.
PlateError move_plate(int n, double cells) {
  const double A = .02, w = 6.0, x0 = .6034, length = 1.2, h = 1.0 / n;
  const Grid grid{{make_uniform_axis(0, length, static_cast<int>(std::lround(length * n))),
                   make_absent_axis(), make_absent_axis()}};
  FlowOptions options = unit_gas_options();
  Flow flow(grid, walls_all_round(), options);
  flow.set_state([](double, double, double) { return flow::State{.rho = 1, .p = 1}; });
  ImmersedBoundary bodies(
      grid, options.gas,
      {{.name = "plate", .surface = make_box({x0 - cells * h, -1, -1}, {x0, 2, 2}), .moves = true}},
      {});
  bodies.update_topology(flow.primitives());
  flow.immerse(&bodies);
  const std::vector<double> rest(bodies.position(0).begin(), bodies.position(0).end());
  const double c0 = std::sqrt(g);
  PlateError error;
  int count = 0;
  std::vector<double> p(rest.size() / 3);
  run(
      flow, bodies, .9,
      [&](double t, double& dt) {
        // A path is not known before it is set: the plate may not move by half its thickness.
        dt = std::min({dt, .5 * cells * h / (A * w), .3 * h / (A * w)});
        std::vector<double> x = rest, v(rest.size(), 0.0);
        for (std::size_t a = 0; a < x.size(); a += 3) {
          x[a] += A * (1 - std::cos(w * (t + dt)));
          v[a] = A * w * std::sin(w * (t + dt));
        }
        bodies.set_path(0, t, t + dt, x, v);
      },
      [&](double t) {
        if (t < .03) return;
        bodies.read_overpressure(flow.primitives(), 0, 0.0, p);
        const double u = A * w * std::sin(w * t);
        const auto exact = [&](double sign) {
          return std::pow(1 + sign * .5 * (g - 1) * u / c0, 2 * g / (g - 1));
        };
        for (std::size_t v = 0; v < p.size(); ++v) {
          const bool front = rest[3 * v] == x0;
          const double ratio = p[v] / exact(front ? 1.0 : -1.0) - 1.0;
          (front ? error.front : error.rear) += ratio * ratio / 4.0;
        }
        ++count;
      });
  return {std::sqrt(error.front / count), std::sqrt(error.rear / count)};
}

TEST(ImmersedPlate, OfAnyThicknessMovesWithTheRightPressureOnBothFaces) {
  for (const double cells : {4.0, 1.0, .2}) {
    const PlateError coarse = move_plate(100, cells);
    const PlateError fine = move_plate(200, cells);
    std::printf(
        "moving plate of %.1f cells, n 100 200: rms error front %.1e %.1e, rear %.1e %.1e\n", cells,
        coarse.front, fine.front, coarse.rear, fine.rear);
    EXPECT_LT(std::max(coarse.front, coarse.rear), 2e-3);
    EXPECT_LT(std::max(fine.front, fine.rear), 6e-4);
  }
}

TEST(ImmersedGap, ClosesAndOpensAgainBetweenACylinderAndABlock) {
  const double h = 1.0 / 8;
  const Grid grid{{make_uniform_axis(0, 6, 48), make_uniform_axis(0, 4, 32), make_absent_axis()}};
  const FlowOptions options = unit_gas_options();
  Flow flow(grid, walls_all_round(), options);
  flow.set_state([](double, double, double) { return flow::State{.rho = 1, .p = 1}; });
  const double wall = 4.53;
  ImmersedBoundary bodies(
      grid, options.gas,
      {{.name = "cylinder", .surface = make_cylinder(2.5, 2.003, 1.0, 50), .moves = true},
       {.name = "block", .surface = make_box({wall, -1, -1}, {7, 5, 2}, 40)}},
      {});
  bodies.update_topology(flow.primitives());
  flow.immerse(&bodies);
  const std::vector<double> rest(bodies.position(0).begin(), bodies.position(0).end());
  // From a gap of 1.03 to an overlap of 0.3 cells and back, peak speed .37 c.
  const double stroke = wall - 3.5 + .3 * h,
               period = std::numbers::pi * stroke / (.37 * std::sqrt(g));
  double deepest = 0.0, smallest = 1e9;
  std::size_t fresh = 0;
  double largest_p = 0.0;
  const double w = 2 * std::numbers::pi / period;
  double t = 0.0;
  while (t < period * (1 - 1e-12)) {
    const double dt = std::min({flow.stable_step(), .3 * h / (.37 * std::sqrt(g)), period - t});
    std::vector<double> x = rest, v(rest.size(), 0.0);
    const double shift = .5 * stroke * (1 - std::cos(w * (t + dt)));
    for (std::size_t a = 0; a < x.size(); a += 3) {
      x[a] += shift;
      v[a] = .5 * stroke * w * std::sin(w * (t + dt));
    }
    bodies.set_path(0, t, t + dt, x, v);
    const StepReport report = flow.advance(t, dt);
    t += dt;
    fresh += report.topology.fresh_nodes;
    if (report.topology.smallest_gap > 0.0)
      smallest = std::min(smallest, report.topology.smallest_gap);
    deepest = std::max(deepest, 3.5 + shift - wall);
    largest_p = std::max(largest_p, report.largest_pressure);
    const BodyLoad load = bodies.load(flow.primitives(), 0, 1.0);
    ASSERT_TRUE(std::isfinite(load.force[0]));
  }
  std::printf(
      "cylinder against a block: overlap %.2f h, smallest open gap %.2f h, %zu fresh nodes, "
      "largest pressure %.2f p0, fallbacks %llu\n",
      deepest / h, smallest, fresh, largest_p,
      static_cast<unsigned long long>(bodies.n_fallbacks()));
  EXPECT_GT(deepest, .25 * h);
  EXPECT_LT(largest_p, 20.0);
  EXPECT_GE(smallest, 1.0);
}

TEST(ImmersedSphere, IsHitByAShockSymmetrically) {
  const int n = 24;
  const double h = 1.0 / n;
  const Grid grid{
      {make_uniform_axis(0, 1.5, 36), make_uniform_axis(0, 1, n), make_uniform_axis(0, 1, n)}};
  const flow::State behind = behind_shock(1.8);
  Boundaries boundaries = walls_all_round();
  boundaries[0] = {.kind = BoundaryKind::fixed_state, .state = behind};
  const FlowOptions options = unit_gas_options();
  Flow flow(grid, boundaries, options);
  flow.set_state([&](double x, double, double) { return shock_at(x, .3, h, behind); });
  ImmersedBoundary bodies(grid, options.gas,
                          {{.name = "ball", .surface = make_sphere({.75, .5, .5}, .23, 4)}}, {});
  bodies.update_topology(flow.primitives());
  flow.immerse(&bodies);
  double peak = 0.0;
  std::vector<double> p(bodies.position(0).size() / 3);
  run(
      flow, bodies, .5, [](double, double) {},
      [&](double) {
        bodies.read_overpressure(flow.primitives(), 0, 1.0, p);
        peak = std::max(peak, *std::max_element(p.begin(), p.end()));
      });
  double mirror = 0.0, turn = 0.0;
  std::size_t node = 0;
  for (int k = 0; k < n; ++k)
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < 36; ++i, ++node) {
        if (bodies.tags()[node] != tag_fluid) continue;
        mirror = std::max(
            mirror, std::abs(pressure_at(flow, i, j, k) - pressure_at(flow, i, n - 1 - j, k)));
        turn = std::max(turn, std::abs(pressure_at(flow, i, j, k) - pressure_at(flow, i, k, j)));
      }
  const BodyLoad load = bodies.load(flow.primitives(), 0, 1.0);
  std::printf(
      "sphere hit by Ms 1.8, R/h 5.5: peak %.3f of p5 - p0, asymmetry y %.1e, y-z %.1e, force %.3f "
      "%.1e %.1e, fallbacks %llu\n",
      peak / (reflected_pressure(behind.p) - 1), mirror, turn, load.force[0], load.force[1],
      load.force[2], static_cast<unsigned long long>(bodies.n_fallbacks()));
  EXPECT_GT(peak / (reflected_pressure(behind.p) - 1), .6);
  // Nothing but rounding breaks the mirror symmetry; shocks amplify it by some orders in 100 steps.
  EXPECT_LT(mirror, 1e-8);
  // The filter takes the directions one after the other, which commutes away from walls only: y and
  // z differ by a part of what it removes there (without the filter by 2e-13).
  EXPECT_LT(turn, .01 * reflected_pressure(behind.p));
}

}  // namespace
}  // namespace ocublast::flow
