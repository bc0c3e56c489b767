#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "tests/support/solid_beam.hpp"

namespace ocublast::solid {
namespace {

using namespace test;

/// Quarter of a disc of quads, n cells along each side: half a ball when turned about y.
SolidMesh quarter_disc(int n, double radius) {
  auto mesh = make_block_of(Shape::quad4, {.cells = {n, n, 1}, .size = {1.0, 1.0, 1.0}});
  for (std::size_t a = 0; a < mesh.n_nodes(); ++a) {
    double* x = &mesh.nodes[3 * a];
    const double largest = std::max(x[0], x[1]);
    const double length = std::hypot(x[0], x[1]);
    const Point p{x[0], x[1], 0.0};
    for (std::size_t i = 0; i < 2; ++i) {
      const double circle = length > 0.0 ? p[i] * largest / length : 0.0;
      x[i] = radius * ((1.0 - largest) * 0.75 * p[i] + largest * circle);
    }
  }
  return mesh;
}

TEST(SolidSphere, RadialModesHaveTheExactFrequencies) {
  // nu = 1/4: k R = 2.563434 and 6.058670 (Lamb 1882), f = k c / 2 pi.
  const double radius = 0.01;
  const auto material = make_neo_hookean(1e6, 0.25, 1000.0);
  const double c = material.sound_speed();
  for (const double kR : {2.563434, 6.058670}) {
    auto setup = make_setup(quarter_disc(32, radius), material, "quad4_axisymmetric");
    setup.fixed.push_back(fixed_set(*setup.mesh, "x0", {true, false, false}));
    setup.fixed.push_back(fixed_set(*setup.mesh, "y0", {false, true, false}));
    SolidRun solid(setup);
    const auto& mesh = solid.mesh();
    std::vector<double> shape(mesh.n_nodes());  // radial: spherical Bessel function j1
    for (std::size_t n = 0; n < mesh.n_nodes(); ++n) {
      const double* X = &mesh.nodes[3 * n];
      const double z = kR / radius * std::hypot(X[0], X[1], X[2]);
      shape[n] = z > 1e-6 ? std::sin(z) / (z * z) - std::cos(z) / z : z / 3.0;
      if (z < 1e-6) continue;
      const double v = 1e-3 * shape[n] * kR / radius / z;
      solid.set_velocity(static_cast<std::int32_t>(n), {v * X[0], v * X[1], v * X[2]});
    }
    const double exact = kR * c / radius / (2.0 * pi);
    const double sample = 1.0 / exact / 40.0;
    std::vector<double> amplitude;
    const double error = run(solid, 240 * sample, 240, [&](double) {
      double sum = 0.0;
      for (std::size_t n = 0; n < mesh.n_nodes(); ++n) {
        const double* X = &mesh.nodes[3 * n];
        const double r = std::hypot(X[0], X[1], X[2]);
        if (r == 0.0) continue;
        for (std::size_t i = 0; i < 3; ++i)
          sum +=
              solid.nodal_mass()[n] * shape[n] * X[i] / r * solid.state().displacement[4 * n + i];
      }
      amplitude.push_back(sum);
    });
    const double f = frequency_of(amplitude, sample);
    std::printf("radial mode %.2f Hz of %.2f (%+.2f %%), energy error %.1e\n", f, exact,
                100.0 * (f / exact - 1.0), error);
    EXPECT_NEAR(f, exact, 0.005 * exact);
    EXPECT_LT(error, 1e-3);
  }
}

TEST(Cantilever, SwingsAtTheBeamFrequency) {
  // Euler-Bernoulli in plane strain: f1 = 1.0767 Hz; shear and rotatory inertia lower it by
  // (h/L)^2 of order 0.3 %.
  SolidRun solid(make_beam(4, BeamRoot::straight));
  const auto& mesh = solid.mesh();
  for (std::size_t n = 0; n < mesh.n_nodes(); ++n) {
    const double s = mesh.nodes[3 * n] / 0.35;
    const double k = 1.8751040687 * s;  // first mode of a cantilever
    const double shape = std::cosh(k) - std::cos(k) - 0.7340955 * (std::sinh(k) - std::sin(k));
    solid.set_velocity(static_cast<std::int32_t>(n), {0.0, 1e-4 * shape, 0.0});
  }
  std::vector<double> tip;
  const std::size_t at = 4 * beam_tip(mesh) + 1;
  const double sample = 0.01;
  const double error =
      run(solid, 2.2, 220, [&](double) { tip.push_back(solid.state().displacement[at]); });
  // Two whole periods: the mean distance of the first and third rising crossing of zero.
  std::vector<double> crossings;
  for (std::size_t i = 1; i < tip.size(); ++i)
    if ((tip[i - 1] < 0.0) != (tip[i] < 0.0))
      crossings.push_back((static_cast<double>(i) + tip[i - 1] / (tip[i - 1] - tip[i])) * sample);
  ASSERT_GE(crossings.size(), 4u);
  const double f =
      0.5 * static_cast<double>(crossings.size() - 1) / (crossings.back() - crossings.front());
  std::printf("cantilever %.4f Hz of 1.0767 (%+.2f %%), energy error %.1e\n", f,
              100.0 * (f / 1.0767 - 1.0), error);
  EXPECT_NEAR(f, 1.0767, 0.01 * 1.0767);
  EXPECT_LT(error, 1e-3);
}

/// Angular frequency of the flexural Rayleigh-Lamb wave of wave number k in a plate of thickness h:
/// a simply supported plate swings exactly so in three dimensions. Antisymmetric branch:
/// tan(q d) / tan(p d) = -(q^2 - k^2)^2 / (4 k^2 p q), d = h/2, p^2 = w^2/cL^2 - k^2,
/// q^2 = w^2/cT^2 - k^2; both are imaginary on the lowest branch.
double flexural_frequency(double k, double h, double cL, double cT) {
  const auto balance = [&](double w) {
    const double p = std::sqrt(k * k - w * w / (cL * cL));
    const double q = std::sqrt(k * k - w * w / (cT * cT));
    const double s = q * q + k * k;  // (q^2 - k^2)^2 with q imaginary
    return 4.0 * k * k * p * q * std::tanh(0.5 * q * h) - s * s * std::tanh(0.5 * p * h);
  };
  double low = 1e-2 * k * cT;  // zero is a root as well
  double high = (1.0 - 1e-9) * k * cT;
  for (int i = 0; i < 200; ++i) {
    const double middle = 0.5 * (low + high);
    ((balance(middle) > 0.0) == (balance(low) > 0.0) ? low : high) = middle;
  }
  return low;
}

TEST(Plate, SimplySupportedSwingsAtTheExactFrequency) {
  // 1 x 1 x 0.1 m, nu = 0.3, a quarter by symmetry with 12 x 12 x 4 hexes.
  const auto material = make_neo_hookean(1e9, 0.3, 1000.0);
  auto setup = make_setup(make_block({.cells = {12, 12, 4}, .size = {0.5, 0.5, 0.1}}), material);
  const auto& m = *setup.mesh;
  setup.fixed.push_back(fixed_set(m, "x0", {false, true, true}));
  setup.fixed.push_back(fixed_set(m, "y0", {true, false, true}));
  setup.fixed.push_back(fixed_set(m, "x1", {true, false, false}));
  setup.fixed.push_back(fixed_set(m, "y1", {false, true, false}));
  SolidRun solid(setup);
  for (std::size_t n = 0; n < m.n_nodes(); ++n)
    solid.set_velocity(
        static_cast<std::int32_t>(n),
        {0.0, 0.0, 1e-3 * std::sin(pi * m.nodes[3 * n]) * std::sin(pi * m.nodes[3 * n + 1])});
  const double cT = std::sqrt(material.moduli.shear / material.density);
  const double exact =
      flexural_frequency(pi * std::sqrt(2.0), 0.1, material.sound_speed(), cT) / (2.0 * pi);
  const double sample = 1.0 / exact / 40.0;
  std::vector<double> w;
  const std::size_t centre = m.n_nodes() - 1;
  const double error = run(solid, 160 * sample, 160, [&](double) {
    w.push_back(solid.state().displacement[4 * centre + 2]);
  });
  const double f = frequency_of(w, sample);
  std::printf("plate %.3f Hz of %.3f (%+.2f %%), omega h sqrt(rho/G) = %.4f, energy error %.1e\n",
              f, exact, 100.0 * (f / exact - 1.0), 2.0 * pi * exact * 0.1 / cT, error);
  EXPECT_NEAR(f, exact, 0.01 * exact);
  EXPECT_LT(error, 1e-3);
}

}  // namespace
}  // namespace ocublast::solid
