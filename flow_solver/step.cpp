// One step: artificial diffusivity once, then four Runge-Kutta stages of line solves, the filter in
// the last; positivity failures mark nodes and start the step again from the kept q^n.

#include "flow_solver/step.hpp"

#include <omp.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <utility>
#include <vector>

#include <fmt/format.h>

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
// Classical RK4 is stable to 2.83 on the imaginary axis (compact 6, largest modified wavenumber 1.99:
// Courant number 1.42, compact 8: 1.32) and to 2.78 on the negative real axis; its region holds the
// ellipse through both, which bounds the step where convection and diffusion act together.
constexpr double convection_limit = 1.32;
constexpr double diffusion_limit = 2.6;

/// Courant numbers at which the whole filter is applied once per step.
const double default_cfl = FlowOptions{}.cfl, default_cfl_direction = FlowOptions{}.cfl_direction;

/// Nodes of a plane of which some twenty fields stay in the second cache (2^12 x 20 x 8 B = 0.7 MB).
constexpr int cached_nodes = 4096 * 8 / static_cast<int>(sizeof(Real));

/// Momentum fluxes leave out the pressure at rest where no node has less than this part of it: below, the
/// difference would cost the node digits.
constexpr double most_rest_pressure = 16.0;

constexpr double stage_time[4] = {0.0, 0.5, 0.5, 1.0};

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
    for (const int field : fields) fill_scalar_ghosts(grid, boundaries, part, block, field, axis, options.threads);
    if (!ranks) continue;
    auto& halos = use == ScalarGhosts::differences ? ranks->theta
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

bool Flow::Core::fresh_charge() const { return p_max > fresh_ratio * p_min; }

double Flow::Core::rest_pressure() const {
  if (!is_single || radial.power > 0) return 0.0;  // a radius takes the pressure as a plain gradient
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
    if (ranks) fill_ghosts();  // other ranks read the band; no stencil reads the domain ghosts beside it
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
  ctx.cap = (fresh_charge() ? nu_cap_fresh : nu_cap) / convective_step(options.cfl, options.cfl_direction);
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
      for (int axis = 0; axis < 3; ++axis) fill_scalar_ghosts(grid, boundaries, part, ctx.W, field_mu, axis, threads);
    }
  }
  lap.book(Pass::sensors);
  prepared = true;
}

void Flow::set_time(double t) { core_->set_time(t); }

double Flow::stable_step() {
  Core& c = *core_;
  if (!c.prepared) c.prepare();
  const double wave = c.convection / convection_limit, decay = c.diffusion / diffusion_limit;
  return std::min(c.convective_step(c.options.cfl, c.options.cfl_direction),
                  1.0 / std::sqrt(wave * wave + decay * decay));
}

void Flow::Core::compute_stress() {
  const int n1 = box.n[1], n2 = box.n[2], rows = rows_per_block();
#pragma omp parallel num_threads(options.threads)
  {
    Lap lap(clock);
    for (int j0 = 0; j0 < n1; j0 += rows) {
#pragma omp for schedule(static) nowait
      for (int k = -1; k < n2 + 1; ++k) kernels->stress_rows(box, k, j0, std::min(n1, j0 + rows));
    }
    // Every thread closes the planes whose rows it computed.
#pragma omp for schedule(static)
    for (int k = -1; k < n2 + 1; ++k) kernels->stress_ends_y(box, k);
#pragma omp for schedule(static)
    for (int j = 0; j < n1; ++j) kernels->stress_ends_z(box, j);
    lap.book(Pass::stress);
  }
}

