#pragma once

// Cut segments of neighbouring lines (eight columns of a tile along y or z, eight rows along x),
// all of whose ends have ghosts: nodes come and results go as whole vectors or blocks of rows, and
// only the rows of the system near the ends of the lanes differ between them. Lanes start and end
// where they want within the batch's common range.

#include "flow_solver/numerics/kernel_sweep.hpp"

namespace ocublast::flow::inline OCU_PRECISION::OCU_ISA {

/// Elimination factors behind a ghosted end are equal to round-off from this face on: they converge
/// with the square of the root of alpha z^2 + z + alpha (0.38 at sixth, 0.45 at eighth order).
inline constexpr int settled_face = 26;

/// Vectors per loaded node: primitives, bulk pressure, heat diffusivity.
inline constexpr int aligned_record = field_kappa + 1;

/// Rows per lane in a zone of faces; every end has ghosts, so that all components share one class.
struct ZoneCoef {
  const Real* rows;  ///< vectors [face - begin, flux_class_size]
  int begin;
  const Real* inverse_spacing;
  const Real* inverse_jacobian;
  OCU_INLINE Vec row(int j, int c) const {
    return load(rows + (static_cast<Index>(j - begin) * flux_class_size + c % flux_class_size) *
                           tile_width);
  }
  OCU_INLINE Vec inverse_dx(int j) const { return splat(inverse_spacing[j]); }
  OCU_INLINE Vec inverse_h(int i) const { return splat(inverse_jacobian[i]); }
};

/// The lanes of a batch by their place in the tile; begin and end count from the batch's first
/// node.
struct AlignedLanes {
  int i0;        ///< first line of the tile: x along y and z, y along x
  int first, n;  ///< first node of the batch on its line, nodes
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

/// Offset of node u of the batch in a block (lines along y and z).
template <int D>
OCU_INLINE Index aligned_place(const Block& b, const AlignedLanes& t, int across, int u) {
  static_assert(D > 0);
  return D == 1 ? t.i0 + (t.first + u) * b.sj + across * b.sk
                : t.i0 + across * b.sj + (t.first + u) * b.sk;
}

/// Rows of the lanes of a batch of x-lines; rows that do not exist repeat the last one.
template <class T>
OCU_INLINE void rows_of_lanes(const Context& ctx, const Block& b, const AlignedLanes& t, int k,
                              T* row[tile_width]) {
  for (int l = 0; l < tile_width; ++l) {
    const int j = t.i0 + l < ctx.n[1] ? t.i0 + l : ctx.n[1] - 1;
    row[l] = b.data + j * b.sj + k * b.sk;
  }
}
OCU_INLINE int down_to(int i, int step) {
  return i >= 0 ? i / step * step : -((step - 1 - i) / step * step);
}

/// Four ghosts of lane l at each end among the loaded nodes; diffusivities of the lane's end nodes.
/// What lies farther out is finite and meets rows of zeros.
OCU_INLINE void patch_lane(const Real* wall_ghost, const AlignedLanes& t, int l, Real* nodes) {
  constexpr Index step = aligned_record * tile_width;
  const auto patch = [&](int u, int wall, int layer, int end_node) OCU_FORCE {
    Real* to = nodes + u * step + l;
    const Real* from = nodes + end_node * step + l;
    to[field_bulk * tile_width] = from[field_bulk * tile_width];
    to[field_kappa * tile_width] = from[field_kappa * tile_width];
    if (wall < 0) return;  // the domain's ghosts are in place
    const Real* ghost = wall_ghost + (static_cast<Index>(wall) * 4 + layer) * 5;
    for (int f = 0; f < 5; ++f) to[f * tile_width] = ghost[f];
  };
  for (int layer = 0; layer < 4; ++layer)
    patch(t.begin[l] - 1 - layer, t.wall_low[l], layer, t.begin[l]);
  for (int layer = 0; layer < 4; ++layer)
    patch(t.end[l] + layer, t.wall_high[l], layer, t.end[l] - 1);
}

template <int D>
OCU_INLINE void load_aligned(const Context& ctx, const AlignedLanes& t, int across, Real* nodes) {
  constexpr Index step = aligned_record * tile_width;
  int some = 0;
  while (!t.has(some)) ++some;
  const auto put = [&](int u, int f, Vec v, const Real* some_node) OCU_FORCE {
    if (t.used != all_lanes) v = select(t.used, v, splat(some_node[f * ctx.W.sf]));
    store(nodes + u * step + f * tile_width, v);
  };
  if constexpr (D == 0) {
    const Real* row[tile_width];
    rows_of_lanes(ctx, ctx.W, t, across, row);
    const Real* some_node = row[some] + t.first + t.begin[some];
    for (int i = down_to(t.first - 4, 4); i < t.first + t.n + 4; i += 4) {
      for (int f = 0; f <= field_kappa; ++f) {
        Vec v[4];
        load_four_columns(row, f * ctx.W.sf + i, v);
        for (int m = 0; m < 4; ++m) put(i + m - t.first, f, v[m], some_node);
      }
    }
  } else {
    const Real* some_node = ctx.W.data + aligned_place<D>(ctx.W, t, across, t.begin[some]) + some;
    for (int u = -4; u < t.n + 4; ++u) {
      const Real* from = ctx.W.data + aligned_place<D>(ctx.W, t, across, u);
      for (int f = 0; f <= field_kappa; ++f) put(u, f, load(from + f * ctx.W.sf), some_node);
    }
  }
  for (int l = 0; l < tile_width; ++l) {
    if (t.has(l)) patch_lane(ctx.wall_ghost[D], t, l, nodes);
  }
}

/// Rows of the faces [from, to) of every lane, of a system with so many weights per row: the common
/// ones counted from the lane's start, and behind its last node those of its end. Zero outside a
/// lane: its faces stay zero there.
template <int Weights>
OCU_INLINE void zone_rows(const Real* common, const EndRows& e, const AlignedLanes& t, int from,
                          int to, Real* rows) {
  constexpr int size = Weights + 3, common_size = n_classes * size,
                last = Weights + 1;  // the pivot is not needed
  static const Real zeros[size + 4] = {};
  const Real* row[tile_width];
  const auto place = [&](int j) { return rows + static_cast<Index>(j - from) * size * tile_width; };
  const auto put = [&](int j) OCU_FORCE {
    Vec v[4];
    load_four_columns(row, 0, v);
    for (int c = 0; c < 4; ++c) store(place(j) + c * tile_width, v[c]);
    load_four_columns(row, last - 3, v);
    for (int c = 4; c <= last; ++c) store(place(j) + c * tile_width, v[c - last + 3]);
  };
  const auto put_any = [&](int begin, int end) {
    for (int j = begin; j < end; ++j) {
      for (int l = 0; l < tile_width; ++l) {
        const int own = j - t.begin[l];
        row[l] = t.has(l) && own >= -3 && j <= t.end[l]
                     ? common + static_cast<Index>(own) * common_size
                     : zeros;
      }
      put(j);
    }
  };
  // Between, every lane has its row.
  int same_begin = t.last_begin - 3 > from ? t.last_begin - 3 : from;
  int same_end = t.first_end + 1 < to ? t.first_end + 1 : to;
  if (t.used != all_lanes || same_begin >= same_end) same_begin = same_end = from;
  put_any(from, same_begin);
  for (int l = 0; l < tile_width && same_end > same_begin; ++l) {
    row[l] = common + static_cast<Index>(same_begin - t.begin[l]) * common_size;
  }
  for (int j = same_begin; j < same_end; ++j) {
    put(j);
    for (int l = 0; l < tile_width; ++l) row[l] += common_size;
  }
  put_any(same_end, to);
  for (int l = 0; l < tile_width; ++l) {
    if (!t.has(l)) continue;
    for (int reach = 3; reach >= 1; --reach) {
      const int j = t.end[l] + 4 - reach;
      if (j < from || j >= to) continue;
      Real* out = place(j) + l;
      const Real* before = out - static_cast<Index>(size) * tile_width;
      const double pivot = 1.0 / (1.0 - e.alpha[reach] * before[last * tile_width]);
      for (int c = 0; c < Weights; ++c) out[c * tile_width] = rounded(pivot * e.weights[reach][c]);
      out[Weights * tile_width] = rounded(e.alpha[reach] * pivot);
      out[last * tile_width] = rounded(reach > 1 ? e.alpha[reach] * pivot : 0.0);
    }
  }
}

/// Faces whose rows differ by lane: [-3, low_end) and [high_begin, n + 4); between them all lanes
/// have the common rows of an elimination that has settled. Where the zones meet, the low one is
/// all.
struct Zones {
  int low_end, high_begin;
  OCU_INLINE Zones(const AlignedLanes& t, int settled)
      : low_end(t.last_begin > 0 ? t.last_begin + settled : -3), high_begin(t.first_end) {
    if (low_end > high_begin) low_end = high_begin = t.n + 4;
  }
};

/// Whether a node of the batch takes first-order fluxes.
template <int D>
OCU_INLINE bool any_marked(const Context& ctx, const AlignedLanes& t, int across) {
  if (!ctx.any_mark) return false;
  for (int l = 0; l < tile_width; ++l) {
    if (!t.has(l)) continue;
    const int line = t.i0 + l, at = t.first + t.begin[l];
    const std::uint8_t* mark = ctx.mark + (D == 0 ? mark_at(ctx, at, line, across)
                                                  : (D == 1 ? mark_at(ctx, line, at, across)
                                                            : mark_at(ctx, line, across, at)));
    const Index step = D == 0 ? 1 : (D == 1 ? mark_row(ctx) : mark_row(ctx) * ctx.mask_rows);
    for (int u = t.begin[l]; u < t.end[l]; ++u, mark += step) {
      if (*mark != 0) return true;
    }
  }
  return false;
}

/// Scratch: faces, nodes (or the filter's pencil), rows of the zones, results of x-lines.
OCU_INLINE Index aligned_doubles(const Context& ctx) {
  return face_doubles(ctx) / (largest_face_record * tile_width) * tile_width *
             (node_record + filter_class_size) +
         face_doubles(ctx) + (node_record + filter_class_size) * 32 * tile_width +
         tile_width * 5 * tile_width;
}

/// Adds the divergence along x to the rows of X, tile by tile as the nodes come, descending.
class XSink {
 public:
  OCU_INLINE XSink(const Context& ctx, const AlignedLanes& t, int k, Real* block)
      : t_(t), sf_(ctx.X.sf), block_(block) {
    rows_of_lanes(ctx, ctx.X, t, k, row_);
  }
  OCU_INLINE void operator()(int u, const Vec div[5]) {
    const int i = t_.first + u, within = i % tile_width;
    if (u == t_.n - 1) clear();
    const unsigned lanes = t_.at(u);
    for (int f = 0; f < 5; ++f)
      store(block_ + (within * 5 + f) * tile_width, select(lanes, div[f], splat(0.0)));
    if (within != 0 && u != 0) return;
    const int i0 = i - within;
    for (int f = 0; f < 5; ++f) {
      Vec sum[tile_width];
      for (int m = 0; m < tile_width; m += 4) load_four_columns(row_, f * sf_ + i0 + m, sum + m);
      for (int m = 0; m < tile_width; ++m) sum[m] += load(block_ + (m * 5 + f) * tile_width);
      store_columns(row_, f * sf_ + i0, sum, t_.used);
    }
    clear();
  }

