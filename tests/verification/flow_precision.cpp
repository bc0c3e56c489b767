// The flow in single precision against exact solutions and against itself in double precision.

#include "tests/verification/flow_precision.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace ocublast::flow::testing {
namespace {

constexpr double rounding = 5.96e-8;  ///< 2^-24, half a unit in the last place of a number near 1

const PrecisionRun& twice() {
  return in_double_precision();
}
const PrecisionRun& once() {
  return in_single_precision();
}

TEST(SinglePrecision, SolvesSodsTubeAsWellAsDouble) {
  for (const int n : {200, 400}) {
    const double d = twice().sod(n), s = once().sod(n);
    std::printf("sod %d: L1(rho) double %.4e, single %.4e\n", n, d, s);
    EXPECT_NEAR(s, d, 0.01 * d);
  }
}

TEST(SinglePrecision, BringsTheVortexRoundToItsRoundings) {
  for (const int n : {32, 64}) {
    const double d = twice().vortex(n), s = once().vortex(n);
    std::printf("vortex %d^2: L1(rho) double %.3e, single %.3e\n", n, d, s);
    // 64^2: 190 steps, each of which rounds the state once: a random walk of sqrt(190) roundings of
    // half the density's 1 on average, spread by the flow: 0.8e-6. Thrice that as a bound.
    EXPECT_LT(s, d + 3.0 * std::sqrt(190.0) * rounding);
  }
}

TEST(SinglePrecision, FollowsTheSphericalBlast) {
  const BlastFigures d = twice().blast(16), s = once().blast(16);
  std::printf("blast 32^3: L1(p) double %.4e, single %.4e; peak %.5f, %.5f; steps %d, %d\n",
              d.error, s.error, d.peak, s.peak, d.steps, s.steps);
  EXPECT_NEAR(s.error, d.error, 0.01 * d.error);
  // The sensor's switch makes roundings larger, by far not to the truncation error: a thousandth.
  EXPECT_NEAR(s.peak, d.peak, 1e-3 * d.peak);
}

TEST(SinglePrecision, ReflectsAShockFromAnImmersedWall) {
  for (const double offset : {0.05, 0.55}) {
    const WallFigures d = twice().reflection(3.0, offset), s = once().reflection(3.0, offset);
    std::printf("Ms 3, offset %.2f: p5 error double %+.2e, single %+.2e; leak %.1e, %.1e\n", offset,
                d.plateau_error, s.plateau_error, d.leak, s.leak);
    EXPECT_LT(std::abs(s.plateau_error), 2e-3);
    // Pressure behind the plate is a product of two rounded values, formed from three others.
    EXPECT_LT(s.leak, 6.0 * rounding);
  }
}

TEST(SinglePrecision, KeepsAUniformStreamToItsRoundings) {
  const double d = twice().free_stream(), s = once().free_stream();
  std::printf("uniform stream, 100 steps: largest change double %.1e, single %.1e\n", d, s);
  // 100 steps that round each value once, as a random walk, four deviations of it for the worst of
  // 2e4 nodes.
  EXPECT_LT(s, 4.0 * std::sqrt(100.0) * rounding * 2.0);
}

TEST(SinglePrecision, LeavesAirAtRestAtRest) {
  const Rest s = once().rest(300);
  std::printf("air at rest, 300 steps: velocity %.1e m/s, density %.1e, temperature %.1e\n",
              s.velocity, s.density, s.temperature);
  // Momentum fluxes are differences against the pressure at rest: nothing moves. Temperature comes
  // from the conserved state, three roundings away.
  EXPECT_EQ(s.velocity, 0.0);
  EXPECT_LT(s.density, rounding * 1.01);
  EXPECT_LT(s.temperature, 4.0 * rounding);
}

TEST(SinglePrecision, KeepsMassAndEnergyToItsRoundings) {
  const Conservation d = twice().closed_box(), s = once().closed_box();
  std::printf(
      "closed box, 100 steps: mass double %+.1e, single %+.1e; energy %+.1e, %+.1e; marked %zu, "
      "%zu\n",
      d.mass, s.mass, d.energy, s.energy, d.marked, s.marked);
  // Each of 2e4 cells is rounded to nearest in each step; without a bias the sum changes by far
  // less than one rounding per step. One rounding in each ten steps would be a bias.
  EXPECT_LT(std::abs(s.mass), 10.0 * rounding);
  EXPECT_LT(std::abs(s.energy), 10.0 * rounding);
}

TEST(SinglePrecision, CarriesWeakWavesDownToItsNoise) {
  for (const double amplitude : {1e-2, 1e-4}) {
    const auto d = twice().pulse(amplitude), s = once().pulse(amplitude);
    double worst = 0.0, peak = 0.0;
    for (std::size_t i = 0; i < d.size(); ++i) {
      worst = std::max(worst, std::abs(s[i] - d[i]));
      peak = std::max(peak, d[i]);
    }
    std::printf("pulse of %.0e of ambient pressure: peak %.3f Pa, largest difference %.3f Pa\n",
                amplitude, peak, worst);
    // 170 steps, each rounding the energy: a random walk of sqrt(170) x 6e-8 of ambient pressure
    // (0.08 Pa), four deviations of it.
    EXPECT_LT(worst, 4.0 * std::sqrt(170.0) * rounding * 101325.0);
  }
}

TEST(SinglePrecision, RaisesATighterToleranceOfTheActiveBox) {
  EXPECT_EQ(twice().active_tolerance(1e-9), 1e-9);
  EXPECT_EQ(once().active_tolerance(1e-9), 1e-6);
  EXPECT_EQ(once().active_tolerance(1e-5), 1e-5);
}

}  // namespace
}  // namespace ocublast::flow::testing
