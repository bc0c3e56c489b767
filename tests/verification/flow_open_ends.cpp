// What open ends send back: pulses and a spherical blast that leave the domain.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <vector>

#include "flow_solver/boundary/open_ends.hpp"
#include "tests/verification/flow_run.hpp"

namespace ocublast::flow {
namespace {

const State quiet{.rho = 1.0, .p = 1.0};

/// Largest |p - 1| inside [0, 1], by the amplitude, after a pulse has left through both ends.
double residual(double amplitude, int layer) {
  AxisSpec spec{.min = 0.0, .max = 1.0, .spacing = 0.005};
  spec.low = spec.high = {.cells = layer, .ratio = 1.1};
  Grid g;
  g.axis = {make_axis(spec), make_absent_axis(), make_absent_axis()};
  Flow flow(g, all_faces(BoundaryKind::outflow, quiet), unit_options());
  flow.set_state([&](double x, double, double) {
    const double p = 1.0 + amplitude * std::exp(-std::pow((x - 0.5) / 0.05, 2.0));
    return State{.rho = std::pow(p, 1.0 / 1.4), .p = p};  // isentropic: no trace of entropy stays
  });
  // Sound needs 0.42 to leave; an echo from the ends is inside until 1.3.
  run_to(flow, 0.8);
  double largest = 0.0;
  const auto W = std::as_const(flow).primitives();
  for (int i = 0; i < g.axis[0].n; ++i) {
    if (g.axis[0].x(i) < 0.0 || g.axis[0].x(i) > 1.0) continue;
    largest = std::max(largest, std::abs(W(0, i, 0, 0) * W(4, i, 0, 0) - 1.0));
  }
  return largest / amplitude;
}

/// Every kind of end node: at rest, leaving, entering, faster than sound in both directions.
State at_end(int i, int j, int k) {
  const double a = std::sin(12.9898 * i + 78.233 * j + 37.719 * k);
  const double b = std::sin(39.346 * i + 11.135 * j + 83.155 * k);
  if (a < -0.8) return quiet;
  return {.rho = 1.0 + 0.5 * a, .u = 2.5 * b, .v = 2.5 * a, .w = 2.5 * a * b, .p = 1.0 + 0.9 * b};
}

TEST(OpenEnds, GhostsAreTheCharacteristicState) {
  const int n = 21;  // the last vector of lines is not full
  Flow flow(uniform_grid({n, n, n}, {0, 0, 0}, {1, 1, 1}), all_faces(BoundaryKind::outflow, quiet),
            unit_options());
  flow.set_state_by_index(at_end);
  flow.fill_domain_ghosts();
  const Gas gas = unit_options().gas;
  const auto W = std::as_const(flow).primitives();
  const auto node = [&](int i, int j, int k) {
    return NodeState{W(0, i, j, k), {W(1, i, j, k), W(2, i, j, k), W(3, i, j, k)}, W(4, i, j, k)};
  };
  double worst = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    for (int q = 0; q < 2 * n * n; ++q) {
      const bool low = q < n * n;
      int at[3] = {q % n, q % n, q / n % n};
      at[axis == 0 ? 1 : 0] = q % n;
      at[axis == 2 ? 1 : 2] = q / n % n;
      at[axis] = low ? 0 : n - 1;
      const NodeState wanted = characteristic_state(gas, node(at[0], at[1], at[2]),
                                                    node_state(gas, quiet), axis, low ? -1.0 : 1.0);
      for (int layer = 1; layer <= n_ghost; ++layer) {
        at[axis] = low ? -layer : n - 1 + layer;
        const NodeState got = node(at[0], at[1], at[2]);
        for (int a = 0; a < 3; ++a) worst = std::max(worst, std::abs(got.u[a] - wanted.u[a]));
        worst = std::max({worst, std::abs(got.rho - wanted.rho), std::abs(got.T - wanted.T)});
      }
    }
  }
  std::printf("ghosts of open ends against the scalar formula: %.1e\n", worst);
  EXPECT_LE(worst, 1e-14);  // values of order one and some ten operations
}

TEST(OpenEnds, SendLittleOfAPulseBack) {
  for (const double amplitude : {1e-3, 0.5}) {
    const double bare = residual(amplitude, 0), layer = residual(amplitude, 30);
    std::printf(
        "pulse of %.3g p0: characteristic end %.1e, with 30 cells of 10 %% %.1e of it comes back\n",
        amplitude, bare, layer);
    // Prototype: 1.5e-5 and 3.0e-2 bare, 3e-5 and 2.2e-3 (with an entropy trace) with the layer. An
    // outgoing simple wave keeps the incoming invariant, so that the condition is exact for it; the
    // second-order closure and the constant ghosts behind it remain.
    EXPECT_LT(bare, amplitude < 0.1 ? 1e-3 : 3e-2);
    EXPECT_LT(layer, amplitude < 0.1 ? 1e-3 : 5e-3);
  }
}

/// Pressure at the nodes inside r < 0.5 of a burst (100 times the pressure in r < 0.1).
std::vector<double> burst(double reach, int layer, double end) {
  AxisSpec spec{.min = 0.0, .max = reach, .spacing = 0.005};
  spec.high = {.cells = layer, .ratio = 1.1};
  Grid g;
  g.axis = {make_axis(spec), make_absent_axis(), make_absent_axis()};
  g.geometry = Geometry::spherical;
  Boundaries faces = all_faces(BoundaryKind::outflow, quiet);
  faces[0].kind = BoundaryKind::symmetry;
  Flow flow(g, faces, unit_options());
  flow.set_state([](double r, double, double) {
    return State{.rho = 1.0, .p = 1.0 + 49.5 * (1.0 - std::tanh((r - 0.1) / 0.005))};
  });
  run_to(flow, end);
  std::vector<double> p;
  const auto W = std::as_const(flow).primitives();
  for (int i = 0; i < 100; ++i) p.push_back(W(0, i, 0, 0) * W(4, i, 0, 0));
  return p;
}

TEST(OpenEnds, LetASphericalBlastGo) {
  for (const double end : {0.3, 0.6}) {
    const std::vector<double> whole = burst(1.5, 0, end);
    double error[2] = {};
    for (const int with_layer : {0, 1}) {
      const std::vector<double> cut = burst(0.5, with_layer * 30, end);
      for (std::size_t i = 0; i < cut.size(); ++i) {
        error[with_layer] = std::max(error[with_layer], std::abs(cut[i] - whole[i]));
      }
    }
    std::printf(
        "spherical blast, boundary at 5 burst radii, t = %.1f: largest error of p %.3f "
        "(characteristic), "
        "%.4f (and 30 cells of 10 %%)\n",
        end, error[0], error[1]);
    // Prototype: 0.105 and 0.30 bare, 0.006 and 0.006 with the layer, in units of p0.
    EXPECT_LT(error[1], 0.012);
    EXPECT_LT(error[1], 0.2 * error[0]);
  }
}

}  // namespace
}  // namespace ocublast::flow
