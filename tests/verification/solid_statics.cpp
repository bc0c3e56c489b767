#include "tests/support/solid_statics.hpp"

#include <gtest/gtest.h>

namespace ocublast::solid {
namespace {

using namespace test;

TEST(CooksMembrane, Q1P0QuadsGiveTheTabulatedTips) {
  // Top right corner, computed elsewhere with Q1P0 and the same law; converged: about 6.92.
  for (const auto& [n, expected] : {std::pair{4, 6.020}, std::pair{8, 6.619}}) {
    const auto cook = solve_cook(n);
    std::printf("N = %d: tip u_y %.3f (%.3f), u_x %.3f; %zu steps of relaxation\n", n, cook.uy,
                expected, cook.ux, cook.steps);
    EXPECT_NEAR(cook.uy, expected, 0.005 * expected);
  }
}

TEST(ThickSphere, InflatesByTheExactPressureNeoHookean) {
  const double G = 1e5;
  check_inflation("neo_hookean", {G, 1000.0 * G}, 24, 12, 0.25 * G,
                  [&](double l) { return G * (2.0 * l - 2.0 * std::pow(l, -5.0)); });
}

TEST(Equilibrium, EyeUnderItsPressureStaysAtRest) {
  // A shell of 12 mm under 15 mmHg: relaxation finds the membrane stress p R / 2 h, and the run
  // that follows does not move.
  auto setup = make_setup(make_shell(6, 2, 0.0115, 0.012), make_neo_hookean(1e6, 0.49, 1000.0));
  setup.pressures.push_back(
      {.facets = setup.mesh->face_sets.at("inner"), .pressure = {{0.0}, {2000.0}}});
  SolidRun solid(setup);
  const auto relaxed = solid.relax(1e-6, 200000);
  CellResults cells;
  solid.assembly().evaluate(solid.state().displacement, cells);
  const auto before = solid.state().displacement;
  double largest = 0.0;
  for (const double d : before) largest = std::max(largest, std::abs(d));
  double drift = 0.0;
  const double error = run(solid, 2e-3, 20, [&](double) {
    for (std::size_t i = 0; i < before.size(); ++i)
      drift = std::max(drift, std::abs(solid.state().displacement[i] - before[i]));
  });
  // Mean hoop stress of a thick shell: p a^2 / (b^2 - a^2) by the balance of a hemisphere, at the
  // present radii.
  double hoop = 0.0;
  double volume = 0.0;
  for (std::size_t c = 0; c < solid.mesh().n_cells(); ++c) {
    const double* s = &cells[c * n_evaluated];
    hoop += s[stress_xx] + s[stress_yy] + s[stress_zz];
    volume += 1.0;
  }
  std::printf(
      "%zu steps, residual %.1e; radius grows by %.3f %%; drift %.1e of it; energy error "
      "%.1e; mean trace of stress %.0f Pa\n",
      relaxed.steps, relaxed.residual, 100.0 * largest / 0.012, drift / largest, error,
      hoop / volume);
  // Thin sphere: growth p R (1 - nu) / (2 E h) = 1.17 % at the middle radius; finite strain and
  // thickness move it by a tenth.
  EXPECT_NEAR(largest / 0.012, 2000.0 * 0.01175 * 0.51 / (2.0 * 1e6 * 0.0005), 0.1 * 0.012);
  EXPECT_LT(drift, 1e-3 * largest);
  EXPECT_LT(error, 1e-3);
}

}  // namespace
}  // namespace ocublast::solid
