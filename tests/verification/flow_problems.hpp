#pragma once

// Problems with known solutions that several test programs run, in either precision.

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "tests/verification/flow_exact.hpp"
#include "tests/verification/flow_run.hpp"

namespace ocublast::flow::inline OCU_PRECISION {

/// tanh interface; its width in cells counts (numbers in the test of Sod's tube).
inline double blend(double left, double right, double x, double h, double width = 0.5) {
  return 0.5 * (left + right) - 0.5 * (left - right) * std::tanh(x / (width * h));
}

struct Tube {
  double error = 0.0;
  RunSummary run;
};

inline Tube sod(int n, int axis, double cfl, double width = 0.5, FlowOptions o = unit_options()) {
  std::array<int, 3> cells{1, 1, 1};
  cells[static_cast<std::size_t>(axis)] = n;
  if (axis != 0) cells[0] = 8;
  o.cfl = cfl;
  Boundaries faces = all_faces(BoundaryKind::symmetry);
  // Across, cells four times as wide: much wider ones let the round-off across the tube grow, as
  // the artificial bulk viscosity weighs differences by the square of the spacing.
  std::array<double, 3> low{-0.5, -0.5, -0.5}, high{0.5, 0.5, 0.5};
  const double h = 1.0 / n;
  if (axis != 0) {
    low[0] = -16.0 * h;
    high[0] = 16.0 * h;
  }
  Flow flow(uniform_grid(cells, low, high), faces, o);
  flow.set_state([&](double x, double y, double z) {
    const double s = axis == 0 ? x : (axis == 1 ? y : z);
    return State{.rho = blend(1.0, 0.125, s, h, width), .p = blend(1.0, 0.1, s, h, width)};
  });
  Tube out;
  out.run = run_to(flow, 0.2);
  const ExactRiemann exact({.rho = 1.0, .p = 1.0}, {.rho = 0.125, .p = 0.1}, 1.4);
  const auto W = flow.primitives();
  for (int i = 0; i < n; ++i) {
    const double a = -0.5 + i * h;
    const double rho = axis == 0 ? W(0, i, 0, 0) : (axis == 1 ? W(0, 0, i, 0) : W(0, 0, 0, i));
    out.error += h * std::abs(rho - exact.mean_density(a, a + h, 0.2));
  }
  return out;
}

/// Isentropic vortex in a periodic square after one period: mean of |rho - exact|.
inline double vortex(int n, FlowOptions o) {
  constexpr double strength = 5.0, gamma = 1.4;
  Flow flow(uniform_grid({n, n, 1}, {-5, -5, 0}, {5, 5, 1}, true),
            all_faces(BoundaryKind::periodic), o);
  const auto state = [&](double x, double y) {
    const double r2 = x * x + y * y,
                 f = strength / (2.0 * std::numbers::pi) * std::exp(0.5 * (1.0 - r2));
    const double T = 1.0 - (gamma - 1.0) / (2.0 * gamma) * f * f;
    const double rho = std::pow(T, 1.0 / (gamma - 1.0));
    return State{.rho = rho, .u = 1.0 - y * f, .v = 1.0 + x * f, .p = rho * T};
  };
  flow.set_state([&](double x, double y, double) { return state(x, y); });
  run_to(flow, 10.0, 0.75 / 0.9);
  const auto W = flow.primitives();
  double error = 0.0;
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      error +=
          std::abs(W(0, i, j, 0) - state(flow.grid().axis[0].x(i), flow.grid().axis[1].x(j)).rho) /
          (n * n);
    }
  }
  return error;
}

/// A ball of gas at rest in gas of density and pressure 1, to the time `end`.
struct BurstProblem {
  double radius, density, pressure, end;
};

inline constexpr double reference_reach = 1.5;

/// Pressure by radius from a spherical run on n cells up to `reference_reach`.
class Reference {
 public:
  Reference(const BurstProblem& burst, int n) : n_(n) {
    Grid g;
    g.axis = {make_uniform_axis(0.0, reference_reach, n), make_absent_axis(), make_absent_axis()};
    g.geometry = Geometry::spherical;
    FlowOptions o = unit_options();
    o.scheme = Scheme::muscl;
    Boundaries faces = all_faces(BoundaryKind::outflow, {.rho = 1.0, .p = 1.0});
    faces[0].kind = BoundaryKind::symmetry;
    Flow flow(g, faces, o);
    flow.set_state([&](double r, double, double) {
      return r < burst.radius ? State{.rho = burst.density, .p = burst.pressure}
                              : State{.rho = 1.0, .p = 1.0};
    });
    run_to(flow, burst.end);
    const auto W = std::as_const(flow).primitives();
    for (int i = 0; i < n; ++i) p_.push_back(W(0, i, 0, 0) * W(4, i, 0, 0));
  }
  [[nodiscard]] double at(double r) const {
    const double x = r / reference_reach * n_ - 0.5;
    const int i = std::clamp(static_cast<int>(std::floor(x)), 0, n_ - 2);
    const double f = std::clamp(x - i, 0.0, 1.0);
    return p_[static_cast<std::size_t>(i)] * (1.0 - f) + p_[static_cast<std::size_t>(i + 1)] * f;
  }
  [[nodiscard]] double peak() const { return *std::max_element(p_.begin(), p_.end()); }

 private:
  int n_;
  std::vector<double> p_;
};

struct BlastResult {
  double error = 0.0;    ///< mean of |p - p_ref| over the nodes in r < 1
  double average = 0.0;  ///< the same against means of the reference over cells
  double peak = 0.0, axis = 0.0, diagonal = 0.0;
  RunSummary run;
};

/// An eighth of the cube [-1, 1]^3 on n^3 nodes: N = 2 n cells per side of the whole.
inline BlastResult blast(const BurstProblem& burst, const Reference& reference, int n,
                         FlowOptions o = unit_options()) {
  Boundaries faces = all_faces(BoundaryKind::symmetry);
  for (std::size_t f : {1U, 3U, 5U}) {
    faces[f].kind = BoundaryKind::outflow;
    faces[f].state = {.rho = 1.0, .p = 1.0};
  }
  Flow flow(uniform_grid({n, n, n}, {0, 0, 0}, {1, 1, 1}), faces, o);
  flow.set_state([&](double x, double y, double z) {
    const bool in = x * x + y * y + z * z < burst.radius * burst.radius;
    return State{.rho = in ? burst.density : 1.0, .p = in ? burst.pressure : 1.0};
  });
  BlastResult out;
  out.run = run_to(flow, burst.end);
  const auto W = std::as_const(flow).primitives();
  int count = 0;
  const double h = 1.0 / n;
  for (int k = 0; k < n; ++k) {
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) {
        const double p = W(0, i, j, k) * W(4, i, j, k);
        out.peak = std::max(out.peak, p);
        if (j == 0 && k == 0) out.axis = std::max(out.axis, p);
        if (i == j && j == k) out.diagonal = std::max(out.diagonal, p);
        const double r = h * std::hypot(i + 0.5, j + 0.5, k + 0.5);
        if (r >= 1.0) continue;
        ++count;
        out.error += std::abs(p - reference.at(r));
        double mean = 0.0;
        for (int q = 0; q < 27; ++q) {
          mean += reference.at(h * std::hypot(i + (q % 3 + 0.5) / 3.0, j + (q / 3 % 3 + 0.5) / 3.0,
                                              k + (q / 9 + 0.5) / 3.0)) /
                  27.0;
        }
        out.average += std::abs(p - mean);
      }
    }
  }
  out.error /= count;
  out.average /= count;
  return out;
}

}  // namespace ocublast::flow