 private:
  OCU_INLINE void clear() {
    for (int v = 0; v < 5 * tile_width; ++v) store(block_ + v * tile_width, splat(0.0));
  }
  const AlignedLanes& t_;
  Index sf_;
  Real* block_;
  Real* row_[tile_width];
};

/// What is asked for while the batch is solved: along z the sums it adds to, which lie a plane
/// apart where the machine sees no stream, and the nodes of the next batch.
template <int D>
class AlignedAhead {
 public:
  OCU_INLINE AlignedAhead(const Context& ctx, const AlignedLanes& t, int across,
                          const SegmentBatch* next) {
    if constexpr (D > 0) {
      if (D == 2) sum_ = ctx.R.data + aligned_place<D>(ctx.R, t, across, 0);
      sum_field_ = ctx.R.sf;
      sum_step_ = ctx.R.sk;
      nodes_ = t.n;
      if (next == nullptr || !next->aligned) return;
      int first = next->begin[0], stop = 0;
      for (int l = 0; l < next->lanes; ++l) {
        first = next->begin[l] < first ? next->begin[l] : first;
        stop = next->begin[l] + next->length[l] > stop ? next->begin[l] + next->length[l] : stop;
      }
      const int i0 = next->b[0] - next->b[0] % tile_width, c = next->c[0];
      const Block& w = ctx.W;
      next_ = w.data + (D == 1 ? i0 + first * w.sj + c * w.sk : i0 + c * w.sj + first * w.sk);
      field_ = w.sf;
      step_ = D == 1 ? w.sj : w.sk;
      next_nodes_ = stop - first;
    }
  }
  /// While nodes [begin, end) of this batch are taken.
  OCU_INLINE void prefetch(int begin, int end) const {
    for (int u = begin; u < end; ++u) {
      if (sum_ != nullptr && u >= 0 && u < nodes_)
        prefetch_rows(sum_ + u * sum_step_, sum_field_, 5, 1);
      if (next_ != nullptr && u < next_nodes_ + 4)
        prefetch_rows(next_ + u * step_, field_, aligned_record, 1);
    }
  }

