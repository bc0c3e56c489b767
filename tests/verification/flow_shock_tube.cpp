#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <numbers>
#include <vector>

#include "tests/verification/flow_problems.hpp"

namespace ocublast::flow {
namespace {

TEST(SodTube, MatchesTheExactSolution) {
  // Half of the error lies in the fan and comes from its start: an interface of 0.4 cells is best
  // at the Courant number 0.9. A shock that moves at the start (Shu and Osher's) wants 0.5 to 0.6.
  for (const double width : {0.4, 0.5}) {
    for (const int n : {100, 200, 400}) {
      const Tube t = sod(n, 0, 0.9, width);
      std::printf("sod n %4d, interface %.1f h: L1(rho) %.3e, steps %d, redone %d, marked %zu\n", n,
                  width, t.error, t.run.steps, t.run.redone, t.run.marked);
      // On 200 and 400 cells second-order PLM has 2.39e-3 and 1.28e-3, PPM 1.98e-3 and 0.99e-3.
      EXPECT_LT(t.error, 0.43 / n);
      if (width > 0.4 || n == 100) continue;
      EXPECT_LT(t.error, n == 200 ? 1.85e-3 : 0.93e-3);
    }
  }
}

TEST(SodTube, RunsWithThePapersDiffusivities) {
  FlowOptions o = unit_options();
  o.diffusivity_form = DiffusivityForm::paper;
  o.sensor = Sensor::strain;
  const Tube paper = sod(200, 0, 0.9, 0.4, o), recommended = sod(200, 0, 0.9, 0.4);
  std::printf("sod n 200: L1(rho) %.3e in the paper's form, %.3e in the recommended one\n",
              paper.error, recommended.error);
  // The strain rate acts in the fan as well; prototype 5.8e-3 against 3.7e-3 (relative).
  EXPECT_LT(paper.error, 1.8 * recommended.error);
  EXPECT_EQ(paper.run.redone, 0);
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
std::vector<double> shu_osher(int n, int& steps) {
  const State left{.rho = 3.857143, .u = 2.629369, .p = 10.33333}, right{.rho = 1.0, .p = 1.0};
  Boundaries faces = all_faces(BoundaryKind::fixed_state, left);
  faces[1] = {.kind = BoundaryKind::outflow, .state = right};
  Flow flow(uniform_grid({n, 1, 1}, {-1, 0, 0}, {1, 1, 1}), faces, unit_options());
  const double h = 2.0 / n;
  flow.set_state([&](double x, double, double) {
    const double rho = 1.0 + 0.2 * std::sin(5.0 * std::numbers::pi * x);
    return State{.rho = blend(left.rho, rho, x + 0.8, h),
                 .u = blend(left.u, 0.0, x + 0.8, h),
                 .p = blend(left.p, 1.0, x + 0.8, h)};
  });
  steps = run_to(flow, 0.47).steps;
  std::vector<double> rho;
  for (int i = 0; i < n; ++i) rho.push_back(flow.primitives()(0, i, 0, 0));
  return rho;
}

TEST(ShuOsher, ResolvesTheWavesBehindTheShock) {
  // Reference: the same scheme on 1600 cells, averaged over the cells of the coarse grid; its own
  // error is below a tenth of what is tested (8.5e-3 at 400 cells in the waves, first order).
  int steps = 0;
  const std::vector<double> fine = shu_osher(1600, steps);
  for (const int n : {200, 400}) {
    const std::vector<double> rho = shu_osher(n, steps);
    const int part = 1600 / n;
    double whole = 0.0, waves = 0.0;
    int count = 0;
    for (int i = 0; i < n; ++i) {
      double mean = 0.0;
      for (int m = 0; m < part; ++m) mean += fine[static_cast<std::size_t>(i * part + m)] / part;
      const double e = std::abs(rho[static_cast<std::size_t>(i)] - mean),
                   x = -1.0 + (i + 0.5) * 2.0 / n;
      whole += e / n;
      if (x > 0.45 && x < 0.85) {
        waves += e;
        ++count;
      }
    }
    waves /= count;
    std::printf("shu-osher n %d: L1 whole %.2e, waves %.2e, steps %d\n", n, whole, waves, steps);
    // PPM on 400 cells has 6.8e-2 in the waves, on 200 cells 1.6e-1; a tenth-order compact code
    // 2.7e-2 and 8.8e-3, in 2736 steps on 400.
    EXPECT_LT(waves, n == 200 ? 2.0e-2 : 8.7e-3);
    EXPECT_LE(steps, n == 200 ? 260 : 520);
  }
}

}  // namespace
}  // namespace ocublast::flow
