#pragma once

// Lines that a body cuts: up to a tile of segments side by side in a transposed scratch with four
// ghost nodes at each end (wall ghosts or domain ghosts), solved by the same kernels. Elimination
// coefficients are common from the start of the lines to the first face near a lane's end. Where a
// segment goes on in another rank's block the fluxes of the faces at that end are known.

#include "flow_solver/numerics/kernel_aligned.hpp"
#include "flow_solver/numerics/kernel_gas.hpp"
#include "flow_solver/numerics/kernel_update.hpp"

namespace ocublast::flow::inline OCU_PRECISION::OCU_ISA {

OCU_INLINE Index segment_nodes(const Context& ctx) {
  return face_doubles(ctx) / (largest_face_record * tile_width) + 16;
}

/// Scratch of a batch behind the face buffer: nodes, metric, tails.
OCU_INLINE Index segment_doubles(const Context& ctx) {
  return segment_nodes(ctx) * tile_width * (node_record + 3 + filter_row_size + 5);
}

/// Places in the scratch, node or face 0 of each.
struct SegmentScratch {
  Real *buf, *nodes, *spacing, *inverse_h, *jacobian, *tail, *pencil;
  OCU_INLINE SegmentScratch(const Context& ctx, Real* scratch) {
    const Index length = segment_nodes(ctx) * tile_width;
    buf = face_zero(scratch);
    Real* at = scratch + face_doubles(ctx);
    nodes = at + 8 * node_record * tile_width;
    at += length * node_record;
    spacing = at + 8 * tile_width;
    at += length;
    inverse_h = at + 8 * tile_width;
    at += length;
    jacobian = at + 8 * tile_width;
    at += length;
    tail = at;
    at += length * filter_row_size;
    pencil = at + 8 * 5 * tile_width;
  }
};

/// Node of a lane's first node as (i, j, k).
OCU_INLINE void origin_of(int axis, const SegmentBatch& s, int l, int o[3]) {
  if (axis == 0) {
    o[0] = s.begin[l];
    o[1] = s.b[l];
    o[2] = s.c[l];
  } else if (axis == 1) {
    o[0] = s.b[l];
    o[1] = s.begin[l];
    o[2] = s.c[l];
  } else {
    o[0] = s.b[l];
    o[1] = s.c[l];
    o[2] = s.begin[l];
  }
}

OCU_INLINE Index offset_in(const Block& b, const int o[3]) {
  return o[0] + o[1] * b.sj + o[2] * b.sk;
}

OCU_INLINE Index stride_along(const Block& b, int axis) {
  return axis == 0 ? 1 : (axis == 1 ? b.sj : b.sk);
}

/// Kind of a lane's ends: walls, borders between ranks, or what the domain has there.
OCU_INLINE LaneEnd low_end(const Context& ctx, int axis, const SegmentBatch& s, int l) {
  if (s.wall_low[l] >= 0) return LaneEnd::wall;
  return ctx.line[axis].known_low.flux != nullptr ? LaneEnd::neighbour : ctx.line[axis].low;
}
OCU_INLINE LaneEnd high_end(const Context& ctx, int axis, const SegmentBatch& s, int l) {
  if (s.wall_high[l] >= 0) return LaneEnd::wall;
  return ctx.line[axis].known_high.flux != nullptr ? LaneEnd::neighbour : ctx.line[axis].high;
}
OCU_INLINE bool is_held(LaneEnd e) {
  return e == LaneEnd::held_wall || e == LaneEnd::held_slip_wall;
}
OCU_INLINE bool is_mirror(LaneEnd e) {
  return e == LaneEnd::mirrored_slip || is_held(e);
}

OCU_INLINE int longest_of(const SegmentBatch& s) {
  int n = 0;
  for (int l = 0; l < s.lanes; ++l) n = s.length[l] > n ? s.length[l] : n;
  return n;
}
OCU_INLINE int shortest_of(const SegmentBatch& s) {
  int n = s.length[0];
  for (int l = 1; l < s.lanes; ++l) n = s.length[l] < n ? s.length[l] : n;
  return n;
}

/// Rows of the faces [split, end] of each lane with its own end closure, eliminated onwards from
/// the common rows; zeros beyond a lane's end. `known`: faces whose flux is given where another
/// rank goes on: their rows are zero at the high end and hand on the value before them at the low
/// one.
OCU_INLINE void lane_tail(const Real* rows, int row_size, int weights, const EndRows& e,
                          bool filter, int known, const LaneEnd* low, const LaneEnd* high,
                          const SegmentBatch& s, int split, int end, Real* tail) {
  for (int l = 0; l < tile_width; ++l) {
    const int lane = l < s.lanes ? l : 0;
    const int n = s.length[lane];
    const bool mirror = is_mirror(high[lane]), goes_on = high[lane] == LaneEnd::neighbour;
    const int last = goes_on ? n - known : (mirror ? n : n + 3);
    const int first = low[lane] == LaneEnd::neighbour ? known : -3;
    double c_before[n_classes];
    for (int p = 0; p < n_classes; ++p) {
      c_before[p] =
          rows[static_cast<Index>(split - 1) * row_size + p * (weights + 3) + weights + 1];
    }
    for (int j = split; j <= end; ++j) {
      Real* out = tail + static_cast<Index>(j - split) * row_size * tile_width + l;
      if (j > last || j < first) {
        for (int c = 0; c < row_size; ++c) out[c * tile_width] = 0.0;
        for (int p = 0; p < n_classes; ++p) {
          if (j < first) out[(p * (weights + 3) + weights) * tile_width] = -1.0;
          c_before[p] = 0.0;
        }
        continue;
      }
      const int to_end = mirror || goes_on ? 4 : n + 4 - j;
      const int to_low = j < 0 ? j + 4 : 4;  // a short lane that starts at a wall and goes on
      const int nearer = to_end < to_low ? to_end : to_low;
      const int reach = nearer < 4 ? nearer : 4;
      for (int p = 0; p < n_classes; ++p) {
        double lower = e.alpha[reach], upper = e.alpha[reach];
        double pivot = 1.0;
        if (j == -3) lower = 0.0;
        if (j == last && !goes_on) upper = 0.0;
        if (j == last && mirror) {
          const MirrorRow row = mirror_row(p, is_held(high[lane]), filter);
          if (row == MirrorRow::even) lower *= 2.0;
          if (row == MirrorRow::zero) lower = pivot = 0.0;
          if (row == MirrorRow::held) {
            pivot = 1.0 / (1.0 + 2.0 * lower);
            lower = 0.0;
          }
        }
        pivot /= 1.0 - lower * c_before[p];
        Real* row = out + p * (weights + 3) * tile_width;
        for (int c = 0; c < weights; ++c)
          row[c * tile_width] = rounded(pivot * e.weights[reach][c]);
        row[weights * tile_width] = rounded(lower * pivot);
        row[(weights + 1) * tile_width] = rounded(upper * pivot);
        c_before[p] = upper * pivot;
      }
    }
  }
}

/// Everything about one lane that both solves need.
struct SegmentLanes {
  LaneEnd low[tile_width], high[tile_width];
  int origin[tile_width][3];
  int shortest, longest;
  bool starts_known;  ///< all lanes start at a border between ranks; else none does
  bool goes_on;       ///< all lanes end at one; else none does
  /// First face whose row differs by lane, with `known` given faces at a border.
  OCU_INLINE int split(int known) const { return goes_on ? shortest - known + 1 : shortest; }
};

OCU_INLINE SegmentLanes lanes_of_batch(const Context& ctx, int axis, const SegmentBatch& s) {
  SegmentLanes t;
  t.shortest = shortest_of(s);
  t.longest = longest_of(s);
  for (int l = 0; l < tile_width; ++l) {
    const int lane = l < s.lanes ? l : 0;
    t.low[l] = low_end(ctx, axis, s, lane);
    t.high[l] = high_end(ctx, axis, s, lane);
    origin_of(axis, s, lane, t.origin[l]);
  }
  t.starts_known = t.low[0] == LaneEnd::neighbour;
  t.goes_on = t.high[0] == LaneEnd::neighbour;
  return t;
}

/// The lines that the lanes' rows have in common at their start.
OCU_INLINE const LineView& common_rows(const Context& ctx, int axis, const SegmentLanes& t) {
  if (t.starts_known) return ctx.from_known[axis];
  return is_mirror(t.low[0]) ? ctx.from_mirror[axis] : ctx.from_ghost[axis];
}

/// Known fluxes of the lanes at one end, [face, component, lane].
struct LaneFluxes {
  alignas(64) Real at[known_filter_faces * 5 * tile_width];
  int faces;
  /// `known`: as in KnownEnd.
  OCU_INLINE void take(const Context& ctx, int axis, const SegmentBatch& s, const Real* known,
                       int count) {
    faces = count;
    for (int l = 0; l < tile_width; ++l) {
      const int lane = l < s.lanes ? l : 0;
      const Index groups = axis == 0 ? ctx.mask_groups : ctx.mask_tiles;
      const Index group = s.c[lane] * groups + s.b[lane] / tile_width;
      const Real* from = known + group * count * 5 * tile_width + s.b[lane] % tile_width;
      for (int v = 0; v < count * 5; ++v) at[v * tile_width + l] = from[v * tile_width];
    }
  }
  /// Into the faces that end the lanes.
  template <int Record>
  OCU_INLINE void put_high(const SegmentBatch& s, Real* buf) const {
    for (int l = 0; l < tile_width; ++l) {
      const int first = s.length[l < s.lanes ? l : 0] + 1 - faces;
      for (int j = 0; j < faces; ++j) {
        for (int q = 0; q < 5; ++q) {
          buf[(static_cast<Index>(first + j) * Record + q) * tile_width + l] =
              at[(j * 5 + q) * tile_width + l];
        }
      }
    }
  }
};

/// Metric of each lane by local face and node; constant beyond the line.
OCU_INLINE void load_metric(const Context& ctx, int axis, const SegmentBatch& s,
                            const SegmentLanes& t, const SegmentScratch& mem) {
  const LineView& line = ctx.line[axis];
  for (int l = 0; l < tile_width; ++l) {
    const int begin = s.begin[l < s.lanes ? l : 0];
    for (int i = -4; i <= t.longest + 4; ++i) {
      const int at = begin + i < ctx.n[axis] + 3 ? begin + i : ctx.n[axis] + 3;
      mem.spacing[i * tile_width + l] = line.inverse_face_spacing[at];
      mem.inverse_h[i * tile_width + l] = line.inverse_jacobian[at];
      mem.jacobian[i * tile_width + l] = line.face_jacobian[at];
    }
  }
}

/// A ghost node beyond a mirrored end of a lane so short that its mirror image lies beyond the wall
/// at the other end: the wall's ghost of that layer, mirrored. The domain's ghost there holds what
/// is on the wall's other side. Null: not such a node.
template <int D>
OCU_INLINE const Real* ghost_across_mirror(const Context& ctx, const SegmentBatch& s,
                                           const SegmentLanes& t, int l, int at) {
  const int lane = l < s.lanes ? l : 0;
  const int n = s.length[lane];
  if (at >= 0 && at < n) return nullptr;
  const bool low = at < 0;
  const int layer = (low ? -1 - at : at - n) - n;
  if (layer < 0 || !is_mirror(low ? t.low[l] : t.high[l])) return nullptr;
  if ((low ? t.high[l] : t.low[l]) != LaneEnd::wall) return nullptr;
  const int wall = low ? s.wall_high[lane] : s.wall_low[lane];
  return ctx.wall_ghost[D] + (static_cast<Index>(wall) * 4 + layer) * 5;
}

/// Does component f of (density, velocity or momentum, ..) change sign in a mirrored end?
template <int D>
OCU_INLINE bool flips(LaneEnd end, int f) {
  return f == 1 + D || (end == LaneEnd::held_wall && f >= 1 && f <= 3);
}

/// Node values of a lane into the transposed scratch: fluid nodes, four ghosts at each end, then
/// repetitions up to the longest lane. Diffusivities of ghosts are those of the end node.
template <int D, int Visc>
OCU_INLINE void load_lane(const Context& ctx, const SegmentBatch& s, const SegmentLanes& t, int l,
                          Real* nodes) {
  const int lane = l < s.lanes ? l : 0;
  const int n = s.length[lane];
  const Block& w = ctx.W;
  const Index sl = stride_along(w, D);
  const Real* base = w.data + offset_in(w, t.origin[l]);
  const Index gl = stride_along(ctx.G, D);
  const Real* g_base =
      Visc == narrow_viscosity ? ctx.G.data + offset_in(ctx.G, t.origin[l]) : nullptr;
  const int component[4] = {first_gradient + (D == 0 ? 1 : (D == 1 ? 3 : 6)),
                            first_gradient + (D == 0 ? 2 : (D == 1 ? 5 : 7)),
                            first_gradient + transverse_1[D], first_gradient + transverse_2[D]};
  for (int i = -4; i < t.longest + 4; ++i) {
    Real* out = nodes + static_cast<Index>(i) * node_record * tile_width + l;
    const int at = i < n + 4 ? i : n + 3;
    const int inside = at < 0 ? 0 : (at >= n ? n - 1 : at);
    const bool wall =
        (at < 0 && t.low[l] == LaneEnd::wall) || (at >= n && t.high[l] == LaneEnd::wall);
    if (wall) {
      const int index = at < 0 ? s.wall_low[lane] : s.wall_high[lane];
      const int layer = at < 0 ? -1 - at : at - n;
      const Real* ghost = ctx.wall_ghost[D] + (static_cast<Index>(index) * 4 + layer) * 5;
      for (int f = 0; f < 5; ++f) out[f * tile_width] = ghost[f];
    } else if (const Real* across = ghost_across_mirror<D>(ctx, s, t, l, at)) {
      const LaneEnd end = at < 0 ? t.low[l] : t.high[l];
      for (int f = 0; f < 5; ++f) out[f * tile_width] = flips<D>(end, f) ? -across[f] : across[f];
    } else {
      for (int f = 0; f < 5; ++f) out[f * tile_width] = base[at * sl + f * w.sf];
    }
    // Diffusivities and bulk pressure are even about mirrored ends, else those of the end node.
    const LaneEnd kind = at < 0 ? t.low[l] : t.high[l];
    int smooth = inside;
    if (at < 0 && is_mirror(kind) && -1 - at < n) smooth = -1 - at;
    if (at >= n && is_mirror(kind) && at - n < n) smooth = 2 * n - 1 - at;
    if (kind == LaneEnd::neighbour && (at == -1 || at == n))
      smooth = at;  // heat crosses the border
    out[field_bulk * tile_width] = base[smooth * sl + field_bulk * w.sf];
    out[field_kappa * tile_width] = base[smooth * sl + field_kappa * w.sf];
    if constexpr (Visc == narrow_viscosity) {
      const double mu_gas = gas_viscosity(ctx, Scalar{base[smooth * sl + 4 * w.sf]}).v;
      out[node_mu * tile_width] = rounded(base[smooth * sl + field_mu * w.sf] + mu_gas);
      out[field_kappa * tile_width] =
          rounded(out[field_kappa * tile_width] + ctx.heat_per_viscosity * mu_gas);
      for (int q = 0; q < 4; ++q) {
        out[(node_gradient + q) * tile_width] = g_base[inside * gl + component[q] * ctx.G.sf];
      }
    }
  }
}

/// Conserved states and marks of the lanes for first-order faces.
template <int D>
OCU_INLINE Lanes segment_lanes(const Context& ctx, const SegmentBatch& s, const SegmentLanes& t) {
  Lanes lanes;
  lanes.qf = ctx.Q.sf;
  lanes.ql = stride_along(ctx.Q, D);
  lanes.ml = D == 0 ? 1 : (D == 1 ? mark_row(ctx) : mark_row(ctx) * ctx.mask_rows);
  lanes.active = 0;
  const Index wl = stride_along(ctx.W, D);
  for (int l = 0; l < tile_width; ++l) {
    const int lane = l < s.lanes ? l : 0;
    const int* o = t.origin[l];
    const int n = s.length[lane];
    lanes.n[l] = n;
    lanes.q[l] = ctx.Q.data + offset_in(ctx.Q, o);
    lanes.mark[l] = ctx.mark + mark_at(ctx, o[0], o[1], o[2]);
    lanes.low[l] = t.low[l];
    lanes.high[l] = t.high[l];
    const Real* node = ctx.W.data + offset_in(ctx.W, o);
    lanes.low_state[l] = node - wl;
    lanes.high_state[l] = node + n * wl;
    lanes.low_stride[l] = lanes.high_stride[l] = ctx.W.sf;
    if (t.low[l] == LaneEnd::held_wall) lanes.low_state[l] = ctx.line[D].wall_low.velocity;
    if (t.high[l] == LaneEnd::held_wall) lanes.high_state[l] = ctx.line[D].wall_high.velocity;
    if (t.low[l] == LaneEnd::wall) {
      lanes.low_state[l] = ctx.wall_motion[D] + static_cast<Index>(s.wall_low[lane]) * 6;
      lanes.low_stride[l] = 1;
    }
    if (t.high[l] == LaneEnd::wall) {
      lanes.high_state[l] = ctx.wall_motion[D] + static_cast<Index>(s.wall_high[lane]) * 6;
      lanes.high_stride[l] = 1;
    }
    if (l >= s.lanes || !ctx.any_mark) continue;
    const auto marked_beyond = [&](const KnownEnd& end, LaneEnd kind) {
      if (kind != LaneEnd::neighbour || end.marked == nullptr) return 0u;
      const Index groups = D == 0 ? ctx.mask_groups : ctx.mask_tiles;
      const unsigned bits = end.marked[s.c[l] * groups + s.b[l] / tile_width];
      return ((bits >> (s.b[l] % tile_width)) & 1u) << l;
    };
    lanes.low_marked |= marked_beyond(ctx.line[D].known_low, t.low[l]);
    lanes.high_marked |= marked_beyond(ctx.line[D].known_high, t.high[l]);
    lanes.active |= lanes.low_marked | lanes.high_marked;
    for (int i = 0; i < n; ++i) {
      if (lanes.mark[l][i * lanes.ml] != 0) lanes.active |= 1u << l;
    }
  }
  return lanes;
}

template <int D, int Visc, bool Eight>
void sweep_segment_batch(const Context& ctx, Real* scratch, const SegmentBatch& s) {
  const SegmentScratch mem(ctx, scratch);
  const SegmentLanes t = lanes_of_batch(ctx, D, s);
  for (int l = 0; l < tile_width; ++l) load_lane<D, Visc>(ctx, s, t, l, mem.nodes);
  load_metric(ctx, D, s, t, mem);
  const LineView& common = common_rows(ctx, D, t);
  constexpr int known = known_flux_faces(Eight);
  const int end = t.longest + 3, split = t.split(known);
  lane_tail(common.flux, flux_row_size, flux_weights, ctx.flux_end, false, known, t.low, t.high, s,
            split, end, mem.tail);
  const LaneCoef coef{common.flux, mem.tail, split, mem.spacing, mem.inverse_h};
  constexpr Index step = node_record * tile_width;
  Source src{mem.nodes, tile_width, step, mem.nodes + node_mu * tile_width, {}, step};
  for (int q = 0; q < 4; ++q) src.g[q] = mem.nodes + (node_gradient + q) * tile_width;
  const GasVec gas(ctx);
  const Walk walk = walk_of<Eight>(t.longest, -3, end);
  Forward<Visc, Eight> forward;
  start_forward<D>(forward, gas, src, walk.first, walk.missing_low);
  LaneFluxes given;
  if (t.starts_known) {
    given.take(ctx, D, s, ctx.line[D].known_low.flux, known);
    start_known(given.at, known, 0, forward.face);
  }
  forward_nodes<D>(forward, gas, src, walk.first, walk.last + 1, coef, mem.buf);
  end_forward<D>(forward, walk.last, walk.missing_high, coef, mem.buf);
  if (t.starts_known) store_known<face_record<Visc>>(given.at, known, 0, 0, mem.buf);
  if (t.goes_on) {
    given.take(ctx, D, s, ctx.line[D].known_high.flux, known);
    given.put_high<face_record<Visc>>(s, mem.buf);
  }
  const auto sink = [&](int i, const Vec div[5]) {
    for (int f = 0; f < 5; ++f)
      store(mem.pencil + (static_cast<Index>(i) * 5 + f) * tile_width, div[f]);
  };
  const Lanes lanes = segment_lanes<D>(ctx, s, t);
  if (lanes.active == 0) {
    backward<D, Visc>(t.longest, end, coef, mem.buf, sink);
  } else {
    LineView open = ctx.line[D];
    open.periodic = false;
    backward_slow<D, Visc>(ctx, open, t.longest, end, coef, mem.buf, &lanes, sink);
  }
  const Block& to = D < 2 ? ctx.X : ctx.R;
  const Index rl = stride_along(to, D);
  for (int l = 0; l < s.lanes; ++l) {
    Real* r = to.data + offset_in(to, t.origin[l]);
    for (int i = 0; i < s.length[l]; ++i) {
      for (int f = 0; f < 5; ++f) {
        r[i * rl + f * to.sf] += mem.pencil[(static_cast<Index>(i) * 5 + f) * tile_width + l];
      }
    }
  }
}

template <int D>
OCU_INLINE void sweep_segment_axis(const Context& ctx, Real* scratch, const SegmentBatch& s,
                                   const SegmentBatch* next) {
  if (s.aligned && !ctx.nodal_stress &&
      (ctx.eighth_order ? sweep_aligned<D, true>(ctx, scratch, s, next)
                        : sweep_aligned<D, false>(ctx, scratch, s, next))) {
    return;
  }
  if (ctx.nodal_stress) {
    if (ctx.eighth_order)
      sweep_segment_batch<D, narrow_viscosity, true>(ctx, scratch, s);
    else
      sweep_segment_batch<D, narrow_viscosity, false>(ctx, scratch, s);
  } else {
    if (ctx.eighth_order)
      sweep_segment_batch<D, no_viscosity, true>(ctx, scratch, s);
    else
      sweep_segment_batch<D, no_viscosity, false>(ctx, scratch, s);
  }
}

inline void sweep_segments(const Context& ctx, Real* scratch, int axis, const SegmentBatch& s,
                           const SegmentBatch* next) {
  if (axis == 0) sweep_segment_axis<0>(ctx, scratch, s, next);
  if (axis == 1) sweep_segment_axis<1>(ctx, scratch, s, next);
  if (axis == 2) sweep_segment_axis<2>(ctx, scratch, s, next);
}

}  // namespace ocublast::flow::OCU_ISA
