#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "tests/support/solid_beam.hpp"

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

TEST(TurekHron, Csm3BeamSwingsAsPublished) {
  // Published: u_x = -14.305 +- 14.305 mm, u_y = -63.607 +- 65.160 mm, 1.0995 Hz (Turek & Hron
  // 2006, table 4). Compared are the largest deflections, mean and swing together: from rest the
  // other end of the swing is the rest. They were taken from one period of an implicit run of 5 ms
  // steps. Here the static deflection is the published one to 0.02 % (above) and the swing depends
  // neither on the step nor, in the limit, on the mesh; its u_x is 2.3 % above the published one all
  // the same, with u_y and the frequency within 1 %.
  const Swing halved = swing(6, 0.45);
  const Swing coarse = swing(6);
  const Swing fine = swing(10);
  EXPECT_NEAR(halved.x, coarse.x, 1e-3 * coarse.x);
  EXPECT_NEAR(halved.y, coarse.y, 1e-3 * coarse.y);
  const double x = limit(coarse.x, fine.x);
  const double y = limit(coarse.y, fine.y);
  const double f = limit(coarse.f, fine.f);
  std::printf(
      "limit: u_x %.3f mm (-28.610, %+.2f %%), u_y %.3f mm (-128.767, %+.2f %%), %.4f Hz "
      "(1.0995, %+.2f %%)\n",
      -x, 100.0 * (x / 28.610 - 1.0), -y, 100.0 * (y / 128.767 - 1.0), f,
      100.0 * (f / 1.0995 - 1.0));
  EXPECT_NEAR(x, 28.610, 0.03 * 28.610);
  EXPECT_NEAR(y, 128.767, 0.01 * 128.767);
  EXPECT_NEAR(f, 1.0995, 0.01 * 1.0995);
}

}  // namespace
}  // namespace ocublast::solid
