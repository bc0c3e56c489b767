#include <cmath>
#include <cstdio>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "tests/verification/flow_exact.hpp"
#include "tests/verification/flow_run.hpp"

namespace ocublast::flow {
namespace {

/// tanh interface of half a cell (flow start without a shifted shock).
double blend(double left, double right, double x, double h) {
  return 0.5 * (left + right) - 0.5 * (left - right) * std::tanh(x / (0.5 * h));
}

struct Tube {
  double error = 0.0;
  RunSummary run;
};

Tube sod(int n, int axis, double cfl) {
  std::array<int, 3> cells{1, 1, 1};
  cells[static_cast<std::size_t>(axis)] = n;
  if (axis != 0) cells[0] = 8;
  FlowOptions o = unit_options();
  o.cfl = cfl;
  Boundaries faces = all_faces(BoundaryKind::symmetry);
  // Across, cells four times as wide: much wider ones let the round-off across the tube grow, as the
  // artificial bulk viscosity weighs differences by the square of the spacing.
  std::array<double, 3> low{-0.5, -0.5, -0.5}, high{0.5, 0.5, 0.5};
  const double h = 1.0 / n;
  if (axis != 0) {
    low[0] = -16.0 * h;
    high[0] = 16.0 * h;
  }
  Flow flow(uniform_grid(cells, low, high), faces, o);
  flow.set_state([&](double x, double y, double z) {
    const double s = axis == 0 ? x : (axis == 1 ? y : z);
    return State{.rho = blend(1.0, 0.125, s, h), .p = blend(1.0, 0.1, s, h)};
  });
  Tube out;
  out.run = run_to(flow, 0.2);
  const ExactRiemann exact({.rho = 1.0, .p = 1.0}, {.rho = 0.125, .p = 0.1}, 1.4);
  const auto W = flow.primitives();
  for (int i = 0; i < n; ++i) {
    const double a = -0.5 + i * h;
    const double rho = axis == 0 ? W(0, i, 0, 0) : (axis == 1 ? W(0, 0, i, 0) : W(0, 0, 0, i));
    out.error += h * std::abs(rho - exact.mean_density(a, a + h, 0.2));
  }
  return out;
}

TEST(SodTube, MatchesTheExactSolution) {
  for (const double cfl : {0.5, 0.9}) {
    for (const int n : {100, 200, 400}) {
      const Tube t = sod(n, 0, cfl);
      std::printf("sod n %4d cfl %.1f: L1(rho) %.3e, steps %d, redone %d, marked %zu\n", n, cfl, t.error, t.run.steps,
                  t.run.redone, t.run.marked);
      // On 200 and 400 cells second-order PLM has 2.39e-3 and 1.28e-3, PPM 1.98e-3 and 0.99e-3.
      EXPECT_LT(t.error, 0.43 / n);
    }
  }
}

TEST(SodTube, IsTheSameAlongEveryDirection) {
  const double x = sod(100, 0, 0.5).error;
  // The eight cells across change the step only through an added zero velocity; round-off remains.
  FlowOptions o;
  for (int axis : {1, 2}) {
    const double other = sod(100, axis, 0.5).error;
    std::printf("sod along %c: L1 %.15e (x: %.15e)\n", "xyz"[axis], other, x);
    // The sum over directions shortens the step, by c/(4 h) of (|u| + c)/h: about a fifth.
    EXPECT_NEAR(other, x, 0.1 * x);
  }
}

/// Density on n cells at t = 0.47, Shu and Osher's problem on [-1, 1] with the shock at -0.8.
std::vector<double> shu_osher(int n) {
  const State left{.rho = 3.857143, .u = 2.629369, .p = 10.33333}, right{.rho = 1.0, .p = 1.0};
  Boundaries faces = all_faces(BoundaryKind::fixed_state, left);
  faces[1] = {.kind = BoundaryKind::outflow, .state = right};
  Flow flow(uniform_grid({n, 1, 1}, {-1, 0, 0}, {1, 1, 1}), faces, unit_options());
  const double h = 2.0 / n;
  flow.set_state([&](double x, double, double) {
    const double rho = 1.0 + 0.2 * std::sin(5.0 * std::numbers::pi * x);
    return State{.rho = blend(left.rho, rho, x + 0.8, h), .u = blend(left.u, 0.0, x + 0.8, h),
                 .p = blend(left.p, 1.0, x + 0.8, h)};
  });
  run_to(flow, 0.47);
  std::vector<double> rho;
  for (int i = 0; i < n; ++i) rho.push_back(flow.primitives()(0, i, 0, 0));
  return rho;
}

TEST(ShuOsher, ResolvesTheWavesBehindTheShock) {
  // Reference: the same scheme on 1600 cells, averaged over the cells of the coarse grid; its own
  // error is below a tenth of what is tested (8.5e-3 at 400 cells in the waves, first order).
  const std::vector<double> fine = shu_osher(1600);
  for (const int n : {200, 400}) {
    const std::vector<double> rho = shu_osher(n);
    const int part = 1600 / n;
    double whole = 0.0, waves = 0.0;
    int count = 0;
    for (int i = 0; i < n; ++i) {
      double mean = 0.0;
      for (int m = 0; m < part; ++m) mean += fine[static_cast<std::size_t>(i * part + m)] / part;
      const double e = std::abs(rho[static_cast<std::size_t>(i)] - mean), x = -1.0 + (i + 0.5) * 2.0 / n;
      whole += e / n;
      if (x > 0.45 && x < 0.85) {
        waves += e;
        ++count;
      }
    }
    waves /= count;
    std::printf("shu-osher n %d: L1 whole %.2e, waves %.2e\n", n, whole, waves);
    // PPM on 400 cells has 6.8e-2 in the waves, on 200 cells 1.6e-1; this scheme's prototype 1.9e-2
    // on 200 and 8.5e-3 on 400. 50 % for the reference and the step.
    EXPECT_LT(waves, n == 200 ? 2.9e-2 : 1.3e-2);
  }
}

}  // namespace
}  // namespace ocublast::flow
