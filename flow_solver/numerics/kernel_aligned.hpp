#pragma once

// Cut segments of neighbouring lines of a tile along y or z, all of whose ends have ghosts: nodes come
// and results go as whole vectors, and only the rows near the ends of the lanes differ between them.
// Lanes start and end where they want within the batch's common range.

#include "flow_solver/numerics/kernel_sweep.hpp"

namespace ocublast::flow::inline OCU_PRECISION::OCU_ISA {

/// Elimination factors behind a ghosted end are equal to round-off from this face on: they converge
/// with the square of the root of alpha z^2 + z + alpha (0.38 at sixth, 0.45 at eighth order).
inline constexpr int settled_face = 26;

/// Rows per lane in a zone of faces; every end has ghosts, so that all components share one class.
struct ZoneCoef {
  const Real* rows;  ///< vectors [face - begin, flux_class_size]
  int begin;
  const Real* inverse_spacing;
  const Real* inverse_jacobian;
  OCU_INLINE Vec row(int j, int c) const {
    return load(rows + (static_cast<Index>(j - begin) * flux_class_size + c % flux_class_size) * tile_width);
  }
  OCU_INLINE Vec inverse_dx(int j) const { return splat(inverse_spacing[j]); }
  OCU_INLINE Vec inverse_h(int i) const { return splat(inverse_jacobian[i]); }
};

/// The lanes of a batch by their place in the tile; begin and end count from the batch's first node.
struct AlignedLanes {
  int i0;                ///< x of the tile
  int first, n;          ///< first node of the batch on its line, nodes
  unsigned used = 0;
  int begin[tile_width], end[tile_width];
  int wall_low[tile_width], wall_high[tile_width];
  int last_begin = 0, first_end = 0;
  OCU_INLINE explicit AlignedLanes(const SegmentBatch& s) {
    i0 = s.b[0] - s.b[0] % tile_width;
    first = s.begin[0];
    int stop = 0;
    for (int l = 0; l < s.lanes; ++l) {
      first = s.begin[l] < first ? s.begin[l] : first;
      stop = s.begin[l] + s.length[l] > stop ? s.begin[l] + s.length[l] : stop;
    }
    n = stop - first;
    first_end = n;
    for (int l = 0; l < tile_width; ++l) begin[l] = end[l] = 0;
    for (int l = 0; l < s.lanes; ++l) {
      const int lane = s.b[l] % tile_width;
      used |= 1u << lane;
      begin[lane] = s.begin[l] - first;
      end[lane] = begin[lane] + s.length[l];
      wall_low[lane] = s.wall_low[l];
      wall_high[lane] = s.wall_high[l];
      last_begin = begin[lane] > last_begin ? begin[lane] : last_begin;
      first_end = end[lane] < first_end ? end[lane] : first_end;
    }
  }
  OCU_INLINE bool has(int l) const { return ((used >> l) & 1u) != 0; }
  /// Lanes to which node u belongs.
  OCU_INLINE unsigned at(int u) const {
    if (u >= last_begin && u < first_end) return used;
    unsigned lanes = 0;
    for (int l = 0; l < tile_width; ++l) {
      if (has(l) && u >= begin[l] && u < end[l]) lanes |= 1u << l;
    }
    return lanes;
  }
};

/// Offset of node u of the batch in a block.
template <int D>
OCU_INLINE Index aligned_place(const Block& b, const AlignedLanes& t, int across, int u) {
  return D == 1 ? t.i0 + (t.first + u) * b.sj + across * b.sk : t.i0 + across * b.sj + (t.first + u) * b.sk;
}

/// Ghosts of lane l over the loaded nodes: four layers of the wall's values, the outermost repeated to
/// the ends of the range; diffusivities of the lane's end nodes.
OCU_INLINE void patch_lane(const Real* wall_ghost, const AlignedLanes& t, int l, Real* nodes) {
  constexpr Index step = node_record * tile_width;
  const auto patch = [&](int u, int wall, int layer, int end_node) {
    Real* to = nodes + u * step + l;
    const Real* from = nodes + end_node * step + l;
    to[field_bulk * tile_width] = from[field_bulk * tile_width];
    to[field_kappa * tile_width] = from[field_kappa * tile_width];
    if (wall < 0) return;  // the domain's ghosts are in place
    const Real* ghost = wall_ghost + (static_cast<Index>(wall) * 4 + (layer < 3 ? layer : 3)) * 5;
    for (int f = 0; f < 5; ++f) to[f * tile_width] = ghost[f];
  };
  for (int u = -4; u < t.begin[l]; ++u) patch(u, t.wall_low[l], t.begin[l] - 1 - u, t.begin[l]);
  for (int u = t.end[l]; u < t.n + 4; ++u) patch(u, t.wall_high[l], u - t.end[l], t.end[l] - 1);
}

template <int D>
OCU_INLINE void load_aligned(const Context& ctx, const AlignedLanes& t, int across, Real* nodes) {
  constexpr Index step = node_record * tile_width;
  int some = 0;
  while (!t.has(some)) ++some;
  const Real* some_node = ctx.W.data + aligned_place<D>(ctx.W, t, across, t.begin[some]) + some;
  for (int u = -4; u < t.n + 4; ++u) {
    const Real* from = ctx.W.data + aligned_place<D>(ctx.W, t, across, u);
    for (int f = 0; f <= field_kappa; ++f) {
      Vec v = load(from + f * ctx.W.sf);
      if (t.used != all_lanes) v = select(t.used, v, splat(some_node[f * ctx.W.sf]));
      store(nodes + u * step + f * tile_width, v);
    }
  }
  for (int l = 0; l < tile_width; ++l) {
    if (t.has(l)) patch_lane(ctx.wall_ghost[D], t, l, nodes);
  }
}

/// Rows of the faces [from, to) of every lane: the common ones counted from the lane's start, and
/// behind its last node those of its end. Zero outside a lane: its faces stay zero there.
OCU_INLINE void zone_rows(const Real* common, const EndRows& e, const AlignedLanes& t, int from, int to,
                          Real* rows) {
  for (int l = 0; l < tile_width; ++l) {
    const int n = t.end[l] - t.begin[l];
    for (int j = from; j < to; ++j) {
      Real* out = rows + static_cast<Index>(j - from) * flux_class_size * tile_width + l;
      const int own = j - t.begin[l];
      if (!t.has(l) || own < -3 || own > n + 3) {
        for (int c = 0; c < flux_class_size; ++c) out[c * tile_width] = 0.0;
      } else if (own <= n) {
        const Real* row = common + static_cast<Index>(own) * flux_row_size;
        for (int c = 0; c < flux_class_size; ++c) out[c * tile_width] = row[c];
      } else {
        const int reach = n + 4 - own;
        const Real* before = out - static_cast<Index>(flux_class_size) * tile_width;
        const double pivot = 1.0 / (1.0 - e.alpha[reach] * before[(flux_weights + 1) * tile_width]);
        for (int c = 0; c < flux_weights; ++c) out[c * tile_width] = rounded(pivot * e.weights[reach][c]);
        out[flux_weights * tile_width] = rounded(e.alpha[reach] * pivot);
        out[(flux_weights + 1) * tile_width] = rounded(reach > 1 ? e.alpha[reach] * pivot : 0.0);
      }
    }
  }
}

/// Whether a node of the batch takes first-order fluxes.
template <int D>
OCU_INLINE bool any_marked(const Context& ctx, const AlignedLanes& t, int across) {
  if (!ctx.any_mark) return false;
  for (int u = 0; u < t.n; ++u) {
    const int along = t.first + u;
    const std::uint8_t* mark = ctx.mark + (D == 1 ? mark_at(ctx, t.i0, along, across) : mark_at(ctx, t.i0, across, along));
    const unsigned lanes = t.at(u);
    for (int l = 0; l < tile_width; ++l) {
      if (((lanes >> l) & 1u) != 0 && mark[l] != 0) return true;
    }
  }
  return false;
}

/// Scratch: faces, nodes, rows of the zones.
OCU_INLINE Index aligned_doubles(const Context& ctx) {
  return face_doubles(ctx) / (largest_face_record * tile_width) * tile_width * (node_record + flux_class_size) +
         face_doubles(ctx) + (node_record + flux_class_size) * 32 * tile_width;
}

/// R += divergence of the flux along the batch's segments. False: a node is marked, nothing was done.
template <int D, bool Eight>
[[gnu::noinline]] bool sweep_aligned(const Context& shared, Real* scratch, const SegmentBatch& s) {
  const Context ctx = shared;  // a copy: vector stores could alias the shared one
  const AlignedLanes t(s);
  const int across = s.c[0];
  if (any_marked<D>(ctx, t, across)) return false;
  Real* buf = face_zero(scratch);
  Real* nodes = scratch + face_doubles(ctx) + 8 * node_record * tile_width;
  Real* rows = nodes + static_cast<Index>(t.n + 8) * node_record * tile_width;
  load_aligned<D>(ctx, t, across, nodes);

  // Zones of faces: near the starts, the common middle, near the ends.
  const LineView& common = ctx.from_ghost[D];
  const Real* spacing = ctx.line[D].inverse_face_spacing + t.first;
  const Real* inverse_h = ctx.line[D].inverse_jacobian + t.first;
  int low_end = t.last_begin > 0 ? t.last_begin + settled_face : -3;
  int high_begin = t.first_end;
  if (low_end > high_begin) low_end = high_begin = t.n + 4;
  zone_rows(common.flux, ctx.flux_end, t, -3, low_end, rows);
  Real* high_rows = rows + static_cast<Index>(low_end + 3) * flux_class_size * tile_width;
  // The first row of the zone is an inner one; the elimination goes on from there.
  zone_rows(common.flux, ctx.flux_end, t, high_begin, t.n + 4, high_rows);
  const ZoneCoef low{rows, -3, spacing, inverse_h}, high{high_rows, high_begin, spacing, inverse_h};
  const UniformCoef middle{common.flux, spacing, inverse_h};

  constexpr Index step = node_record * tile_width;
  constexpr int lag = Eight ? 2 : 1;
  const Source src{nodes, tile_width, step, nullptr, {}, step};
  const GasVec gas(ctx);
  const Walk walk = walk_of<Eight>(t.n, -3, t.n + 3);
  Forward<no_viscosity, Eight> forward;
  start_forward<D>(forward, gas, src, walk.first, walk.missing_low);
  int node = walk.first;
  const auto walk_to = [&](int face, const auto& coef) {
    const int stop = face + lag < walk.last + 1 ? face + lag : walk.last + 1;
    if (stop > node) forward_nodes<D>(forward, gas, src, node, stop, coef, buf);
    node = stop > node ? stop : node;
  };
  walk_to(low_end, low);
  walk_to(high_begin, middle);
  if (high_begin < t.n + 4) walk_to(t.n + 4, high);
  if (high_begin < t.n + 4) end_forward<D>(forward, walk.last, walk.missing_high, high, buf);
  else end_forward<D>(forward, walk.last, walk.missing_high, low, buf);

  const auto sink = [&](int u, const Vec div[5]) OCU_FORCE {
    Real* r = ctx.R.data + aligned_place<D>(ctx.R, t, across, u);
    const unsigned lanes = t.at(u);
    for (int f = 0; f < 5; ++f) {
      store(r + f * ctx.R.sf, load(r + f * ctx.R.sf) + select(lanes, div[f], splat(0.0)));
    }
  };
  Backward back;
  if (high_begin < t.n + 4) start_backward<D, no_viscosity>(back, t.n, t.n + 3, high, buf);
  else start_backward<D, no_viscosity>(back, t.n, t.n + 3, low, buf);
  int top = t.n - 1;
  const auto walk_back = [&](int face, const auto& coef) {
    const int stop = face > 0 ? face : 0;
    if (top >= stop) backward_nodes<D, no_viscosity>(back, top, stop, coef, buf, sink);
    top = stop - 1 < top ? stop - 1 : top;
  };
  walk_back(high_begin, high);
  walk_back(low_end, middle);
  walk_back(0, low);
  return true;
}

}  // namespace ocublast::flow::OCU_ISA
