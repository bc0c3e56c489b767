#pragma once

#include <array>

#include "flow_solver/grid/make_grid.hpp"
#include "flow_solver/step.hpp"

namespace ocublast::flow::inline OCU_PRECISION {

/// Boundaries of one kind everywhere.
inline Boundaries all_faces(BoundaryKind kind, const State& state = {}) {
  Boundaries b;
  b.fill({.kind = kind, .state = state});
  return b;
}

/// Options for problems in units where R = 1.
inline FlowOptions unit_options() {
  FlowOptions o;
  o.gas.gas_constant = 1.0;
  return o;
}

inline Grid uniform_grid(std::array<int, 3> n, std::array<double, 3> min, std::array<double, 3> max,
                         bool periodic = false) {
  Grid g;
  for (std::size_t a = 0; a < 3; ++a) {
    g.axis[a] = n[a] > 1 ? make_uniform_axis(min[a], max[a], n[a], periodic) : make_absent_axis();
  }
  return g;
}

struct RunSummary {
  int steps = 0;
  int redone = 0;
  std::size_t marked = 0;
};

/// Advances to `end` with stable steps times `factor`.
inline RunSummary run_to(Flow& flow, double end, double factor = 1.0) {
  RunSummary s;
  double t = 0.0;
  while (t < end * (1.0 - 1e-12)) {
    const double dt = std::min(factor * flow.stable_step(), end - t);
    const StepReport r = flow.advance(t, dt);
    t += dt;
    ++s.steps;
    s.redone += r.redone;
    s.marked += r.marked_nodes;
  }
  return s;
}

}  // namespace ocublast::flow
