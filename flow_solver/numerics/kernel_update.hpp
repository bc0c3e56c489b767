#pragma once

// z sweep, Runge-Kutta update, primitives and positivity test of one tile column; in the last stage
// also the filter along z, while the new state is still in the pencil buffer.

#include "flow_solver/numerics/kernel_filter.hpp"

namespace ocublast::flow::inline OCU_PRECISION::OCU_ISA {

// Classical fourth-order Runge-Kutta with stage states q1 .. q3: q(s+1) = q^n - a dt R(q(s)), and
// q^n+1 = (q1 + 2 q2 + q3 - q^n) / 3 - dt/6 R(q3). A holds the bracket, begun in the second stage:
// the first one stores nothing (q1 is known from the primitives), the last one needs no q^n. In
// single precision A holds what the bracket adds to q^n instead: thirds of whole states would move
// gas at rest by a rounding error per step, always the same way.
inline constexpr double stage_a[4] = {0.5, 0.5, 1.0, 1.0 / 6.0};
inline constexpr double third = 1.0 / 3.0;

[[gnu::noinline]] inline long note_failures(const Context& ctx, unsigned bad, int i0, int j,
                                            int k) {
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
OCU_INLINE unsigned store_primitives(const Context& ctx, const Vec q[5], Real* w, unsigned fluid,
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
           not_at_least(p, vmax(p_limit, splat(ctx.floor_p)))) &
          fluid;
  }
  const Vec out[5] = {q[0], u, v, ww, T};
  if (fluid == all_lanes) {
    for (int f = 0; f < 5; ++f) store(w + f * sf, out[f]);
  } else {
    for (int f = 0; f < 5; ++f) store(w + f * sf, select(fluid, out[f], load(w + f * sf)));
  }
  return bad;
}

/// Primitive and conserved places of one node vector.
struct NodePlaces {
  Real *w, *a;
  const Real* q;
  OCU_INLINE NodePlaces(const Context& c, int i0, int j, int k)
      : w(c.W.data + i0 + j * c.W.sj + k * c.W.sk),
        a(c.A.data + i0 + j * c.A.sj + k * c.A.sk),
        q(c.Q.data + i0 + j * c.Q.sj + k * c.Q.sk) {}
};

/// One node vector of the update from the whole divergence R. In the last stage the new state goes
/// to `line` (a pencil's node), or to A if that is null. Returns the bits of failed lanes.
template <int Stage>
OCU_INLINE unsigned update_node(const Context& ctx, const NodePlaces& at, unsigned fluid,
                                const Vec R[5], Real* line) {
  const Vec step = splat(stage_a[Stage] * ctx.dt);
  Vec q[5];
  if constexpr (Stage == 3) {
    for (int f = 0; f < 5; ++f) {
      q[f] = nmadd(step, R[f], load(at.a + f * ctx.A.sf));
      if constexpr (is_single) q[f] = load(at.q + f * ctx.Q.sf) + q[f];
      store(line != nullptr ? line + f * tile_width : at.a + f * ctx.A.sf, q[f]);
    }
    return 0;
  } else {
    Vec q1[5];
    if constexpr (Stage == 1) {
      Vec w[5];
      for (int f = 0; f < 5; ++f) w[f] = load(at.w + f * ctx.W.sf);
      conserved_of(ctx, w, q1);
    }
    for (int f = 0; f < 5; ++f) {
      const Vec qn = load(at.q + f * ctx.Q.sf);
      q[f] = nmadd(step, R[f], qn);
      Real* a = at.a + f * ctx.A.sf;
      if constexpr (Stage == 1) {
        Vec sum;
        if constexpr (is_single)
          sum = splat(third) * nmadd(splat(2.0) * step, R[f], q1[f] - qn);
        else
          sum = splat(third) * (madd(splat(2.0), q[f], q1[f]) - qn);
        // Ghosts of bodies are no state of the stages.
        if (fluid != all_lanes) sum = select(fluid, sum, is_single ? splat(0.0) : qn);
        if (ctx.stream)
          store_past_caches(a, sum);
        else
          store(a, sum);
      }
      if constexpr (Stage == 2) {
        Vec part = is_single ? -(step * R[f]) : q[f];
        if (fluid != all_lanes) part = select(fluid, part, splat(0.0));
        store(a, madd(splat(third), part, load(a)));
      }
    }
    return store_primitives(ctx, q, at.w, fluid, true);
  }
}

