// TNT against the curves of Kingery and Bulmash: the calibrated ball, the JWL start, the curves
// themselves.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <vector>

#include "coupler/base/errors.hpp"
#include "flow_solver/sources/charge.hpp"
#include "tests/verification/charge_trace.hpp"

namespace ocublast::flow {
namespace {

using enum BlastQuantity;

// Sea level, as the curves: 101.325 kPa and c0 = 340.29 m/s.
const Gas air;
const State ambient{.rho = 1.225, .p = 101325.0};

double kb(BurstKind burst, BlastQuantity q, double Z) {
  return kingery_bulmash(burst, q, Z);
}

TEST(KingeryBulmash, GivesTheTabulatedFigures) {
  // Free air, Z = 0.5, 1, 2, 5, 10: five digits as printed for the same coefficients elsewhere.
  const double Z[5] = {0.5, 1.0, 2.0, 5.0, 10.0};
  const double incident[5] = {3884.8e3, 934.86e3, 194.67e3, 31.296e3, 11.091e3};
  const double reflected[5] = {30360e3, 5005.6e3, 645.83e3, 70.022e3, 23.313e3};
  const double arrival[5] = {0.15408e-3, 0.53184e-3, 1.9440e-3, 8.9953e-3, 22.722e-3};
  const double impulse[5] = {141.29, 174.54, 92.122, 40.619, 21.131};
  for (int i = 0; i < 5; ++i) {
    const auto near = [](double a, double b) { EXPECT_NEAR(a / b, 1.0, 5e-5); };
    near(kb(BurstKind::free_air, incident_pressure, Z[i]), incident[i]);
    near(kb(BurstKind::free_air, reflected_pressure, Z[i]), reflected[i]);
    near(kb(BurstKind::free_air, arrival_time, Z[i]), arrival[i]);
    near(kb(BurstKind::free_air, incident_impulse, Z[i]), impulse[i]);
  }
}

TEST(KingeryBulmash, FollowsTheShockRelations) {
  const double c0 = std::sqrt(1.4 * ambient.p / ambient.rho);
  for (const BurstKind burst : {BurstKind::free_air, BurstKind::surface}) {
    for (double Z = 1.0; Z <= 30.0; Z *= 1.3) {
      const double jump = kb(burst, incident_pressure, Z) / ambient.p;
      const double speed = c0 * std::sqrt(1.0 + 6.0 / 7.0 * jump);
      const double ideal = 2.0 * jump * ambient.p * (7.0 + 4.0 * jump) / (7.0 + jump);
      // The curves are fits of their own for each quantity.
      EXPECT_NEAR(kb(burst, shock_velocity, Z) / speed, 1.0,
                  burst == BurstKind::free_air ? 0.006 : 0.02)
          << Z;
      EXPECT_NEAR(kb(burst, reflected_pressure, Z) / ideal, 1.0, 0.03) << Z;
    }
  }
}

TEST(KingeryBulmash, RefusesDistancesBeyondTheCurves) {
  EXPECT_THROW(static_cast<void>(kb(BurstKind::free_air, incident_pressure, 0.01)), CaseError);
  EXPECT_THROW(static_cast<void>(kb(BurstKind::surface, arrival_time, 41.0)), CaseError);
}

TEST(BlastWaveForm, CarriesTheImpulse) {
  const BlastWaveForm wave = blast_wave_form(BurstKind::free_air, 8.0, 6.0, false);
  double sum = 0.0;
  constexpr int n = 2000;
  for (int i = 0; i < n; ++i)
    sum += wave.overpressure(wave.arrival + wave.duration * (i + 0.5) / n) * wave.duration / n;
  // Midpoint rule with 2000 points.
  EXPECT_NEAR(sum, 2.0 * kb(BurstKind::free_air, incident_impulse, 3.0), 1e-5 * sum);
  EXPECT_EQ(wave.overpressure(0.99 * wave.arrival), 0.0);
}

void compare(const char* name, BurstKind burst, const Trace& t, double delay, double mass,
             bool strict) {
  const double scale = std::cbrt(mass), Z = t.r / scale;
  const double p = t.peak / kb(burst, incident_pressure, Z) - 1.0;
  const double a = (t.arrival + delay) / (scale * kb(burst, arrival_time, Z)) - 1.0;
  const double i = t.impulse / (scale * kb(burst, incident_impulse, Z)) - 1.0;
  std::printf(
      "%s Z %5.2f: peak %9.2f kPa (%+5.1f %%), arrival %7.4f ms (%+5.1f %%), impulse %7.2f Pa s "
      "(%+5.1f %%)\n",
      name, Z, t.peak * 1e-3, 100.0 * p, (t.arrival + delay) * 1e3, 100.0 * a, t.impulse,
      100.0 * i);
  if (!strict) return;
  // The limits, chosen well within the scatter of measured blasts.
  EXPECT_NEAR(p, 0.0, 0.05) << Z;
  EXPECT_NEAR(a, 0.0, 0.05) << Z;
  EXPECT_NEAR(i, 0.0, 0.10) << Z;
}

TEST(CalibratedTnt, MeetsFreeAirAndSurfaceBurstsFromTwoToTen) {
  // One run serves both: on the ground a mass W acts as mirrored_tnt_mass(W) in the air, here 1 kg.
  const double on_ground = 1.0 / mirrored_tnt_mass(1.0, BurstKind::surface);
  const std::vector<double> Z{0.8, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0};
  std::vector<double> radii;
  for (const double z : Z) radii.push_back(z);
  for (const double z : Z) radii.push_back(z * std::cbrt(on_ground));
  const BallStart ball = tnt_ball(1.0, BurstKind::free_air);
  BallWave wave(air, ambient, ball, 11.0);
  const RadialTotals asked = wave.totals();
  EXPECT_NEAR(asked.energy / ball.energy, 1.0, 1e-9);
  EXPECT_NEAR(asked.mass / ball.mass, 1.0, 1e-9);
  const double end = kb(BurstKind::free_air, arrival_time, 10.0) +
                     1.1 * kb(BurstKind::free_air, positive_duration, 10.0);
  const auto traces = trace_wave(wave, radii, end);
  const double delay = tnt_delay(1.0, BurstKind::free_air);
  // What happens nearer than Z = 2 is stated, not tested.
  for (std::size_t i = 0; i < Z.size(); ++i)
    compare("free air", BurstKind::free_air, traces[i], delay, 1.0, Z[i] >= 2.0);
  for (std::size_t i = 0; i < Z.size(); ++i)
    compare("surface ", BurstKind::surface, traces[Z.size() + i], delay, on_ground, Z[i] >= 2.0);
}

TEST(CalibratedTnt, MeetsReflectedPressures) {
  for (const double Z : {1.0, 2.0, 3.0, 5.0, 10.0}) {
    // A rigid shell at Z; its curvature acts after the first peak only. Over a cell of Z/1000 the
    // peak falls by less than 1 %.
    BallWave wave(air, ambient, tnt_ball(1.0, BurstKind::free_air), Z,
                  {.cells_per_ball = 80, .growth = 0.001, .wall_at_end = true});
    const double end = 1.05 * kb(BurstKind::free_air, arrival_time, Z);
    const Trace t = trace_wave(wave, {Z * (1.0 - 1e-6)}, end).front();
    const double error = t.peak / kb(BurstKind::free_air, reflected_pressure, Z) - 1.0;
    std::printf("free air, ball Z %5.2f: reflected %9.2f kPa (%+5.1f %%)\n", Z, t.peak * 1e-3,
                100.0 * error);
    if (Z >= 2.0) {
      EXPECT_NEAR(error, 0.0, 0.08) << Z;
    }
  }
}

TEST(JwlCharge, KeepsItsEnergyAndStatesItsErrors) {
  JwlWave wave(air, ambient, {}, 1.0, 2.6, {.charge_cells = 30, .air_growth = 0.008});
  const auto traces = trace_wave(wave, {0.3, 0.5, 0.7, 1.0, 1.5, 2.0}, 2.6e-3);
  const RadialTotals now = wave.totals(), start = wave.charged();
  std::printf("JWL: energy %.9g J of %.9g, mass %.9g kg of %.9g, contact at %.2f m\n", now.energy,
              start.energy, now.mass, start.mass, wave.contact());
  // The scheme keeps energy to round-off; the outermost air is still at rest.
  EXPECT_NEAR(now.energy / start.energy, 1.0, 1e-6);
  EXPECT_NEAR(now.mass / start.mass, 1.0, 1e-9);
  for (const Trace& t : traces) compare("free air, JWL", BurstKind::free_air, t, 0.0, 1.0, false);
  // Without afterburning the wave lacks a quarter of its energy at Z = 1 to 2: pressure within a
  // third.
  EXPECT_NEAR(traces[3].peak / kb(BurstKind::free_air, incident_pressure, 1.0), 1.0, 0.33);
}

}  // namespace
}  // namespace ocublast::flow
