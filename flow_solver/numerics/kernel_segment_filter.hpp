#pragma once

// The filter on cut segments: aligned batches as whole vectors, the others lane by lane through a
// transposed scratch like their fluxes (kernel_segment.hpp).

#include "flow_solver/numerics/kernel_aligned_filter.hpp"
#include "flow_solver/numerics/kernel_segment.hpp"

namespace ocublast::flow::inline OCU_PRECISION::OCU_ISA {

template <int D>
OCU_INLINE void load_filter_lane(const Context& ctx, const SegmentBatch& s, const SegmentLanes& t,
                                 int l, Real* pencil) {
  const int lane = l < s.lanes ? l : 0;
  const int n = s.length[lane];
  const Real* a = ctx.A.data + offset_in(ctx.A, t.origin[l]);
  const Index al = stride_along(ctx.A, D), wl = stride_along(ctx.W, D);
  const Real* w = ctx.W.data + offset_in(ctx.W, t.origin[l]);
  for (int i = -4; i < t.longest + 4; ++i) {
    Real* out = pencil + static_cast<Index>(i) * 5 * tile_width + l;
    const int at = i < n + 4 ? i : n + 3;
    double q[5];
    const bool low = at < 0, high = at >= n;
    const LaneEnd end = low ? t.low[l] : t.high[l];
    const int layer = low ? -1 - at : at - n;
    if (!low && !high) {
      for (int f = 0; f < 5; ++f) q[f] = a[at * al + f * ctx.A.sf];
    } else if (end == LaneEnd::wall) {
      const int index = low ? s.wall_low[lane] : s.wall_high[lane];
      ghost_conserved<D>(ctx, ctx.wall_ghost[D] + (static_cast<Index>(index) * 4 + layer) * 5, 1,
                         q);
    } else if (end == LaneEnd::mirrored_slip && layer < n) {
      const int from = low ? layer : n - 1 - layer;
      for (int f = 0; f < 5; ++f) {
        const double v = a[from * al + f * ctx.A.sf];
        q[f] = flips<D>(end, f) ? -v : v;
      }
    } else if (const Real* across = ghost_across_mirror<D>(ctx, s, t, l, at)) {
      ghost_conserved<D>(ctx, across, 1, q);
      for (int f = 0; f < 5; ++f) q[f] = flips<D>(end, f) ? -q[f] : q[f];
    } else {
      ghost_conserved<D>(ctx, w + at * wl, ctx.W.sf, q);
    }
    for (int f = 0; f < 5; ++f) out[f * tile_width] = rounded(q[f]);
  }
}

template <int D>
void filter_segment_batch(const Context& ctx, Real* scratch, const SegmentBatch& s) {
  const SegmentScratch mem(ctx, scratch);
  const SegmentLanes t = lanes_of_batch(ctx, D, s);
  for (int l = 0; l < tile_width; ++l) load_filter_lane<D>(ctx, s, t, l, mem.pencil);
  load_metric(ctx, D, s, t, mem);
  const LineView& common = common_rows(ctx, D, t);
  constexpr int known = known_filter_faces;
  const int end = t.longest + 3, split = t.split(known);
  lane_tail(common.filter, filter_row_size, filter_weights, ctx.filter_end, true, known, t.low,
            t.high, s, split, end, mem.tail);
  const LaneFilter coef{common.filter, mem.tail,      split,
                        mem.jacobian,  mem.inverse_h, ctx.filter_strength};
  const Lanes lanes = segment_lanes<D>(ctx, s, t);
  LineView open = ctx.line[D];
  open.periodic = false;
  open.known_low = open.known_high = {};
  LaneFluxes given_low, given_high;
  if (t.starts_known) {
    given_low.take(ctx, D, s, ctx.line[D].known_low.filter, known);
    open.known_low = {.filter_faces = known, .filter = given_low.at};
  }
  if (t.goes_on) given_high.take(ctx, D, s, ctx.line[D].known_high.filter, known);
  filter_pencil<D>(open, t.longest, -3, end, coef, mem.buf, mem.pencil, 0u,
                   lanes.active != 0 ? &lanes : nullptr, 0, [&]() OCU_FORCE {
                     if (t.goes_on) given_high.put_high<filter_record>(s, mem.buf);
                   });
  const Index al = stride_along(ctx.A, D);
  for (int l = 0; l < s.lanes; ++l) {
    Real* a = ctx.A.data + offset_in(ctx.A, t.origin[l]);
    for (int i = 0; i < s.length[l]; ++i) {
      for (int f = 0; f < 5; ++f) {
        a[i * al + f * ctx.A.sf] = mem.pencil[(static_cast<Index>(i) * 5 + f) * tile_width + l];
      }
    }
  }
}

template <int D>
OCU_INLINE void filter_segment_axis(const Context& ctx, Real* scratch, const SegmentBatch& s) {
  if (!s.aligned || !filter_aligned<D>(ctx, scratch, s)) filter_segment_batch<D>(ctx, scratch, s);
}

inline void filter_segments(const Context& ctx, Real* scratch, int axis, const SegmentBatch& s) {
  if (axis == 0) filter_segment_axis<0>(ctx, scratch, s);
  if (axis == 1) filter_segment_axis<1>(ctx, scratch, s);
  if (axis == 2) filter_segment_axis<2>(ctx, scratch, s);
}

}  // namespace ocublast::flow::OCU_ISA
