#include "tests/support/solid_columns.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

// Bending column (see bend) and twisting column of Lee, Gil & Bonet (2014): 1 x 1 x 6 m, clamped at
// z = 0, E = 17 MPa, rho = 1100 kg/m^3, no load.

namespace ocublast::solid {
namespace {

using namespace test;

TEST(BendingColumn, Q1P0IsIndependentOfTheBulkModulus) {
  for (const double ratio : {10.0, 1e3})
    EXPECT_NEAR(bend("hex8_q1p0", Shape::hex8, 4, ratio).largest, 2.87, 0.01 * 2.87);
  EXPECT_NEAR(bend("hex8_q1p0", Shape::hex8, 2, 1e3).largest, 2.81, 0.01 * 2.81);
}

TEST(BendingColumn, OnePointHexIsAsGood) {
  const auto bent = bend("hex8_one_point", Shape::hex8, 4, 1e3);
  EXPECT_NEAR(bent.largest, 2.87, 0.01 * 2.87);
  EXPECT_LT(bent.hourglass, 0.1);  // the rule of thumb of commercial codes
}

TEST(BendingColumn, AveragedPressureTetsBendAsMeasuredElsewhere) {
  // Another cut of the hexes into tets moves this by some per cent.
  EXPECT_NEAR(bend("tet4_anp", Shape::tet4, 2, 1e3).largest, 1.94, 0.1 * 1.94);
}

TEST(TwistingColumn, KeepsItsEnergyAndItsElements) {
  // omega = 105 sin(pi z / 12) rad/s, nu = 0.495, N = 8, to 0.3 s: two and a half turns back.
  auto setup = make_setup(make_block({.cells = {8, 8, 48}, .size = {1.0, 1.0, 6.0}}),
                          make_neo_hookean(17e6, 0.495, 1100.0));
  setup.fixed.push_back(fixed_set(*setup.mesh, "z0", {true, true, true}));
  SolidRun solid(setup);
  for (std::size_t a = 0; a < solid.mesh().n_nodes(); ++a) {
    const double* x = &solid.mesh().nodes[3 * a];
    const double omega = 105.0 * std::sin(pi * x[2] / 12.0);
    solid.set_velocity(static_cast<std::int32_t>(a),
                       {-omega * (x[1] - 0.5), omega * (x[0] - 0.5), 0.0});
  }
  double smallest = 1.0;
  double turned = 0.0;
  CellResults cells;
  std::size_t corner = solid.mesh().n_nodes() - 1;
  const double error = run(solid, 0.3, 60, [&](double) {
    solid.assembly().evaluate(solid.state().displacement, cells);
    for (std::size_t c = 0; c < solid.mesh().n_cells(); ++c)
      smallest = std::min(smallest, cells[c * n_evaluated + smallest_jacobian]);
    turned = std::max(turned, std::hypot(solid.state().displacement[4 * corner],
                                         solid.state().displacement[4 * corner + 1]));
  });
  std::printf("energy error %.2e, smallest J %.3f, corner moved by %.2f m\n", error, smallest,
              turned);
  EXPECT_LT(error, 1e-3);
  EXPECT_GT(smallest, 0.0);
  EXPECT_GT(turned, 1.0);  // it has gone past half a turn: the diagonal is 1.41 m
}

}  // namespace
}  // namespace ocublast::solid
