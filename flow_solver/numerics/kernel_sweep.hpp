#pragma once

// Sweeps over whole lines of a direction, a tile at a time: x through a transposed block of its
// nodes, y straight from the rows. z is part of the update (kernel_update.hpp).

#include "flow_solver/numerics/kernel_marked.hpp"

namespace ocublast::flow::inline OCU_PRECISION::OCU_ISA {

/// Vectors per node in a transposed block: primitives, bulk, kappa, mu (cut lines), four gradients
/// or stresses.
inline constexpr int node_record = 12;
inline constexpr int node_mu = 7;
inline constexpr int node_gradient = 8;

OCU_INLINE Index face_doubles(const Context& ctx) {
  const int a = ctx.n[0] > ctx.n[1] ? ctx.n[0] : ctx.n[1];
  const int longest = a > ctx.n[2] ? a : ctx.n[2];
  return static_cast<Index>(longest + 24) * largest_face_record * tile_width;
}
/// Face 0 of the buffer at the head of the scratch.
OCU_INLINE Real* face_zero(Real* scratch) {
  return scratch + face_margin * largest_face_record * tile_width;
}

OCU_INLINE Index mark_row(const Context& ctx) {
  return static_cast<Index>(ctx.mask_tiles) * tile_width;
}
OCU_INLINE Index mark_at(const Context& ctx, int i, int j, int k) {
  return (static_cast<Index>(k) * ctx.mask_rows + j) * mark_row(ctx) + i;
}
OCU_INLINE Index tile_at(const Context& ctx, int tile, int j, int k) {
  return (static_cast<Index>(k) * ctx.mask_rows + j) * ctx.mask_tiles + tile;
}

OCU_INLINE UniformCoef uniform_coef(const LineView& line) {
  return {line.flux, line.inverse_face_spacing, line.inverse_jacobian};
}

/// Number of the group of tile_width lines along D through node (i, j, k), as in
/// Context::line_marked.
template <int D>
OCU_INLINE Index line_group(const Context& ctx, int i, int j, int k) {
  if (D == 0) return static_cast<Index>(k) * ctx.mask_groups + j / tile_width;
  return static_cast<Index>(D == 1 ? k : j) * ctx.mask_tiles + i / tile_width;
}

/// Lanes of a group of whole lines along axis D; first lane at node (i, j, k), next lane along x (y
/// and z lines) or along y (x-lines).
template <int D>
OCU_INLINE Lanes whole_lanes(const Context& ctx, int i, int j, int k, unsigned active) {
  Lanes s;
  const Block& q = ctx.Q;
  const Block& w = ctx.W;
  s.qf = q.sf;
  s.ql = D == 0 ? 1 : (D == 1 ? q.sj : q.sk);
  s.ml = D == 0 ? 1 : (D == 1 ? mark_row(ctx) : mark_row(ctx) * ctx.mask_rows);
  const Index wl = D == 0 ? 1 : (D == 1 ? w.sj : w.sk);
  s.active = active;
  const Index group = line_group<D>(ctx, i, j, k);
  if (ctx.line[D].known_low.marked != nullptr) s.low_marked = ctx.line[D].known_low.marked[group];
  if (ctx.line[D].known_high.marked != nullptr)
    s.high_marked = ctx.line[D].known_high.marked[group];
  for (int l = 0; l < tile_width; ++l) {
    int ii = i, jj = j;
    if (D == 0)
      jj = j + l < ctx.n[1] ? j + l : ctx.n[1] - 1;
    else
      ii = i + l;
    s.q[l] = q.data + ii + jj * q.sj + k * q.sk;
    s.mark[l] = ctx.mark + mark_at(ctx, ii, jj, k);
    s.n[l] = ctx.n[D];
    s.low[l] = ctx.line[D].periodic ? LaneEnd::periodic : ctx.line[D].low;
    s.high[l] = ctx.line[D].periodic ? LaneEnd::periodic : ctx.line[D].high;
    const Real* node = w.data + ii + jj * w.sj + k * w.sk;
    s.low_state[l] = node - wl;
    s.high_state[l] = node + ctx.n[D] * wl;
    s.low_stride[l] = s.high_stride[l] = w.sf;
    if (ctx.line[D].known_low.flux != nullptr) s.low[l] = LaneEnd::neighbour;
    if (ctx.line[D].known_high.flux != nullptr) s.high[l] = LaneEnd::neighbour;
    if (s.low[l] == LaneEnd::held_wall) s.low_state[l] = ctx.line[D].wall_low.velocity;
    if (s.high[l] == LaneEnd::held_wall) s.high_state[l] = ctx.line[D].wall_high.velocity;
  }
  return s;
}

/// Bits of the rows (j0 + l < n) or columns that exist.
OCU_INLINE unsigned existing(int first, int n) {
  const int count = n - first;
  return count >= tile_width ? all_lanes : (1u << count) - 1u;
}

/// Four nodes of one field of a tile of x-lines to one vector per node.
OCU_INLINE void rows_to_nodes(const Real* const row[tile_width], Index offset, Real* out,
                              Index step) {
  Vec r[4];
  load_four_columns(row, offset, r);
  for (int a = 0; a < 4; ++a) store(out + a * step, r[a]);
}

/// Nodes i0 + [first, last) of a tile, rounded outwards to fours.
template <int Visc>
OCU_INLINE void load_x_block(const Context& ctx, const Real* const row[tile_width],
                             const Real* const g_row[tile_width], int i0, int first, int last,
                             Real* block) {
  constexpr Index step = node_record * tile_width;
  const auto bring = [&](const Real* const rows[tile_width], Index field, int slot) OCU_FORCE {
    for (int a = first / 4 * 4; a < last; a += 4) {
      rows_to_nodes(rows, field + i0 + a, block + a * step + slot * tile_width, step);
    }
  };
  for (int f = 0; f <= field_kappa; ++f) bring(row, f * ctx.W.sf, f);
  if constexpr (Visc == nodal_viscosity) {
    for (int q = 0; q < 4; ++q) bring(g_row, stress_component[0][q] * ctx.G.sf, node_gradient + q);
  }
}

/// Rows of a group of x-lines, and those that come one group later: one row later still, as the
/// dilatation of a group looks at the row behind it. After the last row come the first ones of the
/// next plane.
struct XRows {
  Real* r[tile_width];
  const Real* w[tile_width];
  const Real* g[tile_width];
  const Real* next[tile_width];
  Index sk, lines,
      parts;  ///< of the primitives: stride of planes, cache lines of a row, blocks of a walk
  OCU_INLINE XRows(const Context& ctx, int k, int j0, int last)
      : sk(ctx.present[2] ? ctx.W.sk : 0),
        lines((n_stage_fields - 1) * ctx.W.sf / tile_width),
        parts(last / tile_width + 2) {
    for (int l = 0; l < tile_width; ++l) {
      const int j = j0 + l < ctx.n[1] ? j0 + l : ctx.n[1] - 1, later = j0 + tile_width + 1 + l;
      r[l] = ctx.X.data + j * ctx.X.sj + k * ctx.X.sk;
      w[l] = ctx.W.data + j * ctx.W.sj + k * ctx.W.sk;
      g[l] = ctx.G.data == nullptr ? nullptr : ctx.G.data + j * ctx.G.sj + k * ctx.G.sk;
      next[l] = ctx.W.data +
                (later < ctx.n[1] ? later * ctx.W.sj : (later - ctx.n[1]) * ctx.W.sj + ctx.W.sk) +
                k * ctx.W.sk - tile_width;
    }
  }
  /// Asks for block `part` of the later rows, line after line: the machine's own prefetcher sees
  /// streams. Of the planes around it the dilatation takes the third velocity.
  OCU_INLINE void prefetch(int part, Index sf) const {
    const Index begin = lines * part / parts, end = lines * (part + 1) / parts;
    for (int l = 0; l < tile_width; ++l) {
      for (Index q = begin; q < end; ++q) __builtin_prefetch(next[l] + q * tile_width, 0, 2);
      if (sk == 0) continue;
      const Real* w3 = next[l] + part * tile_width + 3 * sf;
      __builtin_prefetch(w3 + sk, 0, 2);
      __builtin_prefetch(w3 - sk, 0, 2);
    }
  }
};

template <int Visc, bool Eight>
void sweep_x_group(const Context& shared, Real* scratch, int k, int group) {
  const Context ctx = shared;  // a copy: vector stores could alias the shared one
  const LineView& line = ctx.line[0];
  const int n = ctx.n[0], j0 = group * tile_width;
  const unsigned rows = existing(j0, ctx.n[1]);
  const Index flag = static_cast<Index>(k) * ctx.mask_groups + group;
  const unsigned cut = ctx.bodies ? ctx.cut[0][flag] : 0u;
  const Walk walk = walk_of<Eight>(n, line.face_begin, line.face_end);
  const XRows row(ctx, k, j0, walk.last);
  if ((cut & rows) == rows) {
    for (int l = 0; l < tile_width && ((rows >> l) & 1u) != 0; ++l) {
      for (int f = 0; f < 5; ++f) {
        for (int t = 0; t < ctx.tiles; ++t)
          store(row.r[l] + f * ctx.X.sf + t * tile_width, splat(0.0));
      }
    }
    for (Index part = 0; part < row.parts; ++part) row.prefetch(static_cast<int>(part), ctx.W.sf);
    return;
  }
  Real* buf = face_zero(scratch);
  Real* block = scratch + face_doubles(ctx);
  constexpr Index step = node_record * tile_width;
  const UniformCoef coef = uniform_coef(line);
  const GasVec gas(ctx);
  Forward<Visc, Eight> forward;
  bool started = false;
  for (int i0 = -tile_width; i0 <= walk.last; i0 += tile_width) {
    const int begin = i0 > walk.first ? i0 : walk.first;
    const int end = i0 + tile_width <= walk.last ? i0 + tile_width : walk.last + 1;
    load_x_block<Visc>(ctx, row.w, row.g, i0, begin - i0, end - i0, block);
    row.prefetch(i0 / tile_width + 1, ctx.W.sf);
    const Real* base = block - i0 * step;
    Source src{base, tile_width, step, nullptr, {}, step};
    src.face_heat = !ctx.paper;
    for (int q = 0; q < 4; ++q) src.g[q] = base + (node_gradient + q) * tile_width;
    if (!started) {
      start_forward<0>(forward, gas, src, walk.first, walk.missing_low);
      start_known(line.known_low.flux, line.known_low.flux_faces, flag, forward.face);
    }
    started = true;
    forward_nodes<0>(forward, gas, src, begin, end, coef, buf);
  }
  end_forward<0>(forward, walk.last, walk.missing_high, coef, buf);
  store_known_fluxes<face_record<Visc>>(line, n, flag, buf);

  Real* out = block;
  const auto sink = [&](int i, const Vec div[5]) OCU_FORCE {
    Real* at = out + static_cast<Index>(i % tile_width) * 5 * tile_width;
    for (int f = 0; f < 5; ++f) store(at + f * tile_width, div[f]);
    if (i % tile_width != 0) return;
    for (int f = 0; f < 5; ++f) {
      Vec r[tile_width];
      for (int a = 0; a < tile_width; ++a) {
        r[a] = load(out + (static_cast<Index>(a) * 5 + f) * tile_width);
        if (cut != 0) r[a] = select(cut, splat(0.0), r[a]);
      }
      store_columns(row.r, f * ctx.X.sf + i, r, rows);
    }
  };
  const unsigned marked = ctx.any_mark ? ctx.line_marked[0][flag] & rows & ~cut : 0u;
  if (marked == 0 && !line.periodic) {
    backward<0, Visc>(n, line.face_end, coef, buf, sink);
  } else {
    const Lanes lanes = whole_lanes<0>(ctx, 0, j0, k, marked);
    backward_slow<0, Visc>(shared, line, n, line.face_end, coef, buf,
                           marked != 0 ? &lanes : nullptr, sink);
  }
}

/// Where a y or z line of a tile lies in the rows.
template <int D, int Visc>
OCU_INLINE Source whole_source(const Context& ctx, int i0, int j, int k) {
  const Block& w = ctx.W;
  const Real* base = w.data + i0 + j * w.sj + k * w.sk;
  Source src{base, w.sf, D == 1 ? w.sj : w.sk, nullptr, {}, 0};
  src.face_heat = !ctx.paper;
  if constexpr (Visc == nodal_viscosity) {
    const Block& g = ctx.G;
    const Real* at = g.data + i0 + j * g.sj + k * g.sk;
    src.gl = D == 1 ? g.sj : g.sk;
    for (int q = 0; q < 4; ++q) src.g[q] = at + stress_component[D][q] * g.sf;
  }
  return src;
}

/// One column of tiles along y or z.
struct Column {
  int i0, tile;
  int j, k;            ///< its row or plane; 0 along the column
  unsigned cut;        ///< lanes whose line is cut
  unsigned marked;     ///< lanes with first-order faces
  bool solved;         ///< whether any lane's line is whole
  bool plain;          ///< no marks and no periodic ends in it: the fast backward pass
  Real *buf, *pencil;  ///< scratch: faces, and along z the new state in the last stage (or null)
};

/// Columns that are swept together, and the nodes that one of them walks before the next one goes
/// on: a single column takes one cache line of every row, and rows lie a page or more apart, which
/// the memory delivers at a third of its speed.
inline constexpr int column_group = 4;
inline constexpr int column_walk = 8;

/// Asks for `fields` of the rows of `columns` tiles from node p on.
OCU_INLINE void prefetch_rows(const Real* p, Index sf, int fields, int columns) {
  for (int f = 0; f < fields; ++f) {
    for (int t = 0; t < columns; ++t) __builtin_prefetch(p + f * sf + t * tile_width, 0, 2);
  }
}

/// Forward part of neighbouring columns along D, straight from the rows.
template <int D, int Visc, bool Eight>
[[gnu::noinline]] void forward_columns(const Context& shared, const Column* cols, int count) {
  const Context ctx = shared;  // a copy: vector stores could alias the shared one
  const LineView& line = ctx.line[D];
  const GasVec gas(ctx);
  const UniformCoef coef = uniform_coef(line);
  const Walk walk = walk_of<Eight>(ctx.n[D], line.face_begin, line.face_end);
  Forward<Visc, Eight> state[column_group];
  const Source rows = whole_source<D, Visc>(ctx, cols[0].i0, cols[0].j, cols[0].k);
  for (int n0 = walk.first; n0 <= walk.last; n0 += column_walk) {
    const int n1 = n0 + column_walk <= walk.last ? n0 + column_walk : walk.last + 1;
    for (int t = 0; t < count; ++t) {
      for (int n = n0 + column_walk + t; n < n1 + column_walk && n <= walk.last; n += count) {
        prefetch_rows(rows.p + n * rows.sl, rows.sf, field_kappa + 1, count);
      }
      if (!cols[t].solved) continue;
      const Source src = whole_source<D, Visc>(ctx, cols[t].i0, cols[t].j, cols[t].k);
      if (n0 == walk.first) {
        start_forward<D>(state[t], gas, src, walk.first, walk.missing_low);
        start_known(line.known_low.flux, line.known_low.flux_faces,
                    line_group<D>(ctx, cols[t].i0, cols[t].j, cols[t].k), state[t].face);
      }
      forward_nodes<D>(state[t], gas, src, n0, n1, coef, cols[t].buf);
    }
  }
  for (int t = 0; t < count; ++t) {
    if (!cols[t].solved) continue;
    end_forward<D>(state[t], walk.last, walk.missing_high, coef, cols[t].buf);
    store_known_fluxes<face_record<Visc>>(
        line, ctx.n[D], line_group<D>(ctx, cols[t].i0, cols[t].j, cols[t].k), cols[t].buf);
  }
}

/// R = X + div of node j of a y column; div is zero on cut lanes.
OCU_INLINE void add_y(const Context& ctx, const Column& col, int j, const Vec div[5]) {
  Real* at = ctx.R.data + col.i0 + j * ctx.R.sj + col.k * ctx.R.sk;
  const Real* from = ctx.X.data + col.i0 + j * ctx.X.sj + col.k * ctx.X.sk;
  for (int f = 0; f < 5; ++f) {
    const Vec d = col.cut != 0 ? select(col.cut, splat(0.0), div[f]) : div[f];
    const Vec sum = load(from + f * ctx.X.sf) + d;
    if (ctx.stream)
      store_past_caches(at + f * ctx.R.sf, sum);
    else
      store(at + f * ctx.R.sf, sum);
  }
}

/// Backward pass of neighbouring y columns.
template <int Visc>
[[gnu::noinline]] void backward_y(const Context& shared, const Column* cols, int count) {
  const Context ctx = shared;
  const LineView& line = ctx.line[1];
  const UniformCoef coef = uniform_coef(line);
  const int n = ctx.n[1];
  Backward state[column_group];
  for (int t = 0; t < count; ++t) {
    if (cols[t].plain) start_backward<1, Visc>(state[t], n, line.face_end, coef, cols[t].buf);
  }
  for (int high = n - 1; high >= 0; high -= column_walk) {
    const int low = high - column_walk + 1 > 0 ? high - column_walk + 1 : 0;
    for (int t = 0; t < count; ++t) {
      const Column& col = cols[t];
      if (!col.plain) continue;
      backward_nodes<1, Visc>(state[t], high, low, coef, col.buf,
                              [&](int j, const Vec div[5]) OCU_FORCE { add_y(ctx, col, j, div); });
    }
  }
}

/// The same of one column that is all cut, or with marks or periodic ends.
template <int Visc>
[[gnu::noinline]] void backward_y_slow(const Context& ctx, const Column& col) {
  const LineView& line = ctx.line[1];
  const auto sink = [&](int j, const Vec div[5]) { add_y(ctx, col, j, div); };
  if (!col.solved) {
    const Vec zero[5] = {splat(0.0), splat(0.0), splat(0.0), splat(0.0), splat(0.0)};
    for (int j = 0; j < ctx.n[1]; ++j) sink(j, zero);
    return;
  }
  const Lanes lanes = whole_lanes<1>(ctx, col.i0, 0, col.k, col.marked);
  backward_slow<1, Visc>(ctx, line, ctx.n[1], line.face_end, uniform_coef(line), col.buf,
                         col.marked != 0 ? &lanes : nullptr, sink);
}

template <int Visc, bool Eight>
void sweep_y_tiles(const Context& ctx, Real* scratch, int k, int tile, int count) {
  Column cols[column_group];
  for (int t = 0; t < count; ++t) {
    Column col{};
    col.tile = tile + t;
    col.i0 = col.tile * tile_width;
    col.k = k;
    const Index flag = static_cast<Index>(k) * ctx.mask_tiles + col.tile;
    const unsigned columns = existing(col.i0, ctx.n[0]);
    col.cut = ctx.bodies ? ctx.cut[1][flag] : 0u;
    col.marked = ctx.any_mark ? ctx.line_marked[1][flag] & columns & ~col.cut : 0u;
    col.solved = (col.cut & columns) != columns;
    col.buf = face_zero(scratch + t * face_doubles(ctx));
    col.plain = col.solved && col.marked == 0 && !ctx.line[1].periodic;
    cols[t] = col;
  }
  forward_columns<1, Visc, Eight>(ctx, cols, count);
  backward_y<Visc>(ctx, cols, count);
  for (int t = 0; t < count; ++t) {
    if (!cols[t].plain) backward_y_slow<Visc>(ctx, cols[t]);
  }
}

/// Picks the instantiation for the options of a run.
#define OCU_VARIANT(ctx, call, ...)                \
  do {                                             \
    if ((ctx).nodal_stress) {                      \
      if ((ctx).eighth_order)                      \
        call<nodal_viscosity, true>(__VA_ARGS__);  \
      else                                         \
        call<nodal_viscosity, false>(__VA_ARGS__); \
    } else {                                       \
      if ((ctx).eighth_order)                      \
        call<no_viscosity, true>(__VA_ARGS__);     \
      else                                         \
        call<no_viscosity, false>(__VA_ARGS__);    \
    }                                              \
  } while (false)

inline void sweep_x(const Context& ctx, Real* scratch, int k, int g0, int g1) {
  for (int g = g0; g < g1; ++g) OCU_VARIANT(ctx, sweep_x_group, ctx, scratch, k, g);
}

/// Calls sweep(first, count) for groups of nearly equal size of the tiles [t0, t1).
template <class Sweep>
OCU_INLINE void by_column_groups(int t0, int t1, Sweep&& sweep) {
  const int groups = (t1 - t0 + column_group - 1) / column_group;
  for (int g = 0; g < groups; ++g) {
    const int first = t0 + g * (t1 - t0) / groups;
    sweep(first, t0 + (g + 1) * (t1 - t0) / groups - first);
  }
}

inline void sweep_y(const Context& ctx, Real* scratch, int k, int t0, int t1) {
  by_column_groups(t0, t1, [&](int first, int count) {
    OCU_VARIANT(ctx, sweep_y_tiles, ctx, scratch, k, first, count);
  });
  if (ctx.stream) _mm_sfence();
}

}  // namespace ocublast::flow::OCU_ISA
