// The point blast with counter-pressure by the spherical run from which charges start.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <iterator>

#include "flow_solver/sources/ball_wave.hpp"
#include "tests/verification/charge_trace.hpp"

namespace ocublast::flow {
namespace {

struct PointBlast {
  double r, overpressure, arrival,
      impulse;  // in (E/p0)^(1/3), p0, (E/p0)^(1/3)/c0, p0 (E/p0)^(1/3)/c0
};

// Tabulated solution of the point blast in air of gamma 1.4 (blast-ips, stated error 7e-7).
constexpr PointBlast exact[] = {{0.2, 20.59571, 0.01905341, 0.2122995},
                                {0.3, 6.71481, 0.04997314, 0.1205041},
                                {0.5, 1.931333, 0.1518476, 0.07758419},
                                {0.7, 0.9582338, 0.2885848, 0.05984344},
                                {1, 0.4980896, 0.5271386, 0.04377666}};

/// The same by a run with cells of `part` of their distance (beyond 0.06; below, of 0.06).
std::vector<Trace> trace_point_blast(double part) {
  const Gas gas{.heat_capacity_ratio = 1.4, .gas_constant = 1.0};
  const State at_rest{.rho = 1.4, .p = 1.0};  // c0 = 1
  std::vector<double> radii;
  for (const PointBlast& row : exact) radii.push_back(row.r);
  BallWave wave(gas, at_rest, {.energy = 1.0, .radius = 0.03, .mass = 1e-12}, 1.3,
                {.cells_per_ball = .015 / part, .growth = part});
  return trace_wave(wave, radii, 1.25);
}

#ifndef OCU_LONG_TESTS
TEST(PointBlast, MeetsTheExactSolutionWithCounterPressure) {
  const auto traces = trace_point_blast(5e-4);
  for (std::size_t i = 0; i < traces.size(); ++i) {
    const Trace& t = traces[i];
    const double p = t.front / exact[i].overpressure - 1.0,
                 raw = t.peak / exact[i].overpressure - 1.0, a = t.arrival / exact[i].arrival - 1.0,
                 I = t.impulse / exact[i].impulse - 1.0;
    std::printf(
        "point blast r %.2f: front %.4f (%+.2f %%; largest value %+.2f %%), arrival %.4f (%+.2f "
        "%%), impulse %.4f (%+.2f %%)\n",
        t.r, t.front, 100.0 * p, 100.0 * raw, t.arrival, 100.0 * a, t.impulse, 100.0 * I);
    // Nearer than 0.5 the decay behind the front is as thin as the front is smeared: stated, not
    // tested.
    if (t.r >= 0.5) {
      EXPECT_NEAR(p, 0.0, 0.02);
    }
    EXPECT_NEAR(a, 0.0, 0.02);
    EXPECT_NEAR(I, 0.0, 0.02);
  }
}

#else
/// What a captured front, smeared over three cells, leaves of the peak that decays behind it. On
/// cells of r / 6250 (a quarter of an hour) the largest values are 2.9, 1.9 and 1.3 % low at r =
/// 0.5, 0.7 and 1.
TEST(PointBlast, ComesToItsPeaksOnFinerGrids) {
  std::vector<std::vector<Trace>> runs;
  for (const double part : {1e-3, 5e-4, 2.5e-4}) runs.push_back(trace_point_blast(part));
  for (std::size_t i = 2; i < std::size(exact); ++i) {
    std::printf("point blast r %.1f, largest value on cells of r / 1000, 2000, 4000:", exact[i].r);
    double last = 1.0;
    for (const auto& run : runs) {
      const double off = run[i].peak / exact[i].overpressure - 1;
      std::printf(" %+.2f", 100 * off);
      // Lost to the front's width in cells, more in the steep decay near the charge.
      EXPECT_LT(std::abs(off), .85 * last);
      last = std::abs(off);
    }
    std::printf(" %%\n");
    if (exact[i].r == 1) {
      EXPECT_LT(last, .02);
    }
  }
}
#endif

}  // namespace
}  // namespace ocublast::flow
