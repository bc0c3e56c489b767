// The step under ranks. A stage: the primitives next to the borders travel while the inner planes
// form their bulk pressure; every rank adds its nodes' part of the border fluxes; those across z
// travel during the sweeps along x and y; then every line is solved within its block between known
// fluxes.

#include <fmt/format.h>
#include <omp.h>

#include <algorithm>

#include "coupler/base/errors.hpp"
#include "flow_solver/flow_core.hpp"

namespace ocublast::flow::inline OCU_PRECISION {
namespace {

/// Layers of the primitives beyond a border that are read: two by the fourth differences of the
/// sensors, three by the sixth-order slopes of the nodal stress and of the paper's dilatation.
int state_depth(const FlowOptions& options) {
  const bool nodal =
      options.viscosity != Viscosity::none || options.diffusivity_form == DiffusivityForm::paper;
  return nodal ? 3 : 2;
}

}  // namespace

void Flow::Core::set_ranks(const Ranks& all_ranks) {
  if (options.scheme == Scheme::muscl) {
    throw CaseError(
        "flow.numerics.scheme: muscl runs on one rank; take compact6 or compact8, or start without "
        "mpirun");
  }
  if (grid.geometry != Geometry::cartesian) {
    throw CaseError(
        "flow.grid.geometry: radial grids run on one rank; start the flow solver without mpirun");
  }
  const LineScheme scheme{.eighth_order = options.scheme == Scheme::compact8,
                          .filter_alpha = options.filter_alpha};
  const bool nodal = state_depth(options) == 3;
  const bool strain = options.artificial_diffusivity &&
                      (options.sensor == Sensor::strain || (nodal && options.C_mu > 0.0));
  ranks = std::make_unique<RankFlow>(
      RankPart(all_ranks, std::move(grid), boundaries, options.rank_blocks, options.rank_work),
      scheme, state_depth(options), strain, options.filter);
  grid = ranks->part.grid;
  boundaries = ranks->part.boundaries;
  // Blocks without a disturbance would have to wait for the others anyway.
  options.active_box = false;
}

void Flow::Core::require_bodies_on_ranks() const {
  if (ctx.nodal_stress) {
    throw CaseError(
        "flow.body: bodies in viscous gas, or with diffusivity_form = \"paper\", run on one rank; "
        "start "
        "the flow solver without mpirun (threads share its work)");
  }
  for (int a = 0; a < 3; ++a) {
    if (ranks->part.split(a) &&
        ranks->part.whole_boundaries[2 * static_cast<std::size_t>(a)].kind ==
            BoundaryKind::periodic) {
      throw CaseError(fmt::format(
          "flow.boundary.{0}_min: a periodic direction with bodies in the grid is not divided "
          "between ranks; start the flow solver on fewer of them, or without mpirun",
          "xyz"[a]));
    }
  }
}

void Flow::Core::set_known_ends() {
  for (std::size_t a = 0; a < 3; ++a) {
    const BorderSums* flux = ranks->flux[a].get();
    const BorderSums* filter = ranks->filter[a].get();
    if (flux == nullptr) continue;
    const auto end = [&](bool low) {
      KnownEnd known{.flux_faces = flux->known(), .flux = low ? flux->low() : flux->high()};
      if (filter != nullptr) {
        known.filter_faces = filter->known();
        known.filter = low ? filter->low() : filter->high();
      }
      return known;
    };
    ctx.line[a].known_low = end(true);
    ctx.line[a].known_high = end(false);
  }
}

void Flow::Core::wait_for(const std::function<void()>& others) {
  Lap lap(clock);
  others();
  lap.book(Pass::waiting);
}

bool Flow::Core::any_rank_has(long count) {
  bool any = false;
  wait_for([&] { any = ranks->ranks().any_of_all(count > 0); });
  return any;
}

void Flow::Core::share_maxima() {
  if (!ranks) return;
  wait_for([&] {
    const Ranks& all = ranks->ranks();
    convection = all.max_of_all(convection);
    fastest = all.max_of_all(fastest);
    p_max = all.max_of_all(p_max);
    p_min = all.min_of_all(p_min);
  });
}

void Flow::Core::sum_borders(const std::array<std::unique_ptr<BorderSums>, 3>& sums, int axis) {
  const BorderSums* of_axis = sums[static_cast<std::size_t>(axis)].get();
  if (of_axis == nullptr) return;
  const auto kernel = &sums == &ranks->flux ? kernels->border_flux : kernels->border_filter;
  const int count = axis == 2 ? box.n[1] : box.n[2];
  const int groups = axis == 0 ? box.row_groups : box.tiles;
#pragma omp parallel num_threads(options.threads)
  {
    Real* own = scratch[static_cast<std::size_t>(omp_get_thread_num())].data();
#pragma omp for schedule(static)
    for (int c = 0; c < count; ++c) {
      for (const BorderSum& sum : of_axis->sums()) kernel(box, own, axis, sum, c, 0, groups);
    }
  }
  if (!bodies) return;
  const auto& cut_sums = &sums == &ranks->flux ? ranks->cut_flux : ranks->cut_filter;
  cut_sums[static_cast<std::size_t>(axis)]->put(box, of_axis->sums(), options.threads);
}

void Flow::Core::fill_ghosts_on_ranks(const std::function<void()>& meanwhile) {
  const DomainGhosts ends = domain_ghosts();
  if (!ctx.nodal_stress) {
    ranks->state.start(ctx.W);
    ends.fill_all(options.threads);
    meanwhile();
    wait_for([&] { ranks->state.wait(); });
    ranks->state.finish(ctx.W);
    return;
  }
  for (int axis = 0; axis < 3; ++axis) {
    Halo& halo = ranks->state_by_axis[static_cast<std::size_t>(axis)];
    ends.fill_axis(axis, options.threads);
    halo.start(ctx.W);
    wait_for([&] { halo.wait(); });
    halo.finish(ctx.W);
  }
  meanwhile();
}

long Flow::Core::run_stage_on_ranks() {
  Lap lap(clock);
  RankFlow& r = *ranks;
  const int n1 = box.n[1], n2 = box.n[2];
  const auto bulk = [&](int k0, int k1) {
    if (!ctx.bulk) return;
#pragma omp parallel for schedule(static) num_threads(options.threads)
    for (int k = k0; k < k1; ++k) {
      kernels->bulk_rows(box, k, 0, n1);
      correct_bulk(k, 0, ctx.n[1]);
      kernels->bulk_ghost_rows(box, k);
    }
  };
  // Planes that look at no other rank's nodes.
  const bool only_z = !r.part.split(0) && !r.part.split(1);
  const int inner_begin = only_z ? std::min(1, n2) : n2,
            inner_end = only_z ? std::max(n2 - 1, inner_begin) : n2;
  fill_ghosts_on_ranks([&] { bulk(inner_begin, inner_end); });
  bulk(0, inner_begin);
  bulk(inner_end, n2);
  lap.book(Pass::ghosts);
  if (box.nodal_stress) {
    if (n2 > 1) {
      compute_stress();
    } else {
      kernels->stress_rows(box, 0, 0, n1);
      kernels->stress_ends_y(box, 0);
    }
    lap.book(Pass::stress);
  }
  for (int axis = 0; axis < 3; ++axis) {
    sum_borders(r.flux, axis);
    if (BorderSums* sums = r.flux[static_cast<std::size_t>(axis)].get()) sums->start();
  }
  for (const std::size_t axis : {0, 1}) {
    if (!r.flux[axis]) continue;
    wait_for([&] { r.flux[axis]->wait(); });
    r.flux[axis]->finish();
  }
  lap.book(Pass::ghosts);
  bulk_is_ready = true;
  if (n2 > 1)
    sweep_planes();
  else
    sweep_lines_of_plane();
  Lap rest(clock);
  if (r.flux[2]) {
    wait_for([&] { r.flux[2]->wait(); });
    r.flux[2]->finish();
  }
  rest.book(Pass::ghosts);
  box.filter = ctx.filter && !r.part.split(2);
  const long failures = update_rows();
  box.filter = ctx.filter;
  rest.book(Pass::sweep_z);
  return any_rank_has(failures) ? 1 : 0;
}

long Flow::Core::finish_on_ranks() {
  RankFlow& r = *ranks;
  const int n2 = box.n[2];
  const auto know_borders = [&](int axis) {
    BorderSums* sums = r.filter[static_cast<std::size_t>(axis)].get();
    if (sums == nullptr || !box.filter) return;
    sum_borders(r.filter, axis);
    sums->start();
    wait_for([&] { sums->wait(); });
    sums->finish();
  };
  const auto for_all = [&](int count, const auto& body) {
    long sum = 0;
#pragma omp parallel for schedule(static) num_threads(options.threads) reduction(+ : sum)
    for (int c = 0; c < count; ++c)
      sum += body(scratch[static_cast<std::size_t>(omp_get_thread_num())].data(), c);
    return sum;
  };
  long failures = 0;
  const auto filter_cut = [&](Real* own, int axis, int c) {
    const SegmentBatches& s = segments[static_cast<std::size_t>(axis)];
    if (s.begin.empty()) return;
    const auto at = static_cast<std::size_t>(c);
    for (std::size_t b = s.begin[at]; b < s.begin[at + 1]; ++b)
      kernels->filter_segments(box, own, axis, s.batch[b]);
  };
  if (box.filter) {  // along z, where it was not part of the update
    const bool split = r.part.split(2);
    if (split) know_borders(2);
    if (split || !segments[2].batch.empty()) {
      for_all(box.n[1], [&](Real* own, int j) {
        if (split) kernels->filter_z(box, own, j);
        filter_cut(own, 2, j);
        return 0L;
      });
    }
  }
  if (box.filter && (r.part.split(0) || r.part.split(1))) {
    know_borders(0);
    for_all(n2, [&](Real* own, int k) {
      kernels->filter_x(box, own, k, 0, box.row_groups);
      filter_cut(own, 0, k);
      return 0L;
    });
    know_borders(1);
    failures = for_all(n2, [&](Real* own, int k) {
      if (box.present[1]) {
        kernels->filter_y(box, own, k, 0, box.tiles);
        filter_cut(own, 1, k);
      }
      return kernels->finish_plane(box, k);
    });
  } else {
    failures = for_all(n2, [&](Real* own, int k) {
      return box.filter ? filter_plane(own, k) : kernels->finish_plane(box, k);
    });
  }
  return any_rank_has(failures) ? 1 : 0;
}

void Flow::Core::share_marks() {
  RankFlow& r = *ranks;
  ctx.any_mark = r.ranks().any_of_all(ctx.any_mark);
  if (!ctx.any_mark) return;
  r.conserved.start(ctx.Q);
  r.conserved.finish(ctx.Q);
  r.marked = r.exchange_bits([&](int i, int j, int k) { return mark[mark_index(i, j, k)] != 0; });
  for (std::size_t a = 0; a < 3; ++a) {
    const auto take = [&](KnownEnd& end, const std::vector<LaneBits>& bits) {
      if (end.flux == nullptr) return;
      end.marked = bits.data();
      std::transform(bits.begin(), bits.end(), line_marked[a].begin(), line_marked[a].begin(),
                     [](LaneBits b, LaneBits own) { return static_cast<LaneBits>(b | own); });
    };
    take(ctx.line[a].known_low, r.marked[a][0]);
    take(ctx.line[a].known_high, r.marked[a][1]);
  }
}

}  // namespace ocublast::flow
