#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "tests/support/solid_beam.hpp"
#include "tests/support/solid_trapezoid.hpp"

namespace ocublast::solid {
namespace {

using namespace test;

/// Largest deflections of the tip (mm) and frequency (Hz) of the beam let go under 2 m/s^2.
struct Swing {
  double x = 0.0;
  double y = 0.0;
  double f = 0.0;
};

Swing swing(int across, double safety = 0.9) {
  auto setup = make_beam(across, BeamRoot::round);
  setup.body_loads.push_back({.acceleration = {0.0, -2.0, 0.0}, .factor = {{0.0}, {1.0}}});
  setup.control.safety = safety;
  SolidRun solid(setup);
  const std::size_t at = 4 * beam_tip(solid.mesh());
  std::vector<double> x, y;
  const double sample = 0.005;
  const double error = run(solid, 2.0, 400, [&](double) {
    x.push_back(-1e3 * solid.state().displacement[at]);
    y.push_back(-1e3 * solid.state().displacement[at + 1]);
  });
  const Swing s{.x = *std::max_element(x.begin(), x.end()),
                .y = *std::max_element(y.begin(), y.end()),
                .f = frequency_of(y, sample)};
  std::printf("N = %d: u_x %.3f mm, u_y %.3f mm, %.4f Hz, energy error %.1e\n", across, -s.x, -s.y,
              s.f, error);
  EXPECT_LT(error, 1e-3);
  return s;
}

/// Quads bend too softly by a part in N^2, which two meshes, 6 and 10 across, take out.
double limit(double at6, double at10) {
  return (100.0 * at10 - 36.0 * at6) / 64.0;
}

TEST(TurekHron, Csm1BeamHangsAsPublished) {
  // u_x = -7.187 mm, u_y = -66.10 mm (Turek & Hron 2006, table 2).
  std::array<std::array<double, 2>, 2> tip{};
  for (const int mesh : {0, 1}) {
    const int across = mesh == 0 ? 6 : 10;
    auto setup = make_beam(across, BeamRoot::round);
    setup.body_loads.push_back({.acceleration = {0.0, -2.0, 0.0}, .factor = {{0.0}, {1.0}}});
    SolidRun solid(setup);
    const auto relaxed = solid.relax(1e-6, 4000000);
    for (std::size_t i = 0; i < 2; ++i)
      tip[static_cast<std::size_t>(mesh)][i] =
          1e3 * solid.state().displacement[4 * beam_tip(solid.mesh()) + i];
    std::printf("N = %d: u_x %.4f mm, u_y %.4f mm, %zu steps\n", across,
                tip[static_cast<std::size_t>(mesh)][0], tip[static_cast<std::size_t>(mesh)][1],
                relaxed.steps);
    std::fflush(stdout);
  }
  const double x = limit(tip[0][0], tip[1][0]);
  const double y = limit(tip[0][1], tip[1][1]);
  std::printf("limit: u_x %.4f mm (-7.187, %+.2f %%), u_y %.4f mm (-66.10, %+.2f %%)\n", x,
              100.0 * (x / -7.187 - 1.0), y, 100.0 * (y / -66.10 - 1.0));
  EXPECT_NEAR(x, -7.187, 0.005 * 7.187);
  EXPECT_NEAR(y, -66.10, 0.005 * 66.10);
}

/// The last whole period of the beam by trapezoidal steps up to 10 s: middle and half range of its
/// tip's displacement (mm), frequency (Hz); and the largest deflections of its first 2 s.
struct Period {
  double x = 0.0, x_swing = 0.0;
  double y = 0.0, y_swing = 0.0;
  double f = 0.0;
  double first_x = 0.0, first_y = 0.0;
};

Period last_period(int across, double dt) {
  const auto setup = make_beam(across, BeamRoot::round);
  TrapezoidRun solid(setup, {0.0, -2.0});
  const std::size_t tip = beam_tip(*setup.mesh);
  std::vector<double> x, y;
  const auto n = static_cast<std::size_t>(std::lround(10.0 / dt));
  for (std::size_t k = 0; k < n; ++k) {
    solid.step(dt);
    x.push_back(1e3 * solid.displacement(tip, 0));
    y.push_back(1e3 * solid.displacement(tip, 1));
  }
  double mean = 0.0;
  for (const double value : y) mean += value / static_cast<double>(n);
  std::vector<std::size_t> rises;
  std::vector<double> times;
  for (std::size_t k = 1; k < n; ++k)
    if (y[k - 1] < mean && y[k] >= mean) {
      rises.push_back(k);
      times.push_back((static_cast<double>(k) - (y[k] - mean) / (y[k] - y[k - 1])) * dt);
    }
  const auto range = [](const std::vector<double>& of, std::size_t begin, std::size_t end) {
    const auto [low, high] = std::minmax_element(of.begin() + static_cast<std::ptrdiff_t>(begin),
                                                 of.begin() + static_cast<std::ptrdiff_t>(end));
    return std::array<double, 2>{0.5 * (*low + *high), 0.5 * (*high - *low)};
  };
  const std::size_t begin = rises[rises.size() - 2];
  const auto of_x = range(x, begin, rises.back());
  const auto of_y = range(y, begin, rises.back());
  const auto first = static_cast<std::ptrdiff_t>(n / 5);
  const Period p{.x = of_x[0],
                 .x_swing = of_x[1],
                 .y = of_y[0],
                 .y_swing = of_y[1],
                 .f = 1.0 / (times.back() - times[times.size() - 2]),
                 .first_x = -*std::min_element(x.begin(), x.begin() + first),
                 .first_y = -*std::min_element(y.begin(), y.begin() + first)};
  std::printf(
      "N = %d, trapezoidal steps of %.0f ms, last period: u_x %.3f +- %.3f mm, u_y %.3f +- %.3f "
      "mm, "
      "%.4f Hz; first 2 s: u_x %.3f mm, u_y %.3f mm\n",
      across, 1e3 * dt, p.x, p.x_swing, p.y, p.y_swing, p.f, -p.first_x, -p.first_y);
  std::fflush(stdout);
  return p;
}

void expect_near(const char* what, double found, double published, double part) {
  std::printf("  %s %.3f (%.3f, %+.2f %%)\n", what, found, published,
              100.0 * (found / published - 1.0));
  EXPECT_NEAR(found, published, part * std::abs(published)) << what;
}

// Published: u_x = -14.305 +- 14.305 mm, u_y = -63.607 +- 65.160 mm, 1.0995 Hz (Turek & Hron 2006,
// table 4), from the last period of 10 s in trapezoidal steps of 5 ms. Such steps lengthen the
// period of the second mode (6.8 Hz) by 0.4 %, a quarter of a cycle in 10 s, which changes how it
// adds to the first mode's swing: in steps of 10 ms the last period has u_x = -14.72 +- 14.72 mm on
// the same mesh that has -14.36 +- 14.36 mm in steps of 5 ms. So the published values are reached
// with steps of 5 ms over 10 s only, and the solver's own exact motion is compared with such steps
// while they are still exact: in the first two swings.
TEST(TurekHron, Csm3BeamSwingsAsPublished) {
  const Period coarse = last_period(6, 0.005);
  const Period fine = last_period(10, 0.005);
  std::printf("limit:\n");
  // The aim is 1 %.
  expect_near("u_x, middle, mm", limit(coarse.x, fine.x), -14.305, 0.005);
  expect_near("u_x, swing, mm", limit(coarse.x_swing, fine.x_swing), 14.305, 0.005);
  expect_near("u_y, middle, mm", limit(coarse.y, fine.y), -63.607, 0.005);
  expect_near("u_y, swing, mm", limit(coarse.y_swing, fine.y_swing), 65.160, 0.005);
  expect_near("frequency, Hz", limit(coarse.f, fine.f), 1.0995, 0.01);
  const Swing own = swing(10);
  std::printf("solver against trapezoidal steps, first 2 s:\n");
  expect_near("u_x, mm", -own.x, -fine.first_x, 0.002);
  expect_near("u_y, mm", -own.y, -fine.first_y, 0.002);
  expect_near("frequency, Hz", own.f, fine.f, 0.002);
}

TEST(TurekHron, Csm3SwingDoesNotDependOnTheStep) {
  const Swing halved = swing(6, 0.45);
  const Swing own = swing(6);
  EXPECT_NEAR(halved.x, own.x, 1e-3 * own.x);
  EXPECT_NEAR(halved.y, own.y, 1e-3 * own.y);
  EXPECT_NEAR(halved.f, own.f, 1e-3 * own.f);
}

}  // namespace
}  // namespace ocublast::solid
