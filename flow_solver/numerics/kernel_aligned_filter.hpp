#pragma once

// The filter on cut segments of neighbouring lines, as kernel_aligned.hpp solves their fluxes.

#include "flow_solver/numerics/kernel_aligned.hpp"
#include "flow_solver/numerics/kernel_filter.hpp"

namespace ocublast::flow::inline OCU_PRECISION::OCU_ISA {

/// As settled_face, for the filter's coefficient: at 0.47 the root is 0.70, its 104th power 1e-16;
/// coefficients nearer to one half have no common middle.
OCU_INLINE int settled_filter_face(const EndRows& e) {
  constexpr int never = 1 << 20;
  return e.alpha[4] <= 0.47 && e.alpha[4] >= -0.47 ? 52 : never;
}

/// Rows per lane in the zones, common ones between.
struct ZoneFilter {
  const Real *common, *low, *high;
  Zones zone;
  const Real* face_jacobian;
  const Real* inverse_jacobian;
  double strength;
  OCU_INLINE Vec row(int j, int c) const {
    const auto lane = [&](const Real* rows, int begin) OCU_FORCE {
      return load(rows +
                  (static_cast<Index>(j - begin) * filter_class_size + c % filter_class_size) *
                      tile_width);
    };
    if (j < zone.low_end) return lane(low, -3);
    if (j < zone.high_begin) return splat(common[static_cast<Index>(j) * filter_row_size + c]);
    return lane(high, zone.high_begin);
  }
  OCU_INLINE Vec jacobian(int j) const { return splat(strength) * splat(face_jacobian[j]); }
  OCU_INLINE Vec inverse_h(int i) const { return splat(inverse_jacobian[i]); }
};

/// Conserved state of a wall or domain ghost of a lane.
template <int D>
OCU_INLINE void ghost_conserved(const Context& ctx, const Real* w, Index stride, double out[5]) {
  const double u[3] = {w[stride], w[2 * stride], w[3 * stride]};
  const PointState p = point_from_primitive(ctx, w[0], u, w[4 * stride]);
  for (int f = 0; f < 5; ++f) out[f] = p.q[f];
}

/// Conserved states of the batch's nodes and the four ghosts at each end of its lanes; anything
/// finite else.
template <int D>
OCU_INLINE void load_aligned_filter(const Context& ctx, const AlignedLanes& t, int across,
                                    Real* pencil) {
  constexpr Index step = 5 * tile_width;
  for (int u = -4; u < t.n + 4; ++u) {
    if (u >= 0 && u < t.n) continue;
    for (int f = 0; f < 5; ++f) store(pencil + u * step + f * tile_width, splat(0.0));
  }
  if constexpr (D == 0) {
    const Real* row[tile_width];
    rows_of_lanes(ctx, ctx.A, t, across, row);
    // Whole fours lie in the rows, which are padded to tiles; what they bring beyond the batch is
    // finite.
    for (int i = down_to(t.first, 4); i < t.first + t.n; i += 4) {
      for (int f = 0; f < 5; ++f) {
        Vec v[4];
        load_four_columns(row, f * ctx.A.sf + i, v);
        for (int m = 0; m < 4; ++m) store(pencil + (i + m - t.first) * step + f * tile_width, v[m]);
      }
    }
  } else {
    for (int u = 0; u < t.n; ++u) {
      const Real* from = ctx.A.data + aligned_place<D>(ctx.A, t, across, u);
      for (int f = 0; f < 5; ++f)
        store(pencil + u * step + f * tile_width, load(from + f * ctx.A.sf));
    }
  }
  for (int l = 0; l < tile_width; ++l) {
    if (!t.has(l)) continue;
    const int line = t.i0 + l;
    const Real* w = ctx.W.data + (D == 0 ? t.first + line * ctx.W.sj + across * ctx.W.sk
                                  : aligned_place < D == 0 ? 1
                                                           : D > (ctx.W, t, across, 0) + l);
    const Index wl = D == 0 ? 1 : (D == 1 ? ctx.W.sj : ctx.W.sk);
    const auto put = [&](int u, int wall, int layer) OCU_FORCE {
      double q[5];
      if (wall >= 0)
        ghost_conserved<D>(ctx, ctx.wall_ghost[D] + (static_cast<Index>(wall) * 4 + layer) * 5, 1,
                           q);
      else
        ghost_conserved<D>(ctx, w + u * wl, ctx.W.sf, q);
      for (int f = 0; f < 5; ++f) pencil[u * step + f * tile_width + l] = rounded(q[f]);
    };
    for (int layer = 0; layer < 4; ++layer) put(t.begin[l] - 1 - layer, t.wall_low[l], layer);
    for (int layer = 0; layer < 4; ++layer) put(t.end[l] + layer, t.wall_high[l], layer);
  }
}

template <int D>
OCU_INLINE void store_aligned_filter(const Context& ctx, const AlignedLanes& t, int across,
                                     const Real* pencil) {
  constexpr Index step = 5 * tile_width;
  if constexpr (D == 0) {
    Real* row[tile_width];
    rows_of_lanes(ctx, ctx.A, t, across, row);
    for (int i0 = down_to(t.first, tile_width); i0 < t.first + t.n; i0 += tile_width) {
      for (int f = 0; f < 5; ++f) {
        Vec v[tile_width];
        for (int m = 0; m < tile_width; m += 4)
          load_four_columns(row, f * ctx.A.sf + i0 + m, v + m);
        for (int m = 0; m < tile_width; ++m) {
          const int u = i0 + m - t.first;
          if (u < 0 || u >= t.n) continue;
          v[m] = select(t.at(u), load(pencil + u * step + f * tile_width), v[m]);
        }
        store_columns(row, f * ctx.A.sf + i0, v, t.used);
      }
    }
  } else {
    for (int u = 0; u < t.n; ++u) {
      Real* to = ctx.A.data + aligned_place<D>(ctx.A, t, across, u);
      const unsigned lanes = t.at(u);
      for (int f = 0; f < 5; ++f) {
        Real* at = to + f * ctx.A.sf;
        store(at, select(lanes, load(pencil + u * step + f * tile_width), load(at)));
      }
    }
  }
}

/// Filters the batch's segments in A. False: a node is marked, nothing was done.
template <int D>
[[gnu::noinline]] bool filter_aligned(const Context& shared, Real* scratch, const SegmentBatch& s) {
  const Context ctx = shared;  // a copy: vector stores could alias the shared one
  const AlignedLanes t(s);
  const int across = s.c[0];
  if (any_marked<D>(ctx, t, across)) return false;
  Real* buf = face_zero(scratch);
  Real* pencil = scratch + face_doubles(ctx) + 8 * 5 * tile_width;
  Real* rows = pencil + static_cast<Index>(t.n + 8) * 5 * tile_width;
  load_aligned_filter<D>(ctx, t, across, pencil);
  const Real* common = ctx.from_ghost[D].filter;
  const Zones zone(t, settled_filter_face(ctx.filter_end));
  zone_rows<filter_weights>(common, ctx.filter_end, t, -3, zone.low_end, rows);
  Real* high_rows = rows + static_cast<Index>(zone.low_end + 3) * filter_class_size * tile_width;
  zone_rows<filter_weights>(common, ctx.filter_end, t, zone.high_begin, t.n + 4, high_rows);
  LineView line = ctx.line[D];
  line.periodic = false;
  line.known_low = line.known_high = {};
  const ZoneFilter coef{common,
                        rows,
                        high_rows,
                        zone,
                        line.face_jacobian + t.first,
                        line.inverse_jacobian + t.first,
                        ctx.filter_strength};
  filter_pencil<D>(line, t.n, -3, t.n + 3, coef, buf, pencil, 0u, nullptr);
  store_aligned_filter<D>(ctx, t, across, pencil);
  return true;
}

}  // namespace ocublast::flow::OCU_ISA