/// The same for any stage, with lanes that are no gas: their divergence is taken as zero.
OCU_INLINE unsigned update_masked_node(const Context& ctx, const NodePlaces& at, unsigned fluid,
                                       Vec R[5], Real* line) {
  if (fluid != all_lanes) {
    for (int f = 0; f < 5; ++f) R[f] = select(fluid, R[f], splat(0.0));
  }
  switch (ctx.stage) {
    case 0:
      return update_node<0>(ctx, at, fluid, R, line);
    case 1:
      return update_node<1>(ctx, at, fluid, R, line);
    case 2:
      return update_node<2>(ctx, at, fluid, R, line);
    default:
      return update_node<3>(ctx, at, fluid, R, line);
  }
}

/// Ghost values of the bulk pressure beyond the z ends: mirrored at walls and planes of symmetry,
/// repeated if periodic, else the end value.
OCU_INLINE void fill_bulk_ghosts_z(const Context& ctx, int i0, int j) {
  const int n = ctx.n[2];
  const Block& w = ctx.W;
  Real* at = w.data + field_bulk * w.sf + i0 + j * w.sj;
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

/// Backward pass and update of a stage for columns without marks; cut lanes only take the update.
template <int Visc, int Stage>
[[gnu::noinline]] long backward_columns(const Context& shared, const Column* cols, int count) {
  const Context ctx = shared;  // a copy: vector stores could alias the shared one
  const LineView& line = ctx.line[2];
  const UniformCoef coef = uniform_coef(line);
  const int n = ctx.n[2];
  const Index fluid_step = static_cast<Index>(ctx.mask_rows) * ctx.mask_tiles;
  Backward state[column_group];
  for (int t = 0; t < count; ++t) {
    if (cols[t].solved && cols[t].plain)
      start_backward<2, Visc>(state[t], n, line.face_end, coef, cols[t].buf);
  }
  long failures = 0;
  for (int high = n - 1; high >= 0; high -= column_walk) {
    const int low = high - column_walk + 1 > 0 ? high - column_walk + 1 : 0;
    for (int t = 0; t < count; ++t) {
      const Column& col = cols[t];
      if (!col.plain) continue;
      for (int k = low - 1 - t; k >= 0 && k >= low - column_walk; k -= count) {
        const NodePlaces at(ctx, cols[0].i0, col.j, k);
        prefetch_rows(ctx.R.data + cols[0].i0 + col.j * ctx.R.sj + k * ctx.R.sk, ctx.R.sf, 5,
                      count);
        if constexpr (Stage != 3 || is_single) prefetch_rows(at.q, ctx.Q.sf, 5, count);
        if constexpr (Stage >= 2) prefetch_rows(at.a, ctx.A.sf, 5, count);
      }
      const Real* r = ctx.R.data + col.i0 + col.j * ctx.R.sj;
      const LaneBits* fluid = ctx.fluid + tile_at(ctx, col.tile, col.j, 0);
      const auto sink = [&](int k, const Vec div[5]) OCU_FORCE {
        const Real* rk = r + k * ctx.R.sk;
        Vec R[5];
        for (int f = 0; f < 5; ++f) R[f] = load(rk + f * ctx.R.sf) + div[f];
        const unsigned gas = fluid[k * fluid_step];
        if (col.cut != 0) {
          for (int f = 0; f < 5; ++f) R[f] = select(col.cut, load(rk + f * ctx.R.sf), R[f]);
        }
        if (gas != all_lanes) {
          for (int f = 0; f < 5; ++f) R[f] = select(gas, R[f], splat(0.0));
        }
        Real* to = Stage == 3 && col.pencil != nullptr
                       ? col.pencil + static_cast<Index>(k) * 5 * tile_width
                       : nullptr;
        const unsigned bad = update_node<Stage>(ctx, NodePlaces(ctx, col.i0, col.j, k), gas, R, to);
        if (bad != 0) failures += note_failures(shared, bad, col.i0, col.j, k);
      };
      if (col.solved) {
        backward_nodes<2, Visc>(state[t], high, low, coef, col.buf, sink);
      } else {
        const Vec zero[5] = {splat(0.0), splat(0.0), splat(0.0), splat(0.0), splat(0.0)};
        for (int k = high; k >= low; --k) sink(k, zero);
      }
    }
  }
  return failures;
}

/// The same of one column with marks or periodic ends.
template <int Visc>
[[gnu::noinline]] long backward_column_slow(const Context& ctx, const Column& col) {
  const LineView& line = ctx.line[2];
  const int n = ctx.n[2];
  const Real* r = ctx.R.data + col.i0 + col.j * ctx.R.sj;
  long failures = 0;
  const auto sink = [&](int k, const Vec div[5]) {
    Vec R[5];
    for (int f = 0; f < 5; ++f) {
      R[f] = load(r + k * ctx.R.sk + f * ctx.R.sf) + select(col.cut, splat(0.0), div[f]);
    }
    Real* to =
        col.pencil != nullptr ? col.pencil + static_cast<Index>(k) * 5 * tile_width : nullptr;
    const unsigned bad = update_masked_node(ctx, NodePlaces(ctx, col.i0, col.j, k),
                                            ctx.fluid[tile_at(ctx, col.tile, col.j, k)], R, to);
    if (bad != 0) failures += note_failures(ctx, bad, col.i0, col.j, k);
  };
  const Lanes lanes = whole_lanes<2>(ctx, col.i0, col.j, 0, col.marked);
  backward_slow<2, Visc>(ctx, line, n, line.face_end, uniform_coef(line), col.buf,
                         col.marked != 0 ? &lanes : nullptr, sink);
  return failures;
}

/// Filters the new state in the pencil along z where lines are whole, and stores it.
[[gnu::noinline]] inline void finish_pencil(const Context& shared, const Column& col) {
  const Context ctx = shared;
  const LineView& line = ctx.line[2];
  const int n = ctx.n[2];
  const unsigned columns = existing(col.i0, ctx.n[0]);
  if ((col.cut & columns) != columns) {
    fill_filter_ghosts<2>(ctx, col.i0, col.j, 0, col.pencil);
    const Index flag = static_cast<Index>(col.j) * ctx.mask_tiles + col.tile;
    const unsigned marked = ctx.any_mark ? ctx.line_marked[2][flag] & columns : 0u;
    const Lanes lanes = whole_lanes<2>(ctx, col.i0, col.j, 0, marked);
    filter_line(
        line, n,
        UniformFilter{line.filter, line.face_jacobian, line.inverse_jacobian, ctx.filter_strength},
        col.buf, col.pencil, col.cut | ~columns, marked != 0 ? &lanes : nullptr, flag);
  }
  Real* a = ctx.A.data + col.i0 + col.j * ctx.A.sj;
  for (int k = 0; k < n; ++k) {
    for (int f = 0; f < 5; ++f) {
      store(a + k * ctx.A.sk + f * ctx.A.sf,
            load(col.pencil + (static_cast<Index>(k) * 5 + f) * tile_width));
    }
  }
}

/// A direction that is absent has no fluxes: only the update.
inline long update_flat(const Context& ctx, int j, int tile) {
  const int i0 = tile * tile_width;
  Vec R[5];
  for (int f = 0; f < 5; ++f) R[f] = load(ctx.R.data + i0 + j * ctx.R.sj + f * ctx.R.sf);
  const unsigned bad = update_masked_node(ctx, NodePlaces(ctx, i0, j, 0),
                                          ctx.fluid[tile_at(ctx, tile, j, 0)], R, nullptr);
  return bad != 0 ? note_failures(ctx, bad, i0, j, 0) : 0;
}

/// Scratch of a group of columns: faces and pencils one after the other.
OCU_INLINE Index pencil_doubles(const Context& ctx) {
  return (face_doubles(ctx) / (largest_face_record * tile_width)) * 5 * tile_width;
}
OCU_INLINE Index column_doubles(const Context& ctx) {
  return column_group * (face_doubles(ctx) + pencil_doubles(ctx));
}

OCU_INLINE Column make_column(const Context& ctx, Real* scratch, int j, int tile, int slot) {
  Column col{};
  col.i0 = tile * tile_width;
  col.tile = tile;
  col.j = j;
  const Index flag = static_cast<Index>(j) * ctx.mask_tiles + tile;
  const unsigned columns = existing(col.i0, ctx.n[0]);
  col.cut = ctx.bodies ? ctx.cut[2][flag] : 0u;
  col.marked = ctx.any_mark ? ctx.line_marked[2][flag] & columns & ~col.cut : 0u;
  col.solved = (col.cut & columns) != columns;
  col.plain = !col.solved || (col.marked == 0 && !ctx.line[2].periodic);
  col.buf = face_zero(scratch + slot * face_doubles(ctx));
  if (ctx.stage == 3 && ctx.filter) {
    // Node 0 of the filter's line.
    col.pencil = scratch + column_group * face_doubles(ctx) + slot * pencil_doubles(ctx) +
                 4 * 5 * tile_width;
  }
  return col;
}

template <int Visc, bool Eight>
long update_columns(const Context& ctx, Real* scratch, int j, int tile, int count) {
  Column cols[column_group];
  for (int t = 0; t < count; ++t) {
    cols[t] = make_column(ctx, scratch, j, tile + t, t);
    if (ctx.bulk && cols[t].solved) fill_bulk_ghosts_z(ctx, cols[t].i0, j);
  }
  forward_columns<2, Visc, Eight>(ctx, cols, count);
  long failures = 0;
  for (int t = 0; t < count; ++t) {
    if (!cols[t].plain) failures += backward_column_slow<Visc>(ctx, cols[t]);
  }
  if (ctx.stage == 0) {
    failures += backward_columns<Visc, 0>(ctx, cols, count);
  } else if (ctx.stage == 1) {
    failures += backward_columns<Visc, 1>(ctx, cols, count);
  } else if (ctx.stage == 2) {
    failures += backward_columns<Visc, 2>(ctx, cols, count);
  } else {
    failures += backward_columns<Visc, 3>(ctx, cols, count);
  }
  for (int t = 0; t < count; ++t) {
    if (cols[t].pencil != nullptr) finish_pencil(ctx, cols[t]);
  }
  return failures;
}

inline long update_row(const Context& ctx, Real* scratch, int j) {
  long failures = 0;
  if (!ctx.present[2]) {
    for (int t = 0; t < ctx.tiles; ++t) failures += update_flat(ctx, j, t);
    return failures;
  }
  by_column_groups(0, ctx.tiles, [&](int first, int count) {
    OCU_VARIANT(ctx, failures += update_columns, ctx, scratch, j, first, count);
  });
  if (ctx.stream) _mm_sfence();
  return failures;
}

inline long finish_plane(const Context& shared, int k) {
  const Context ctx = shared;
  long failures = 0;
  for (int j = 0; j < ctx.n[1]; ++j) {
    for (int t = 0; t < ctx.tiles; ++t) {
      const int i0 = t * tile_width;
      const Real* a = ctx.A.data + i0 + j * ctx.A.sj + k * ctx.A.sk;
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
      const Real* s = ctx.Q.data + i0 + j * ctx.Q.sj + k * ctx.Q.sk;
      Vec q[5];
      for (int f = 0; f < 5; ++f) q[f] = load(s + f * ctx.Q.sf);
      static_cast<void>(store_primitives(ctx, q, ctx.W.data + i0 + j * ctx.W.sj + k * ctx.W.sk,
                                         ctx.fluid[tile_at(ctx, t, j, k)], false));
    }
  }
}

}  // namespace ocublast::flow::OCU_ISA
