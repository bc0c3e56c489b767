// Compiled twice, once with OCU_SINGLE.

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "tests/verification/flow_precision.hpp"
#include "tests/verification/flow_problems.hpp"
#include "tests/verification/flow_reflection.hpp"

namespace ocublast::flow::inline OCU_PRECISION {
namespace {

using testing::BlastFigures;
using testing::Conservation;
using testing::Rest;
using testing::WallFigures;

Grid stretched_grid() {
  Grid g;
  const double spacing[3] = {0.05, 0.06, 0.07};
  for (std::size_t a = 0; a < 3; ++a) {
    g.axis[a] = make_axis({.min = 0.0,
                           .max = 1.0,
                           .spacing = spacing[a],
                           .refined = true,
                           .zone_min = 0.4,
                           .zone_max = 0.5,
                           .zone_spacing = 0.03,
                           .growth = 1.12,
                           .high = {.cells = 5, .ratio = 1.15}});
  }
  return g;
}

double sod_error(int n) {
  return sod(n, 0, 0.9, 0.4).error;
}
double vortex_error(int n) {
  return vortex(n, unit_options());
}

BlastFigures blast_figures(int n) {
  const BurstProblem burst{.radius = 0.2, .density = 1.0, .pressure = 20.0, .end = 0.25};
  const Reference reference(burst, 600);
  const BlastResult r = blast(burst, reference, n);
  return {r.error, r.peak, r.run.steps};
}

WallFigures reflection(double mach, double offset) {
  const Reflection r = reflect(mach, 0.6 + offset / 200, 0.5 / 200, 0);
  return {r.plateau_error, r.leak};
}

double free_stream() {
  const State free{.rho = 1.2, .u = 0.3, .v = -0.4, .w = 0.5, .p = 1.1};
  FlowOptions o = unit_options();
  o.quiescent = free;
  Flow flow(stretched_grid(), all_faces(BoundaryKind::outflow, free), o);
  flow.set_state([&](double, double, double) { return free; });
  for (int s = 0; s < 100; ++s) flow.advance(0.0, flow.stable_step());
  double largest = 0.0;
  const auto W = flow.primitives();
  const Grid& g = flow.grid();
  for (int k = 0; k < g.axis[2].n; ++k) {
    for (int j = 0; j < g.axis[1].n; ++j) {
      for (int i = 0; i < g.axis[0].n; ++i) {
        largest = std::max({largest, std::abs(W(0, i, j, k) / free.rho - 1.0),
                            std::abs(W(1, i, j, k) - free.u), std::abs(W(2, i, j, k) - free.v),
                            std::abs(W(3, i, j, k) - free.w)});
      }
    }
  }
  return largest;
}

Rest rest(int steps) {
  FlowOptions o;
  o.gas.gas_constant = 287.05;
  const State air{.rho = 1.2041, .p = 101325.0};
  o.quiescent = air;
  Boundaries faces = all_faces(BoundaryKind::symmetry);
  faces[1] = faces[3] = {.kind = BoundaryKind::outflow, .state = air};
  faces[5].kind = BoundaryKind::wall;
  Flow flow(stretched_grid(), faces, o);
  flow.set_state([&](double, double, double) { return air; });
  for (int s = 0; s < steps; ++s) flow.advance(0.0, flow.stable_step());
  const double T = air.p / (air.rho * o.gas.gas_constant);
  Rest out;
  const auto W = flow.primitives();
  const Grid& g = flow.grid();
  for (int k = 0; k < g.axis[2].n; ++k) {
    for (int j = 0; j < g.axis[1].n; ++j) {
      for (int i = 0; i < g.axis[0].n; ++i) {
        for (int a = 1; a < 4; ++a)
          out.velocity = std::max<double>(out.velocity, std::abs(W(a, i, j, k)));
        out.density = std::max(out.density, std::abs(W(0, i, j, k) / air.rho - 1.0));
        out.temperature = std::max(out.temperature, std::abs(W(4, i, j, k) / T - 1.0));
      }
    }
  }
  return out;
}

Conservation closed_box() {
  Flow flow(stretched_grid(), all_faces(BoundaryKind::symmetry), unit_options());
  flow.set_state([](double x, double y, double z) {
    const double r2 = (x - 0.4) * (x - 0.4) + (y - 0.45) * (y - 0.45) + (z - 0.5) * (z - 0.5);
    return State{.rho = 1.0, .p = r2 < 0.04 ? 200.0 : 1.0};
  });
  const Totals before = flow.totals();
  Conservation out;
  for (int s = 0; s < 100; ++s) out.marked += flow.advance(0.0, flow.stable_step()).marked_nodes;
  const Totals after = flow.totals();
  out.mass = after.mass / before.mass - 1.0;
  out.energy = after.energy / before.energy - 1.0;
  return out;
}

std::vector<double> pulse(double amplitude) {
  constexpr int n = 400;
  FlowOptions o;
  o.gas.gas_constant = 287.05;
  const State air{.rho = 1.2041, .p = 101325.0};
  o.quiescent = air;
  const double c = std::sqrt(1.4 * air.p / air.rho);
  Flow flow(uniform_grid({n, 1, 1}, {0, 0, 0}, {1, 1, 1}), all_faces(BoundaryKind::outflow, air),
            o);
  flow.set_state([&](double x, double, double) {
    const double f = amplitude * std::exp(-std::pow((x - 0.3) / 0.03, 2));
    return State{.rho = air.rho * (1.0 + f / 1.4), .u = f * c / 1.4, .p = air.p * (1.0 + f)};
  });
  run_to(flow, 150.0 / n / c);
  std::vector<double> p;
  const auto W = flow.primitives();
  for (int i = 0; i < n; ++i)
    p.push_back(static_cast<double>(W(0, i, 0, 0)) * o.gas.gas_constant * W(4, i, 0, 0) - air.p);
  return p;
}

double active_tolerance(double asked) {
  FlowOptions o = unit_options();
  o.active_tolerance = asked;
  return Flow(uniform_grid({16, 1, 1}, {0, 0, 0}, {1, 1, 1}), all_faces(BoundaryKind::outflow), o)
      .options()
      .active_tolerance;
}

constexpr testing::PrecisionRun table{sod_error,  vortex_error, blast_figures,
                                      reflection, free_stream,  rest,
                                      closed_box, pulse,        active_tolerance};

}  // namespace
}  // namespace ocublast::flow

namespace ocublast::flow::testing {
#ifdef OCU_SINGLE
const PrecisionRun& in_single_precision() {
  return single_precision::table;
}
#else
const PrecisionRun& in_double_precision() {
  return double_precision::table;
}
#endif
}  // namespace ocublast::flow::testing
