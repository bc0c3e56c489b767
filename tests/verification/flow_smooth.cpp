#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <numbers>
#include <vector>

#include "tests/verification/flow_problems.hpp"

namespace ocublast::flow {
namespace {

using std::numbers::pi;

/// L1 error of a density wave carried once through a periodic line.
double density_wave(int n, int axis, bool stretched, Scheme scheme, bool diffusivity) {
  FlowOptions o = unit_options();
  o.artificial_diffusivity = diffusivity;
  o.scheme = scheme;
  Grid g;
  g.axis = {make_absent_axis(), make_absent_axis(), make_absent_axis()};
  if (axis != 0) g.axis[0] = make_uniform_axis(0.0, 1.0, 8, true);
  std::vector<double> nodes;
  for (int i = 0; i < n; ++i) {
    const double s = (i + 0.5) / n;
    // +-30 % of spacing, smooth and periodic.
    nodes.push_back(stretched ? s + 0.3 / (2.0 * pi) * std::sin(2.0 * pi * s) : s);
  }
  const auto a = static_cast<std::size_t>(axis);
  g.axis[a] = make_axis_from_nodes(0.0, 1.0, nodes, true);
  Flow flow(g, all_faces(BoundaryKind::periodic), o);
  const auto rho = [](double s) { return 1.0 + 0.2 * std::sin(2.0 * pi * s); };
  flow.set_state([&](double x, double y, double z) {
    const double s = axis == 0 ? x : (axis == 1 ? y : z);
    return State{.rho = rho(s),
                 .u = axis == 0 ? 1.0 : 0.0,
                 .v = axis == 1 ? 1.0 : 0.0,
                 .w = axis == 2 ? 1.0 : 0.0,
                 .p = 1.0};
  });
  // Steps so small that the time error (h^4 of RK4) stays below the space error.
  const int steps = 16 * n;
  for (int s = 0; s < steps; ++s) flow.advance(s / static_cast<double>(steps), 1.0 / steps);
  const auto W = flow.primitives();
  double error = 0.0;
  for (int i = 0; i < n; ++i) {
    const double value = axis == 0 ? W(0, i, 0, 0) : (axis == 1 ? W(0, 0, i, 0) : W(0, 0, 0, i));
    error += std::abs(value - rho(nodes[static_cast<std::size_t>(i)])) / n;
  }
  return error;
}

void expect_order(const char* name, const std::vector<double>& errors, double order) {
  for (std::size_t m = 0; m + 1 < errors.size(); ++m) {
    std::printf("%s: %.3e -> %.3e, order %.2f\n", name, errors[m], errors[m + 1],
                std::log2(errors[m] / errors[m + 1]));
  }
  EXPECT_GT(std::log2(errors[errors.size() - 2] / errors.back()), order) << name;
}

TEST(DensityWave, ConvergesWithSixthOrderInEveryDirection) {
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> e;
    for (int n : {16, 32, 64}) e.push_back(density_wave(n, axis, false, Scheme::compact6, false));
    expect_order("density wave, uniform", e, 5.9);
  }
}

TEST(DensityWave, ConvergesWithSixthOrderOnAStretchedGrid) {
  std::vector<double> e;
  for (int n : {16, 32, 64}) e.push_back(density_wave(n, 0, true, Scheme::compact6, false));
  expect_order("density wave, stretched", e, 5.9);
}

TEST(DensityWave, ConvergesWithNearlyEighthOrderWhenAsked) {
  std::vector<double> e;
  for (int n : {8, 16, 32}) e.push_back(density_wave(n, 0, false, Scheme::compact8, false));
  // Eighth order in space and filter; the RK4 error at these steps is below 1e-9.
  expect_order("density wave, compact 8", e, 6.9);
}

TEST(DensityWave, KeepsNearlyFifthOrderWithArtificialDiffusivity) {
  std::vector<double> e;
  for (int n : {16, 32, 64, 128}) e.push_back(density_wave(n, 0, false, Scheme::compact6, true));
  // kappa* is of fifth order in the spacing (seed eq. 11).
  expect_order("density wave, LAD", e, 4.7);
}

TEST(IsentropicVortex, ReturnsAfterOnePeriodWithHighOrder) {
  FlowOptions o = unit_options();
  std::vector<double> e;
  for (int n : {32, 64}) e.push_back(vortex(n, o));
  std::printf("vortex 32, 64: %.3e %.3e, order %.2f\n", e[0], e[1], std::log2(e[0] / e[1]));
  // Prototype with alpha_f 0.45: 1.5e-4 and 2.9e-6.
  EXPECT_LT(e[1], 3e-6);
  EXPECT_GT(std::log2(e[0] / e[1]), 5.5);
  o.artificial_diffusivity = false;
  std::printf("vortex 64 without artificial diffusivity: %.3e\n", vortex(64, o));
}

/// The same vortex in the plane of the directions a and b of a three-dimensional grid, n x n x 8,
/// in steps of fixed length: density in the plane's order.
std::vector<double> vortex_in_plane(int n, std::size_t a, std::size_t b, double& error) {
  constexpr double strength = 5.0, gamma = 1.4;
  std::array<int, 3> cells{8, 8, 8};
  std::array<double, 3> lo{0, 0, 0}, hi{10, 10, 10};
  cells[a] = cells[b] = n;
  lo[a] = lo[b] = -5.0;
  hi[a] = hi[b] = 5.0;
  Flow flow(uniform_grid(cells, lo, hi, true), all_faces(BoundaryKind::periodic), unit_options());
  const auto state = [&](double s, double t) {
    const double f = strength / (2.0 * pi) * std::exp(0.5 * (1.0 - s * s - t * t));
    const double T = 1.0 - (gamma - 1.0) / (2.0 * gamma) * f * f;
    double u[3] = {};
    u[a] = 1.0 - t * f;
    u[b] = 1.0 + s * f;
    const double rho = std::pow(T, 1.0 / (gamma - 1.0));
    return State{.rho = rho, .u = u[0], .v = u[1], .w = u[2], .p = rho * T};
  };
  flow.set_state([&](double x, double y, double z) {
    const double at[3] = {x, y, z};
    return state(at[a], at[b]);
  });
  // Once through the box; Courant number 0.6 by the sum over the two directions.
  const int steps = n * 10;
  for (int s = 0; s < steps; ++s) flow.advance(10.0 * s / steps, 10.0 / steps);
  const auto W = std::as_const(flow).primitives();
  std::vector<double> rho;
  error = 0.0;
  for (int t = 0; t < n; ++t) {
    for (int s = 0; s < n; ++s) {
      int at[3] = {3, 3, 3};
      at[a] = s;
      at[b] = t;
      rho.push_back(W(0, at[0], at[1], at[2]));
      error +=
          std::abs(rho.back() - state(flow.grid().axis[a].x(s), flow.grid().axis[b].x(t)).rho) /
          (n * n);
    }
  }
  return rho;
}

TEST(IsentropicVortex, IsTheSameInEveryPlaneToRoundOff) {
  constexpr int n = 32;
  double error = 0.0;
  const std::vector<double> xy = vortex_in_plane(n, 0, 1, error);
  std::printf("vortex 32 x 32 x 8 in xy: L1 %.3e\n", error);
  EXPECT_LT(error, 1.5e-4);
  for (const auto& [a, b] : {std::pair<std::size_t, std::size_t>{1, 2}, {2, 0}, {0, 2}}) {
    const std::vector<double> other = vortex_in_plane(n, a, b, error);
    double largest = 0.0;
    for (std::size_t i = 0; i < xy.size(); ++i)
      largest = std::max(largest, std::abs(xy[i] - other[i]));
    std::printf("vortex in %c%c: L1 %.3e, largest difference from xy %.1e\n", "xyz"[a], "xyz"[b],
                error, largest);
    // The sums run in another order: 320 steps of roundings near 1.
    EXPECT_LT(largest, 1e-12);
  }
}

/// Relative error of the decay of u = sin(pi y) between resting walls at t = 0.05 / nu.
double shear_decay(int n, int axis) {
  constexpr double nu = 0.02, end = 1.0, amplitude = 0.01;
  FlowOptions o = unit_options();
  o.viscosity = Viscosity::constant;
  o.dynamic_viscosity = nu;
  o.artificial_diffusivity = false;
  Grid g;
  g.axis = {make_absent_axis(), make_absent_axis(), make_absent_axis()};
  const std::size_t along = axis == 0 ? 1 : 0;  // direction of the flow
  g.axis[along] = make_uniform_axis(0.0, 0.5, 8, true);
  g.axis[static_cast<std::size_t>(axis)] = make_uniform_axis(0.0, 1.0, n);
  Boundaries faces = all_faces(BoundaryKind::periodic);
  const auto a = static_cast<std::size_t>(axis);
  faces[2 * a].kind = faces[2 * a + 1].kind = BoundaryKind::wall;
  Flow flow(g, faces, o);
  flow.set_state([&](double x, double y, double z) {
    const double s = axis == 0 ? x : (axis == 1 ? y : z);
    const double u = amplitude * std::sin(pi * s);
    return State{.rho = 1.0, .u = along == 0 ? u : 0.0, .v = along == 1 ? u : 0.0, .p = 1.0};
  });
  run_to(flow, end);
  const auto W = flow.primitives();
  double largest = 0.0;
  for (int i = 0; i < n; ++i) {
    const double u = W(along == 0 ? 1 : 2, axis == 0 ? i : 0, axis == 1 ? i : 0, axis == 2 ? i : 0);
    const double exact = amplitude * std::sin(pi * (i + 0.5) / n) * std::exp(-nu * pi * pi * end);
    largest = std::max(largest, std::abs(u - exact));
  }
  return largest / amplitude;
}

TEST(ViscousShear, DecaysAtTheRightRateBetweenNoSlipWalls) {
  for (int axis = 0; axis < 3; ++axis) {
    const double coarse = shear_decay(16, axis), fine = shear_decay(32, axis);
    std::printf("viscous shear along %c: error %.2e -> %.2e, order %.2f\n", "xyz"[axis], coarse,
                fine, std::log2(coarse / fine));
    // Narrow second difference: relative rate error (pi h)^2 / 12 = 8e-4 at 32 cells, times nu pi^2
    // t = 0.2; viscous heating and compressibility add amplitude^2 = 1e-4.
    EXPECT_LT(fine, 4e-4);
  }
}

}  // namespace
}  // namespace ocublast::flow
