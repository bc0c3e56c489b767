#include <gtest/gtest.h>

#include "tests/support/solid_statics.hpp"

namespace ocublast::solid {
namespace {

using namespace test;

TEST(CooksMembrane, ConvergesAsTabulated) {
  for (const auto& [n, expected] : {std::pair{16, 6.814}, std::pair{32, 6.884}}) {
    const auto cook = solve_cook(n);
    std::printf("N = %d: tip u_y %.3f (%.3f), u_x %.3f; %zu steps of relaxation\n", n, cook.uy,
                expected, cook.ux, cook.steps);
    EXPECT_NEAR(cook.uy, expected, 0.005 * expected);
  }
}

TEST(ThickSphere, InflatesByTheExactPressureMooneyRivlin) {
  const double c10 = 4e4, c01 = 1e4, K = 1e8;
  check_inflation("mooney_rivlin", {c10, c01, K}, 24, 12, 2.3e4, [&](double l) {
    return c10 * (4.0 * l - 4.0 * std::pow(l, -5.0)) + c01 * (4.0 * l * l * l - 4.0 / (l * l * l));
  });
}

TEST(ThickSphere, InflatesByTheExactPressureYeoh) {
  const double c10 = 5e4, c20 = 2e4, c30 = 1e4, K = 1e8;
  check_inflation("yeoh", {c10, c20, c30, K}, 24, 12, 2.5e4, [&](double l) {
    const double x = 2.0 * l * l + std::pow(l, -4.0) - 3.0;
    return (c10 + x * (2.0 * c20 + 3.0 * c30 * x)) * (4.0 * l - 4.0 * std::pow(l, -5.0));
  });
}

TEST(ThickSphere, InflatesByTheExactPressureHolzapfelGasserOgden) {
  // Two families in the surface, psi = G/2 (I1 - 3) + 2 k1/(2 k2) (exp(k2 E^2) - 1),
  // E = kappa (I1 - 3) + (1 - 3 kappa) (l^2 - 1).
  const double G = 5e4, k1 = 2e4, k2 = 2.0, kappa = 0.1, K = 1e8;
  check_inflation("holzapfel_gasser_ogden", {G, k1, k2, kappa, K}, 24, 12, 2.3e4, [&](double l) {
    const double I1 = 2.0 * l * l + std::pow(l, -4.0);
    const double I1_slope = 4.0 * l - 4.0 * std::pow(l, -5.0);
    const double E = kappa * (I1 - 3.0) + (1.0 - 3.0 * kappa) * (l * l - 1.0);
    const double E_slope = kappa * I1_slope + (1.0 - 3.0 * kappa) * 2.0 * l;
    return 0.5 * G * I1_slope + 2.0 * k1 * E * std::exp(k2 * E * E) * E_slope;
  });
}

TEST(ThickSphere, InflatesByTheExactPressureOgden) {
  // Two terms, psi = sum mu/alpha (sum l^alpha - 3).
  const double mu1 = 6e4, a1 = 2.5, mu2 = -2e4, a2 = -1.5, K = 1e8;
  check_inflation("ogden", {mu1, a1, mu2, a2, 0.0, 1.0, K}, 24, 12, 2.3e4, [&](double l) {
    const auto term = [&](double mu, double a) {
      return 2.0 * mu * (std::pow(l, a - 1.0) - std::pow(l, -2.0 * a - 1.0));
    };
    return term(mu1, a1) + term(mu2, a2);
  });
}

}  // namespace
}  // namespace ocublast::solid
