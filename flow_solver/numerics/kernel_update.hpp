#pragma once

// z sweep, Runge-Kutta update, primitives and positivity test of one tile column; in the last stage
// also the filter along z, while the new state is still in the pencil buffer.

#include "flow_solver/numerics/kernel_filter.hpp"

namespace ocublast::flow::OCU_ISA {

// Classical fourth-order Runge-Kutta: q = q^n - a dt R, sum of w R.
inline constexpr double stage_a[4] = {0.5, 0.5, 1.0, 0.0};
inline constexpr double stage_w[4] = {1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0};

[[gnu::noinline]] inline long note_failures(const Context& ctx, unsigned bad, int i0, int j, int k) {
  long count = 0;
  for (int l = 0; l < tile_width; ++l) {
    if (((bad >> l) & 1u) == 0) continue;
    ctx.failed[mark_at(ctx, i0 + l, j, k)] = 1;
    ++count;
  }
  return count;
}

/// Primitives of conserved q into W where the mask is set; tests density and pressure against the
/// old values there. Returns the bits of failed lanes.
OCU_INLINE unsigned store_primitives(const Context& ctx, const Vec q[5], double* w, unsigned fluid,
                                     bool test) {
  const Vec inverse = splat(1.0) / q[0];
  const Vec u = q[1] * inverse, v = q[2] * inverse, ww = q[3] * inverse;
  const Vec kinetic = splat(0.5) * (q[1] * u + q[2] * v + q[3] * ww);
  const Vec p = splat(ctx.gamma - 1.0) * (q[4] - kinetic);
  const Vec T = p * (inverse * splat(1.0 / ctx.gas_constant));
  const Index sf = ctx.W.sf;
  const Vec old_rho = load(w), old_T = load(w + 4 * sf);
  unsigned bad = 0;
  if (test) {
    const Vec limit = splat(ctx.drop_limit) * old_rho;
    const Vec p_limit = limit * (old_T * splat(ctx.gas_constant));
    bad = (not_at_least(q[0], vmax(limit, splat(ctx.floor_rho))) |
           not_at_least(p, vmax(p_limit, splat(ctx.floor_p)))) & fluid;
  }
  const Vec out[5] = {q[0], u, v, ww, T};
  if (fluid == 0xffu) {
    for (int f = 0; f < 5; ++f) store(w + f * sf, out[f]);
  } else {
    for (int f = 0; f < 5; ++f) store(w + f * sf, select(fluid, out[f], load(w + f * sf)));
  }
  return bad;
}

/// One node vector of the update; R is the whole divergence. `line` receives the new state of the
/// last stage (or null: to A).
OCU_INLINE unsigned update_node(const Context& ctx, int i0, int tile, int j, int k, Vec R[5], double* line) {
  const unsigned fluid = ctx.fluid[tile_at(ctx, tile, j, k)];
  if (fluid != 0xffu) {
    for (int f = 0; f < 5; ++f) R[f] = select(fluid, R[f], splat(0.0));
  }
  double* a = ctx.A.data + i0 + j * ctx.A.sj + k * ctx.A.sk;
  const double* qn = ctx.Q.data + i0 + j * ctx.Q.sj + k * ctx.Q.sk;
  Vec q[5];
  if (ctx.stage == 3) {
    const Vec dt = splat(ctx.dt), w = splat(stage_w[3]);
    for (int f = 0; f < 5; ++f) {
      q[f] = load(qn + f * ctx.Q.sf) - dt * (load(a + f * ctx.A.sf) + w * R[f]);
      store(line != nullptr ? line + f * tile_width : a + f * ctx.A.sf, q[f]);
    }
    return 0;
  }
  const Vec step = splat(stage_a[ctx.stage] * ctx.dt), w = splat(stage_w[ctx.stage]);
  for (int f = 0; f < 5; ++f) {
    q[f] = load(qn + f * ctx.Q.sf) - step * R[f];
    const Vec sum = w * R[f];
    store(a + f * ctx.A.sf, ctx.stage == 0 ? sum : load(a + f * ctx.A.sf) + sum);
  }
  return store_primitives(ctx, q, ctx.W.data + i0 + j * ctx.W.sj + k * ctx.W.sk, fluid, true);
}

/// Ghost values of the bulk pressure beyond the z ends: mirrored at walls and planes of symmetry,
/// repeated if periodic, else the end value.
OCU_INLINE void fill_bulk_ghosts_z(const Context& ctx, int i0, int j) {
  const int n = ctx.n[2];
  const Block& w = ctx.W;
  double* at = w.data + field_bulk * w.sf + i0 + j * w.sj;
  const LineView& line = ctx.line[2];
  for (int m = 0; m < 4; ++m) {
    int low = 0, high = n - 1;
    if (line.periodic) {
      low = n - 1 - m;
      high = m;
    } else {
      if (line.low != LaneEnd::domain_ghost) low = m;
      if (line.high != LaneEnd::domain_ghost) high = n - 1 - m;
    }
    store(at + (-1 - m) * w.sk, load(at + low * w.sk));
    store(at + (n + m) * w.sk, load(at + high * w.sk));
  }
}

template <int Visc, bool Eight>
void update_column(const Context& shared, double* scratch, int j, int tile, long& failures) {
  const Context ctx = shared;  // a copy: vector stores could alias the shared one
  const int i0 = tile * tile_width;
  const int n = ctx.n[2];
  const bool last = ctx.stage == 3;
  if (!ctx.present[2]) {
    Vec R[5];
    const double* r = ctx.R.data + i0 + j * ctx.R.sj;
    for (int f = 0; f < 5; ++f) R[f] = load(r + f * ctx.R.sf);
    const unsigned bad = update_node(ctx, i0, tile, j, 0, R, nullptr);
    if (bad != 0) failures += note_failures(shared, bad, i0, j, 0);
    return;
  }
  const LineView& line = ctx.line[2];
  const Index flag = static_cast<Index>(j) * ctx.mask_tiles + tile;
  const unsigned columns = existing(i0, ctx.n[0]);
  const unsigned cut = ctx.bodies ? ctx.cut[2][flag] : 0u;
  double* buf = face_zero(scratch);
  double* pencil = scratch + face_doubles(ctx) + 4 * 5 * tile_width;  // node 0 of the filter's line
  const bool to_pencil = last && ctx.filter;
  const double* r = ctx.R.data + i0 + j * ctx.R.sj;
  // The next column: its lines lie a plane apart, out of reach of the hardware's prefetcher.
  const bool last_tile = tile + 1 == ctx.tiles;
  const Index next_r = last_tile ? ctx.R.sj - i0 : tile_width;
  const Index next_q = last_tile ? ctx.Q.sj - i0 : tile_width;
  const Index next_a = last_tile ? ctx.A.sj - i0 : tile_width;
  const auto sink = [&](int k, const Vec div[5]) OCU_FORCE {
    Vec R[5];
    const double* at = r + k * ctx.R.sk;
    prefetch_next(at + next_r, ctx.R.sf, 5);
    prefetch_next(ctx.Q.data + i0 + next_q + j * ctx.Q.sj + k * ctx.Q.sk, ctx.Q.sf, 5);
    prefetch_next(ctx.A.data + i0 + next_a + j * ctx.A.sj + k * ctx.A.sk, ctx.A.sf, 5);
    for (int f = 0; f < 5; ++f) {
      const Vec d = cut != 0 ? select(cut, splat(0.0), div[f]) : div[f];
      R[f] = load(at + f * ctx.R.sf) + d;
    }
    const unsigned bad =
        update_node(ctx, i0, tile, j, k, R, to_pencil ? pencil + static_cast<Index>(k) * 5 * tile_width : nullptr);
    if (bad != 0) failures += note_failures(shared, bad, i0, j, k);
  };
  const unsigned marked = ctx.any_mark ? ctx.line_marked[2][flag] & columns & ~cut : 0u;
  if ((cut & columns) == columns) {
    const Vec zero[5] = {splat(0.0), splat(0.0), splat(0.0), splat(0.0), splat(0.0)};
    for (int k = n - 1; k >= 0; --k) sink(k, zero);
  } else {
    if (ctx.bulk) fill_bulk_ghosts_z(ctx, i0, j);
    forward_whole<2, Visc, Eight>(ctx, i0, j, 0, buf);
    const UniformCoef coef = uniform_coef(line);
    if (marked == 0 && !line.periodic) {
      backward<2, Visc>(n, line.face_end, coef, buf, sink);
    } else {
      const Lanes lanes = whole_lanes<2>(ctx, i0, j, 0, marked);
      backward_slow<2, Visc>(shared, line, n, line.face_end, coef, buf, marked != 0 ? &lanes : nullptr, sink);
    }
  }
  if (!to_pencil) return;
  if ((cut & columns) != columns) {
    fill_filter_ghosts<2>(ctx, i0, j, 0, pencil);
    const unsigned all_marked = ctx.any_mark ? ctx.line_marked[2][flag] & columns : 0u;
    const Lanes lanes = whole_lanes<2>(ctx, i0, j, 0, all_marked);
    filter_line(line, n, UniformFilter{line.filter, line.face_jacobian, line.inverse_jacobian, ctx.filter_strength}, buf, pencil,
                cut | ~columns, all_marked != 0 ? &lanes : nullptr);
  }
  double* a = ctx.A.data + i0 + j * ctx.A.sj;
  for (int k = 0; k < n; ++k) {
    for (int f = 0; f < 5; ++f) {
      store(a + k * ctx.A.sk + f * ctx.A.sf, load(pencil + (static_cast<Index>(k) * 5 + f) * tile_width));
    }
  }
}

inline long update_row(const Context& ctx, double* scratch, int j) {
  long failures = 0;
  for (int t = 0; t < ctx.tiles; ++t) OCU_VARIANT(ctx, update_column, ctx, scratch, j, t, failures);
  return failures;
}

inline long finish_plane(const Context& shared, int k) {
  const Context ctx = shared;
  long failures = 0;
  for (int j = 0; j < ctx.n[1]; ++j) {
    for (int t = 0; t < ctx.tiles; ++t) {
      const int i0 = t * tile_width;
      const double* a = ctx.A.data + i0 + j * ctx.A.sj + k * ctx.A.sk;
      Vec q[5];
      for (int f = 0; f < 5; ++f) q[f] = load(a + f * ctx.A.sf);
      const unsigned fluid = ctx.fluid[tile_at(ctx, t, j, k)];
      const unsigned bad =
          store_primitives(ctx, q, ctx.W.data + i0 + j * ctx.W.sj + k * ctx.W.sk, fluid, true);
      if (bad != 0) failures += note_failures(shared, bad, i0, j, k);
    }
  }
  return failures;
}

inline void restore_plane(const Context& ctx, int k) {
  for (int j = 0; j < ctx.n[1]; ++j) {
    for (int t = 0; t < ctx.tiles; ++t) {
      const int i0 = t * tile_width;
      const double* s = ctx.Q.data + i0 + j * ctx.Q.sj + k * ctx.Q.sk;
      Vec q[5];
      for (int f = 0; f < 5; ++f) q[f] = load(s + f * ctx.Q.sf);
      static_cast<void>(store_primitives(ctx, q, ctx.W.data + i0 + j * ctx.W.sj + k * ctx.W.sk,
                                         ctx.fluid[tile_at(ctx, t, j, k)], false));
    }
  }
}

}  // namespace ocublast::flow::OCU_ISA
