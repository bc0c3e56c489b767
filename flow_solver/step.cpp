// One step: artificial diffusivity once, then four Runge-Kutta stages (stages.cpp); positivity
// failures mark nodes and start the step again from the kept q^n.

#include "flow_solver/step.hpp"

#include <fmt/format.h>
#include <omp.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <utility>
#include <vector>

#include "coupler/base/errors.hpp"
#include "flow_solver/boundary/domain_ghosts.hpp"
#include "flow_solver/flow_core.hpp"

namespace ocublast::flow::inline OCU_PRECISION {
namespace {

// A step that needs more tries than this will not be cured by more marks: each adds a layer.
constexpr int most_tries = 24;
// From this try on the neighbours of failed nodes are marked too, and the test grows lenient.
constexpr int widen_after = 3;
constexpr int lenient_after = 6;
constexpr double strict_drop = 0.05;
constexpr double lenient_drop = 1e-3;
// nu* <= cap h^2 / dt_convective; looser for fresh charges, where a tight one trades limited steps
// for redone ones.
constexpr double nu_cap = 0.3;
constexpr double nu_cap_fresh = 1.0;
// Classical RK4 is stable to 2.83 on the imaginary axis (compact 6, largest modified
// wavenumber 1.99: Courant number 1.42, compact 8: 1.32) and to 2.78 on the negative real axis; its
// region holds the ellipse through both, which bounds the step where convection and diffusion act
// together.
constexpr double convection_limit = 1.32;
constexpr double diffusion_limit = 2.6;

/// Courant numbers at which the whole filter is applied once per step.
const double default_cfl = FlowOptions{}.cfl, default_cfl_direction = FlowOptions{}.cfl_direction;

/// Nodes of a plane of which some twenty fields stay in the second cache (2^12 x 20 x 8 B = 0.7
/// MB).
constexpr int cached_nodes = 4096 * 8 / static_cast<int>(sizeof(Real));

/// Momentum fluxes leave out the pressure at rest where no node has less than this part of it:
/// below, the difference would cost the node digits.
constexpr double most_rest_pressure = 16.0;

}  // namespace

DomainGhosts Flow::Core::domain_ghosts() const {
  const NodeBox part{{lo[0], lo[1], lo[2]}, {hi[0], hi[1], hi[2]}};
  return {grid, boundaries, options.gas, now, part, ctx.W, *kernels};
}

void Flow::Core::fill_ghosts() {
  if (ranks) {
    fill_ghosts_on_ranks([] {});
  } else {
    domain_ghosts().fill_all(options.threads);
    ghosts_filled = true;
  }
}

void Flow::Core::fill_scalars(const Block& block, std::span<const int> fields, ScalarGhosts use) {
  const NodeBox part{{lo[0], lo[1], lo[2]}, {hi[0], hi[1], hi[2]}};
  for (int axis = 0; axis < 3; ++axis) {
    for (const int field : fields)
      fill_scalar_ghosts(grid, boundaries, part, block, field, axis, options.threads);
    if (!ranks) continue;
    auto& halos = use == ScalarGhosts::differences
                      ? ranks->theta
                      : (use == ScalarGhosts::average ? ranks->sensors : ranks->kappa);
    Halo& halo = halos[static_cast<std::size_t>(axis)];
    halo.start(block);
    wait_for([&] { halo.wait(); });
    halo.finish(block);
  }
}

void Flow::Core::set_time(double t) {
  if (t == now) return;
  now = t;
  const auto varies = [](const Boundary& b) { return b.incoming != nullptr; };
  if (std::any_of(boundaries.begin(), boundaries.end(), varies)) prepared = ghosts_filled = false;
}

double Flow::Core::convective_step(double cfl, double cfl_direction) const {
  // First-order fluxes, which fresh charges need, and limited ones keep pressures positive up to a
  // Courant number of 1 on the sum over directions.
  if (fresh_charge() || muscl != nullptr) cfl = std::min(cfl, cfl_direction);
  return std::min(cfl / convection, cfl_direction / fastest);
}

bool Flow::Core::fresh_charge() const {
  return p_max > fresh_ratio * p_min;
}

double Flow::Core::rest_pressure() const {
  if (!is_single || radial.power > 0)
    return 0.0;  // a radius takes the pressure as a plain gradient
  const State& s = options.quiescent;
  const double gas_constant = options.gas.gas_constant;
  const Real p = static_cast<Real>(s.rho) * static_cast<Real>(gas_constant) *
                 static_cast<Real>(s.p / (s.rho * gas_constant));
  return p < most_rest_pressure * p_min ? p : 0.0;
}

int Flow::Core::rows_per_block() const {
  return std::max(tile_width, cached_nodes / box.n[0] / tile_width * tile_width);
}

template <class Body>
void Flow::Core::for_row_blocks(const Body& body) {
  const int rows = rows_per_block();
#pragma omp parallel num_threads(options.threads)
  {
    Real* own = scratch[static_cast<std::size_t>(omp_get_thread_num())].data();
    for (int j0 = 0; j0 < box.n[1]; j0 += rows) {
#pragma omp for schedule(static) nowait
      for (int k = 0; k < box.n[2]; ++k) body(own, k, j0, std::min(box.n[1], j0 + rows));
    }
  }
}

void Flow::Core::prepare() {
  const int threads = options.threads;
  Lap lap(clock);
  if (options.active_box) grow_box();
  refresh_box();
  const int n2 = box.n[2];
  maxima.assign(static_cast<std::size_t>(n2), {});
  if (!ghosts_filled) fill_ghosts();
  if (bodies) {
    bodies->compute_ghosts(view_of(ctx.W, ctx.bulk));
    if (ranks)
      fill_ghosts();  // other ranks read the band; no stencil reads the domain ghosts beside it
  }
  refresh_box();
  lap.book(Pass::ghosts);
#pragma omp parallel for schedule(static) num_threads(threads)
  for (int k = 0; k < n2; ++k) {
    kernels->theta_plane(box, k, maxima[static_cast<std::size_t>(k)]);
    correct_dilatation(k + lo[2]);
    if (radial.power > 0) radial_kernels->add_dilatation(box, k);
  }
  convection = fastest = 0.0;
  p_max = 0.0;
  p_min = 1e300;
  for (const PlaneMaxima& m : maxima) {
    convection = std::max(convection, m.convection);
    fastest = std::max(fastest, m.fastest);
    p_max = std::max(p_max, m.p_max);
    p_min = std::min(p_min, m.p_min);
  }
  const double at_axis = convection_at_axis();
  convection = std::max(convection, at_axis);
  fastest = std::max(fastest, at_axis);
  share_maxima();
  ctx.rest_pressure = box.rest_pressure = rest_pressure();
  diffusion = 0.0;
  ctx.cap = (fresh_charge() ? nu_cap_fresh : nu_cap) /
            convective_step(options.cfl, options.cfl_direction);
  box.cap = ctx.cap;
  if (options.artificial_diffusivity || ctx.nodal_stress) {
    const auto fields = [&](std::initializer_list<int> always, int strain) {
      std::vector<int> list = always;
      if (ctx.need_strain) list.push_back(strain);
      return list;
    };
    fill_scalars(ctx.R, fields({0}, 3), ScalarGhosts::differences);
    // The nine planes of the average pass through the cache several times: by rows that fit.
    for_row_blocks([&](Real*, int k, int j0, int j1) { kernels->sensor_rows(box, k, j0, j1); });
    fill_scalars(ctx.R, fields({1, 2}, 4), ScalarGhosts::average);
    for_row_blocks([&](Real* own, int k, int j0, int j1) {
      kernels->diffusivity_rows(box, own, k, j0, j1, maxima[static_cast<std::size_t>(k)]);
    });
    for (const PlaneMaxima& m : maxima) diffusion = std::max(diffusion, m.diffusion);
    if (ranks) wait_for([&] { diffusion = ranks->ranks().max_of_all(diffusion); });
    fill_scalars(ctx.W, std::array{static_cast<int>(field_kappa)}, ScalarGhosts::faces);
    if (ctx.nodal_stress) {
      // No other rank's mu is read: the fluxes at the borders are known.
      const NodeBox part{{lo[0], lo[1], lo[2]}, {hi[0], hi[1], hi[2]}};
      for (int axis = 0; axis < 3; ++axis)
        fill_scalar_ghosts(grid, boundaries, part, ctx.W, field_mu, axis, threads);
    }
  }
  lap.book(Pass::sensors);
  prepared = true;
}

void Flow::set_time(double t) {
  core_->set_time(t);
}

double Flow::stable_step() {
  Core& c = *core_;
  if (!c.prepared) c.prepare();
  const double wave = c.convection / convection_limit, decay = c.diffusion / diffusion_limit;
  return std::min(c.convective_step(c.options.cfl, c.options.cfl_direction),
                  1.0 / std::sqrt(wave * wave + decay * decay));
}

void Flow::roll_back(double t) {
  Core& c = *core_;
  c.restore();
  c.mark = c.kept_mark;
  std::fill(c.failed.begin(), c.failed.end(), std::uint8_t{0});
  c.ctx.any_mark = true;
  c.set_line_marks();
  c.now = t;
  c.prepared = false;
}

StepReport Flow::advance(double t, double dt) {
  Core& c = *core_;
  c.set_time(t);
  if (c.bodies) c.bodies->move_to(t);
  if (!c.prepared) c.prepare();
  StepReport report;
  report.dt = dt;
  report.largest_pressure = c.p_max;
  report.smallest_pressure = c.p_min;
  Lap lap(c.clock);
  c.kept_mark = c.mark;
  c.age_marks();
  if (c.muscl == nullptr)
    c.premark(report);  // limited slopes need no warning
  else if (c.ctx.any_mark)
    c.set_line_marks();
  lap.book(Pass::other);
  const bool floors = c.options.floor_density > 0.0 && c.options.floor_pressure > 0.0;
  c.ctx.drop_limit = strict_drop;
  c.ctx.filter_strength =
      c.options.filter_per_time
          ? std::min(1.0, dt / c.convective_step(default_cfl, default_cfl_direction))
          : 1.0;
  while (!c.run_stages(t, dt, floors && report.redone == most_tries, report)) {
    if (report.redone == most_tries) c.throw_failure(t, dt);
    ++report.redone;
    if (report.redone >= lenient_after) c.ctx.drop_limit = lenient_drop;
    c.mark_failures(report.redone >= widen_after);
    c.restore();
  }
  report.marked_nodes = c.count_marks();
  if (c.ranks && c.ctx.any_mark) {  // the same on all ranks; nothing is floored without marks
    double counts[2] = {static_cast<double>(report.marked_nodes),
                        static_cast<double>(report.floored_nodes)};
    c.ranks->ranks().sum_of_all(counts);
    report.marked_nodes = static_cast<std::size_t>(counts[0]);
    report.floored_nodes = static_cast<std::size_t>(counts[1]);
  }
  report.active_share = static_cast<double>(c.box.n[0]) * c.box.n[1] * c.box.n[2] /
                        static_cast<double>(c.grid.n_cells());
  std::swap(c.Q, c.A);
  c.ctx.Q = c.Q.block();
  c.ctx.A = c.A.block();
  c.prepared = false;
  c.now = t + dt;
  if (c.bodies) {
    c.bodies->move_to(c.now);
    c.fill_ghosts();
    report.topology = c.bodies->update_topology(c.view_of(c.ctx.W, c.ctx.bulk));
    if (report.topology.renewed) {
      c.take_topology(true);
      c.ghosts_filled =
          c.ghosts_filled && report.topology.fresh_nodes + report.topology.rebuilt_nodes == 0;
    }
  }
  return report;
}

}  // namespace ocublast::flow