void Flow::Core::sweep_planes() {
  if (box.nodal_stress && !ranks) compute_stress();
  const auto sweep_x = stage_kernels().sweep_x;
  const int n1 = box.n[1], n2 = box.n[2];
  const DomainGhosts ghosts = domain_ghosts();
  const bool fill_here = ghosts_with_planes() && !ghosts_filled;
  // The radius adds its part to the dilatation of the whole plane.
  const bool whole_bulk = ctx.bulk && radial.power > 0;
  // Border fluxes across z are on their way meanwhile.
  BorderSums* const z_sums = ranks ? ranks->flux[2].get() : nullptr;
#pragma omp parallel num_threads(options.threads)
  {
    const auto thread = static_cast<std::size_t>(omp_get_thread_num());
    Real* own = scratch[thread].data();
    Lap lap(clock);
    Context plane = box;
    if (box.present[1]) {
      // The x part of the divergence of one plane stays in the cache until the y part joins it.
      plane.X = plane_scratch[thread].block();
      plane.X.sk = 0;
    }
#pragma omp for schedule(runtime) nowait
    for (int k = 0; k < n2; ++k) {
      if (z_sums != nullptr && thread == 0) z_sums->poll();
      const auto run = [&](int axis) {
        const SegmentBatches& s = segments[static_cast<std::size_t>(axis)];
        if (s.begin.empty()) return;
        const auto c = static_cast<std::size_t>(k);
        for (std::size_t b = s.begin[c]; b < s.begin[c + 1]; ++b) {
          kernels->sweep_segments(plane, own, axis, s.batch[b]);
        }
      };
      if (whole_bulk) {
        if (fill_here) {
          ghosts.fill_x(k + lo[2], lo[1], hi[1]);
          for (const bool low : {true, false}) ghosts.fill_y(k + lo[2], low);
        }
        kernels->bulk_rows(plane, k, 0, n1);
        radial_kernels->add_bulk(plane, k);
        lap.book(Pass::bulk);
      }
      for (int g = 0; g < box.row_groups; ++g) {
        const int j0 = g * tile_width, j1 = std::min(n1, j0 + tile_width);
        if (fill_here && !whole_bulk) {
          ghosts.fill_x(k + lo[2], lo[1] + j0, lo[1] + j1);
          if (g == 0) ghosts.fill_y(k + lo[2], true);
          if (g + 1 == box.row_groups) ghosts.fill_y(k + lo[2], false);
          lap.book(Pass::ghosts);
        }
        if (ctx.bulk && !whole_bulk && !bulk_is_ready) {
          kernels->bulk_rows(plane, k, j0, j1);
          correct_bulk(k + lo[2], lo[1] + j0, lo[1] + j1);
          lap.book(Pass::bulk);
        }
        sweep_x(plane, own, k, g, g + 1);
        lap.book(Pass::sweep_x);
      }
      run(0);
      lap.book(Pass::sweep_x);
      if (box.present[1]) {
        if (ctx.bulk && !bulk_is_ready) kernels->bulk_ghost_rows(plane, k);
        kernels->sweep_y(plane, own, k, 0, box.tiles);
        run(1);
        lap.book(Pass::sweep_y);
      }
    }
  }
}

/// The same where there is only one plane: threads share its lines.
void Flow::Core::sweep_one_plane() {
  if (ctx.bulk) {
    kernels->bulk_rows(box, 0, 0, box.n[1]);
    correct_bulk(0, 0, ctx.n[1]);
    if (radial.power > 0) radial_kernels->add_bulk(box, 0);
    kernels->bulk_ghost_rows(box, 0);
  }
  if (box.nodal_stress) {
    kernels->stress_rows(box, 0, 0, box.n[1]);
    kernels->stress_ends_y(box, 0);
  }
  sweep_lines_of_plane();
}

void Flow::Core::sweep_lines_of_plane() {
  const StageKernels sweeps = stage_kernels();
#pragma omp parallel num_threads(options.threads)
  {
    Real* own = scratch[static_cast<std::size_t>(omp_get_thread_num())].data();
#pragma omp for schedule(static)
    for (int g = 0; g < box.row_groups; ++g) sweeps.sweep_x(box, own, 0, g, g + 1);
    for (int axis = 0; axis < 2; ++axis) {
      const auto& batch = segments[static_cast<std::size_t>(axis)].batch;
      if (axis == 1 && box.present[1]) {
#pragma omp for schedule(static)
        for (int t = 0; t < box.tiles; ++t) sweeps.sweep_y(box, own, 0, t, t + 1);
      }
#pragma omp for schedule(static)
      for (std::size_t b = 0; b < batch.size(); ++b) sweeps.sweep_segments(box, own, axis, batch[b]);
    }
  }
}

long Flow::Core::update_rows() {
  const StageKernels sweeps = stage_kernels();
  long failures = 0;
  const SegmentBatches& s = segments[2];
#pragma omp parallel for schedule(runtime) num_threads(options.threads) reduction(+ : failures)
  for (int j = 0; j < box.n[1]; ++j) {
    Real* own = scratch[static_cast<std::size_t>(omp_get_thread_num())].data();
    if (!s.begin.empty()) {
      const auto c = static_cast<std::size_t>(j);
      for (std::size_t b = s.begin[c]; b < s.begin[c + 1]; ++b) {
        sweeps.sweep_segments(box, own, 2, s.batch[b]);
      }
    }
    failures += sweeps.update_row(box, own, j);
  }
  return failures;
}

/// Filter along x and y of one plane, then its primitives while it is in the cache.
long Flow::Core::filter_plane(Real* own, int k) {
  const auto run = [&](int axis) {
    const SegmentBatches& s = segments[static_cast<std::size_t>(axis)];
    if (s.begin.empty()) return;
    const auto c = static_cast<std::size_t>(k);
    for (std::size_t b = s.begin[c]; b < s.begin[c + 1]; ++b) kernels->filter_segments(box, own, axis, s.batch[b]);
  };
  kernels->filter_x(box, own, k, 0, box.row_groups);
  run(0);
  if (box.present[1]) {
    kernels->filter_y(box, own, k, 0, box.tiles);
    run(1);
  }
  return kernels->finish_plane(box, k);
}

