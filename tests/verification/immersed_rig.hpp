#pragma once

// What the tests of bodies in the flow share. Units: p0 = rho0 = 1 and a gas constant of 1, so that
// temperatures and pressures are of order one.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <vector>

#include "flow_solver/immersed/immersed_boundary.hpp"
#include "flow_solver/step.hpp"
#include "tests/unit/immersed_shapes.hpp"

namespace ocublast::flow::testing {

inline constexpr double g = 1.4;

inline FlowOptions unit_gas_options() {
  FlowOptions options;
  options.gas = {.heat_capacity_ratio = g, .gas_constant = 1.0};
  return options;
}

/// State behind a shock of Mach number `Ms` running into gas at rest with p = rho = 1.
inline flow::State behind_shock(double Ms) {
  const double p = 1.0 + 2.0 * g / (g + 1.0) * (Ms * Ms - 1.0);
  const double rho = (g + 1.0) * Ms * Ms / ((g - 1.0) * Ms * Ms + 2.0);
  return {.rho = rho, .u = Ms * std::sqrt(g) * (1.0 - 1.0 / rho), .p = p};
}

/// Pressure behind the shock reflected at a rigid wall, with the incident pressure p (p1 = 1).
inline double reflected_pressure(double p) {
  return p * ((3.0 * g - 1.0) * p - (g - 1.0)) / ((g - 1.0) * p + (g + 1.0));
}

/// Speed at which that shock runs back, from the balance of mass.
inline double reflected_speed(const flow::State& behind) {
  const double p5 = reflected_pressure(behind.p);
  const double rho5 =
      behind.rho * ((g + 1) * p5 + (g - 1) * behind.p) / ((g - 1) * p5 + (g + 1) * behind.p);
  return behind.u * behind.rho / (rho5 - behind.rho);
}

/// The two states of a planar shock at distance s in front of it, spread by a tanh of half a cell:
/// a jump between two nodes would start with a second-order shift of the shock.
inline flow::State shock_state(double s, double h, const flow::State& behind) {
  const double share = .5 * (1.0 - std::tanh(s / (.5 * h)));
  return {.rho = 1.0 + share * (behind.rho - 1.0),
          .u = share * behind.u,
          .v = share * behind.v,
          .w = share * behind.w,
          .p = 1.0 + share * (behind.p - 1.0)};
}

inline Boundaries walls_all_round() {
  Boundaries b;
  for (Boundary& face : b) face.kind = BoundaryKind::symmetry;
  return b;
}

/// Gas at rest into which a shock runs from x0 along x, walls all round but for the inflow.
inline Flow shock_into_rest(const Grid& grid, const flow::State& behind, double x0, double h,
                            const FlowOptions& options = unit_gas_options()) {
  Boundaries boundaries = walls_all_round();
  boundaries[0] = {.kind = BoundaryKind::fixed_state, .state = behind};
  Flow flow(grid, boundaries, options);
  flow.set_state([&](double x, double, double) { return shock_state(x - x0, h, behind); });
  return flow;
}

inline double pressure_at(const Flow& flow, int i, int j = 0, int k = 0) {
  const FieldsView<const Real> W = flow.primitives();
  return pressure(flow.options().gas, W(prim_rho, i, j, k), W(prim_T, i, j, k));
}

/// What a run had to do beside stepping.
struct RunCounts {
  double t = 0.0;
  int steps = 0;
  int redone = 0;
  std::size_t fresh = 0;
  std::size_t marked = 0;
};

/// Steps to time t_end; `before(t, dt)` sets paths and may shorten the step, `after(t)` measures.
template <class Before, class After>
RunCounts run(Flow& flow, ImmersedBoundary& bodies, double t_end, const Before& before,
              const After& after) {
  RunCounts counts;
  while (counts.t < t_end * (1.0 - 1e-12)) {
    double dt = std::min({flow.stable_step(), bodies.wall_step_limit(), t_end - counts.t});
    before(counts.t, dt);
    const StepReport report = flow.advance(counts.t, dt);
    counts.t += dt;
    ++counts.steps;
    counts.redone += report.redone;
    counts.fresh += report.topology.fresh_nodes;
    counts.marked += report.marked_nodes;
    after(counts.t);
  }
  return counts;
}
inline void nothing_before(double, double&) {}
inline void nothing_after(double) {}

/// Tags, cut lines and the start of the flow with its bodies.
inline void immerse(Flow& flow, ImmersedBoundary& bodies) {
  bodies.update_topology(flow.primitives());
  flow.immerse(&bodies);
}

/// Path of a rigid translation by `shift(t)` with velocity `rate(t)`, over one step.
inline void translate(ImmersedBoundary& bodies, std::size_t b, double t, double dt, const P3& shift,
                      const P3& rate) {
  const std::vector<double>& rest = bodies.body(b).surface.vertices;
  std::vector<double> x(rest.size()), v(rest.size());
  for (std::size_t n = 0; n < x.size(); ++n) {
    x[n] = rest[n] + shift[n % 3];
    v[n] = rate[n % 3];
  }
  bodies.set_path(b, t, t + dt, x, v);
}

/// Deviation of a series from the parabola through 15 samples (least squares at the middle one).
struct Noise {
  double rms = 0.0;
  double largest = 0.0;
};
inline Noise noise_of(const std::vector<double>& series) {
  Noise noise;
  int count = 0;
  for (std::size_t m = 7; m + 7 < series.size(); ++m) {
    double s0 = 0, s2 = 0, s4 = 0, f0 = 0, f2 = 0;
    for (int q = -7; q <= 7; ++q) {
      s0 += 1;
      s2 += q * q;
      s4 += q * q * q * q;
      f0 += series[m + q];
      f2 += q * q * series[m + q];
    }
    const double off = series[m] - (s4 * f0 - s2 * f2) / (s0 * s4 - s2 * s2);
    noise.rms += off * off;
    noise.largest = std::max(noise.largest, std::abs(off));
    ++count;
  }
  noise.rms = count > 0 ? std::sqrt(noise.rms / count) : 0.0;
  return noise;
}

inline double mean_of(const std::vector<double>& series) {
  double sum = 0.0;
  for (const double x : series) sum += x;
  return series.empty() ? 0.0 : sum / static_cast<double>(series.size());
}

}  // namespace ocublast::flow::testing
