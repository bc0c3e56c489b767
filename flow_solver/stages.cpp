// Runge-Kutta stages over planes and rows: ghosts, stress, line solves, update; the filter in the
// last.

#include <omp.h>

#include <algorithm>
#include <vector>

#include "flow_solver/boundary/domain_ghosts.hpp"
#include "flow_solver/flow_core.hpp"
#include "flow_solver/step.hpp"

namespace ocublast::flow::inline OCU_PRECISION {
namespace {

constexpr double stage_time[4] = {0.0, 0.5, 0.5, 1.0};

}  // namespace

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
      // The batches of one direction from `b` on that lie in tile `tile` (-1: all); returns the
      // first one left.
      const auto sweep_cut = [&](int axis, std::size_t b, int tile) {
        const SegmentBatches& s = segments[static_cast<std::size_t>(axis)];
        if (s.begin.empty()) return b;
        const std::size_t end = s.begin[static_cast<std::size_t>(k) + 1];
        for (;
             b < end && (tile < 0 || (s.batch[b].aligned && s.batch[b].b[0] / tile_width == tile));
             ++b) {
          kernels->sweep_segments(plane, own, axis, s.batch[b],
                                  b + 1 < end ? &s.batch[b + 1] : nullptr);
        }
        return b;
      };
      const auto first_of = [&](std::size_t axis) {
        return segments[axis].begin.empty() ? std::size_t{0}
                                            : segments[axis].begin[static_cast<std::size_t>(k)];
      };
      std::size_t cut_x = first_of(0);
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
        cut_x = sweep_cut(0, cut_x,
                          g);  // aligned ones come first, by tiles: their rows are in the cache
        lap.book(Pass::sweep_x);
      }
      sweep_cut(0, cut_x, -1);
      lap.book(Pass::sweep_x);
      if (box.present[1]) {
        if (ctx.bulk && !bulk_is_ready) kernels->bulk_ghost_rows(plane, k);
        sweep_cut(1, first_of(1), -1);
        kernels->sweep_y(plane, own, k, 0, box.tiles);
        lap.book(Pass::sweep_y);
      }
    }
  }
}

/// The batches of one direction where there is only one plane, shared by the threads of a parallel
/// region. An aligned batch writes whole vectors of its tile, also the lanes of other batches
/// there: every thread has tiles of its own, and the other batches, which write their nodes only,
/// come after them.
template <class Call>
void Flow::Core::for_batches_of_plane(const SegmentBatches& batches, const Call& call) {
  const auto& batch = batches.batch;
  const int threads = omp_get_num_threads(), thread = omp_get_thread_num();
  for (const SegmentBatch& b : batch) {
    if (b.aligned && b.b[0] / tile_width % threads == thread) call(b);
  }
#pragma omp barrier
#pragma omp for schedule(static)
  for (std::size_t b = 0; b < batch.size(); ++b) {
    if (!batch[b].aligned) call(batch[b]);
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
    const auto sweep_cut = [&](int axis) {
      for_batches_of_plane(segments[static_cast<std::size_t>(axis)], [&](const SegmentBatch& b) {
        sweeps.sweep_segments(box, own, axis, b, nullptr);
      });
    };
#pragma omp for schedule(static)
    for (int g = 0; g < box.row_groups; ++g) sweeps.sweep_x(box, own, 0, g, g + 1);
    sweep_cut(0);
    if (box.present[1]) {
      sweep_cut(1);
#pragma omp for schedule(static)
      for (int t = 0; t < box.tiles; ++t) sweeps.sweep_y(box, own, 0, t, t + 1);
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
        sweeps.sweep_segments(box, own, 2, s.batch[b],
                              b + 1 < s.begin[c + 1] ? &s.batch[b + 1] : nullptr);
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
    for (std::size_t b = s.begin[c]; b < s.begin[c + 1]; ++b)
      kernels->filter_segments(box, own, axis, s.batch[b]);
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
    const auto filter_cut = [&](int axis) {
      for_batches_of_plane(segments[static_cast<std::size_t>(axis)], [&](const SegmentBatch& b) {
        kernels->filter_segments(box, own, axis, b);
      });
    };
#pragma omp for schedule(static)
    for (int g = 0; g < box.row_groups; ++g) kernels->filter_x(box, own, 0, g, g + 1);
    filter_cut(0);
    if (box.present[1]) {
#pragma omp for schedule(static)
      for (int t = 0; t < box.tiles; ++t) kernels->filter_y(box, own, 0, t, t + 1);
      filter_cut(1);
    }
  }
}

/// Filter along x and y (z was filtered with the update), then primitives.
long Flow::Core::finish_planes() {
  if (ranks) return finish_on_ranks();
  const int n2 = box.n[2];
  const SegmentBatches& z = segments[2];
  long failures = 0;
#pragma omp parallel num_threads(options.threads) reduction(+ : failures) if (n2 > 1)
  {
    Real* own = scratch[static_cast<std::size_t>(omp_get_thread_num())].data();
    if (box.filter && !z.begin.empty()) {
#pragma omp for schedule(runtime)
      for (int j = 0; j < box.n[1]; ++j) {
        const auto c = static_cast<std::size_t>(j);
        for (std::size_t b = z.begin[c]; b < z.begin[c + 1]; ++b)
          kernels->filter_segments(box, own, 2, z.batch[b]);
      }
    }
    if (n2 > 1) {
#pragma omp for schedule(runtime)
      for (int k = 0; k < n2; ++k)
        failures += box.filter ? filter_plane(own, k) : kernels->finish_plane(box, k);
    }
  }
  if (n2 > 1) return failures;
  if (box.filter) filter_one_plane();
  return kernels->finish_plane(box, 0);
}

long Flow::Core::run_stage() {
  if (ranks) return run_stage_on_ranks();
  if (box.n[2] > 1)
    sweep_planes();
  else
    sweep_one_plane();
  Lap lap(clock);
  const long failures = update_rows();
  lap.book(Pass::sweep_z);
  return failures;
}

/// Threads keep their planes and rows, which stay in their memory; where bodies make some of these
/// dearer than others the threads take a few at a time as they become free.
void Flow::Core::share_work_among_threads() const {
  constexpr int turns = 8;
  const int few = std::max(1, std::min(box.n[1], box.n[2]) / (turns * options.threads));
  if (bodies)
    omp_set_schedule(omp_sched_dynamic, few);
  else
    omp_set_schedule(omp_sched_static, 0);
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
      if (ghosts_with_planes())
        domain_ghosts().fill_all_z(options.threads);
      else
        fill_ghosts();
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

}  // namespace ocublast::flow