/// The filter where there is only one plane: threads share its lines.
void Flow::Core::filter_one_plane() {
#pragma omp parallel num_threads(options.threads)
  {
    Real* own = scratch[static_cast<std::size_t>(omp_get_thread_num())].data();
#pragma omp for schedule(static)
    for (int g = 0; g < box.row_groups; ++g) kernels->filter_x(box, own, 0, g, g + 1);
    for (int axis = 0; axis < 2; ++axis) {
      const auto& batch = segments[static_cast<std::size_t>(axis)].batch;
      if (axis == 1 && box.present[1]) {
#pragma omp for schedule(static)
        for (int t = 0; t < box.tiles; ++t) kernels->filter_y(box, own, 0, t, t + 1);
      }
#pragma omp for schedule(static)
      for (std::size_t b = 0; b < batch.size(); ++b) kernels->filter_segments(box, own, axis, batch[b]);
    }
  }
}

/// Filter along x and y (z was filtered with the update), then primitives.
long Flow::Core::finish_planes() {
  if (ranks) return finish_on_ranks();
  const int n2 = box.n[2];
  const auto& z = segments[2].batch;
  long failures = 0;
#pragma omp parallel num_threads(options.threads) reduction(+ : failures) if (n2 > 1)
  {
    Real* own = scratch[static_cast<std::size_t>(omp_get_thread_num())].data();
    if (box.filter) {
#pragma omp for schedule(static)
      for (std::size_t b = 0; b < z.size(); ++b) kernels->filter_segments(box, own, 2, z[b]);
    }
    if (n2 > 1) {
#pragma omp for schedule(runtime)
      for (int k = 0; k < n2; ++k) failures += box.filter ? filter_plane(own, k) : kernels->finish_plane(box, k);
    }
  }
  if (n2 > 1) return failures;
  if (box.filter) filter_one_plane();
  return kernels->finish_plane(box, 0);
}

long Flow::Core::run_stage() {
  if (ranks) return run_stage_on_ranks();
  if (box.n[2] > 1) sweep_planes();
  else sweep_one_plane();
  Lap lap(clock);
  const long failures = update_rows();
  lap.book(Pass::sweep_z);
  return failures;
}

/// Threads keep their planes and rows, which stay in their memory; where bodies make some of these dearer
/// than others the threads take a few at a time as they become free.
void Flow::Core::share_work_among_threads() const {
  constexpr int turns = 8;
  const int few = std::max(1, std::min(box.n[1], box.n[2]) / (turns * options.threads));
  if (bodies) omp_set_schedule(omp_sched_dynamic, few);
  else omp_set_schedule(omp_sched_static, 0);
}

bool Flow::Core::run_stages(double t, double dt, bool repair, StepReport& report) {
  if (muscl != nullptr) return run_stages_muscl(t, dt, repair, report);
  ctx.dt = dt;
  share_work_among_threads();
  for (int stage = 0; stage < 4; ++stage) {
    ctx.stage = stage;
    now = t + stage_time[stage] * dt;
    Lap lap(clock);
    if (ranks) {
      if (bodies) domain_ghosts().fill_all(options.threads);
    } else if (!ghosts_filled) {
      if (ghosts_with_planes()) domain_ghosts().fill_all_z(options.threads);
      else fill_ghosts();
    }
    if (bodies) {  // only band nodes change, and no stencil reads the domain ghosts beside those
      bodies->move_to(now);
      bodies->compute_ghosts(view_of(ctx.W, ctx.bulk));
    }
    refresh_box();
    lap.book(Pass::ghosts);
    const long failures = run_stage();
    ghosts_filled = false;
    if (failures > 0) {
      if (!repair) return false;
      report.floored_nodes += repair_failures(false);
    }
  }
  Lap lap(clock);
  const long failures = finish_planes();
  lap.book(Pass::filter);
  if (failures == 0) return true;
  if (!repair) return false;
  report.floored_nodes += repair_failures(true);
  return true;
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
  if (c.muscl == nullptr) c.premark(report);  // limited slopes need no warning
  else if (c.ctx.any_mark) c.set_line_marks();
  lap.book(Pass::other);
  const bool floors = c.options.floor_density > 0.0 && c.options.floor_pressure > 0.0;
  c.ctx.drop_limit = strict_drop;
  c.ctx.filter_strength =
      c.options.filter_per_time ? std::min(1.0, dt / c.convective_step(default_cfl, default_cfl_direction)) : 1.0;
  while (!c.run_stages(t, dt, floors && report.redone == most_tries, report)) {
    if (report.redone == most_tries) c.throw_failure(t, dt);
    ++report.redone;
    if (report.redone >= lenient_after) c.ctx.drop_limit = lenient_drop;
    c.mark_failures(report.redone >= widen_after);
    c.restore();
  }
  report.marked_nodes = c.count_marks();
  if (c.ranks && c.ctx.any_mark) {  // the same on all ranks; nothing is floored without marks
    double counts[2] = {static_cast<double>(report.marked_nodes), static_cast<double>(report.floored_nodes)};
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
      c.ghosts_filled = c.ghosts_filled && report.topology.fresh_nodes + report.topology.rebuilt_nodes == 0;
    }
  }
  return report;
}

}  // namespace ocublast::flow
