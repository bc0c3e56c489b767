#include "flow_solver/sources/ball_wave.hpp"

#include <cmath>
#include <utility>

#include "flow_solver/grid/make_grid.hpp"
#include "flow_solver/sources/burst.hpp"

namespace ocublast::flow::inline OCU_PRECISION {

BallWave::BallWave(const Gas& gas, const State& ambient, const BallStart& ball, double r_max,
                   const RadialResolution& resolution)
    : SteppedWave(gas, ambient) {
  const double finest = ball.radius / resolution.cells_per_ball;
  const double fine_to = std::min(2.0 * ball.radius, 0.5 * r_max);
  const AxisSpec spec{.min = 0.0,
                      .max = r_max,
                      .spacing = std::max(finest, resolution.growth * r_max),
                      .refined = true,
                      .zone_min = 0.0,
                      .zone_max = fine_to,
                      .zone_spacing = finest,
                      .growth = std::exp(resolution.growth),
                      .low = {},
                      .high = {}};
  Grid grid{{make_axis(spec), make_absent_axis(), make_absent_axis()}, Geometry::spherical};
  FlowOptions options;
  options.gas = gas;
  options.scheme = Scheme::muscl;
  options.active_box = true;
  options.quiescent = ambient;
  Boundaries faces;
  faces.fill({.kind = BoundaryKind::outflow, .state = ambient});
  faces[0].kind = BoundaryKind::symmetry;
  if (resolution.wall_at_end) faces[1].kind = BoundaryKind::symmetry;
  const BurstOnGrid burst =
      make_burst(grid, gas, {.radius = ball.radius, .energy = ball.energy, .mass = ball.mass},
                 ambient.p, ambient.rho);
  flow_ = std::make_unique<Flow>(std::move(grid), faces, options);
  flow_->set_state([&](double, double, double) { return ambient; });
  quiet_ = flow_->totals();
  flow_->set_state_by_index([&](int i, int, int) {
    return mix_burst(ambient, burst, burst.fraction[static_cast<std::size_t>(i)]);
  });
  record(0.0);
}

BallWave::~BallWave() = default;

void BallWave::step() {
  const double dt = flow_->stable_step(), t = time();
  static_cast<void>(flow_->advance(t, dt));
  record(t + dt);
}

void BallWave::record(double t) {
  Snapshot s{.t = t, .r = {}, .state = {}};
  const Axis& axis = flow_->grid().axis[0];
  const auto W = std::as_const(*flow_).primitives();
  const double cv_part = 1.0 / (gas().heat_capacity_ratio - 1.0);
  s.r.reserve(static_cast<std::size_t>(axis.n));
  s.state.reserve(static_cast<std::size_t>(axis.n));
  for (int i = 0; i < axis.n; ++i) {
    const double p = pressure(gas(), W(prim_rho, i, 0, 0), W(prim_T, i, 0, 0));
    s.r.push_back(axis.x(i));
    s.state.push_back({W(prim_rho, i, 0, 0), W(prim_u, i, 0, 0), p, p * cv_part});
  }
  keep(std::move(s));
}

RadialTotals BallWave::totals() const {
  const Totals now = flow_->totals();
  return {now.mass - quiet_.mass, now.energy - quiet_.energy};
}

}  // namespace ocublast::flow