 private:
  const Real *sum_ = nullptr, *next_ = nullptr;
  Index sum_field_ = 0, sum_step_ = 0, field_ = 0, step_ = 0;
  int nodes_ = 0, next_nodes_ = 0;
};

/// X (R along z) += divergence of the flux along the batch's segments. False: a node is marked,
/// nothing was done. `next`: the batch that comes after, or null.
template <int D, bool Eight>
[[gnu::noinline]] bool sweep_aligned(const Context& shared, Real* scratch, const SegmentBatch& s,
                                     const SegmentBatch* next) {
  const Context ctx = shared;  // a copy: vector stores could alias the shared one
  const AlignedLanes t(s);
  const int across = s.c[0];
  if (any_marked<D>(ctx, t, across)) return false;
  Real* buf = face_zero(scratch);
  Real* nodes = scratch + face_doubles(ctx) + 8 * aligned_record * tile_width;
  Real* rows = nodes + static_cast<Index>(t.n + 8) * aligned_record * tile_width;
  load_aligned<D>(ctx, t, across, nodes);

  const LineView& common = ctx.from_ghost[D];
  const Real* spacing = ctx.line[D].inverse_face_spacing + t.first;
  const Real* inverse_h = ctx.line[D].inverse_jacobian + t.first;
  const Zones zone(t, settled_face);
  zone_rows<flux_weights>(common.flux, ctx.flux_end, t, -3, zone.low_end, rows);
  Real* high_rows = rows + static_cast<Index>(zone.low_end + 3) * flux_class_size * tile_width;
  // The first row of the zone is an inner one; the elimination goes on from there.
  zone_rows<flux_weights>(common.flux, ctx.flux_end, t, zone.high_begin, t.n + 4, high_rows);
  const ZoneCoef low{rows, -3, spacing, inverse_h},
      high{high_rows, zone.high_begin, spacing, inverse_h};
  const UniformCoef middle{common.flux, spacing, inverse_h};
  const bool has_high = zone.high_begin < t.n + 4;

  constexpr Index step = aligned_record * tile_width;
  constexpr int lag = Eight ? 2 : 1;
  const Source src{nodes, tile_width, step, nullptr, {}, step};
  const GasVec gas(ctx);
  const Walk walk = walk_of<Eight>(t.n, -3, t.n + 3);
  Forward<no_viscosity, Eight> forward;
  start_forward<D>(forward, gas, src, walk.first, walk.missing_low);
  int node = walk.first;
  const AlignedAhead<D> ahead(ctx, t, across, next);
  const auto walk_to = [&](int face, const auto& coef) {
    const int stop = face + lag < walk.last + 1 ? face + lag : walk.last + 1;
    while (node < stop) {
      const int end = node + column_walk < stop ? node + column_walk : stop;
      ahead.prefetch(node, end);
      forward_nodes<D>(forward, gas, src, node, end, coef, buf);
      node = end;
    }
  };
  walk_to(zone.low_end, low);
  walk_to(zone.high_begin, middle);
  if (has_high) walk_to(t.n + 4, high);
  if (has_high)
    end_forward<D>(forward, walk.last, walk.missing_high, high, buf);
  else
    end_forward<D>(forward, walk.last, walk.missing_high, low, buf);

  const auto solve_back = [&](auto& sink) {
    Backward back;
    if (has_high)
      start_backward<D, no_viscosity>(back, t.n, t.n + 3, high, buf);
    else
      start_backward<D, no_viscosity>(back, t.n, t.n + 3, low, buf);
    int top = t.n - 1;
    const auto walk_back = [&](int face, const auto& coef) {
      const int stop = face > 0 ? face : 0;
      if (top >= stop) backward_nodes<D, no_viscosity>(back, top, stop, coef, buf, sink);
      top = stop - 1 < top ? stop - 1 : top;
    };
    walk_back(zone.high_begin, high);
    walk_back(zone.low_end, middle);
    walk_back(0, low);
  };
  if constexpr (D == 0) {
    XSink sink(ctx, t, across, rows + static_cast<Index>(t.n + 40) * flux_class_size * tile_width);
    solve_back(sink);
  } else {
    const Block& to = D == 1 ? ctx.X : ctx.R;
    auto sink = [&](int u, const Vec div[5]) OCU_FORCE {
      Real* r = to.data + aligned_place<D>(to, t, across, u);
      const unsigned lanes = t.at(u);
      for (int f = 0; f < 5; ++f) {
        store(r + f * to.sf, load(r + f * to.sf) + select(lanes, div[f], splat(0.0)));
      }
    };
    solve_back(sink);
  }
  return true;
}

}  // namespace ocublast::flow::OCU_ISA
