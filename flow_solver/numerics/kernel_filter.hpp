#pragma once

// Eighth-order implicit filter (Gaitonde and Visbal) in flux form on a pencil of conserved states
// [node, 5] of a tile of lines: alpha G(j-1) + G(j) + alpha G(j+1) = sum of k_m [q(j+m-1) -
// q(j-m)], q(i) += [J G](i+1)/J(i) - [J G](i)/J(i); the face jacobians keep sum J q on stretched
// grids.

#include "flow_solver/numerics/kernel_sweep.hpp"

namespace ocublast::flow::inline OCU_PRECISION::OCU_ISA {

struct UniformFilter {
  const Real* rows;
  const Real* face_jacobian;
  const Real* inverse_jacobian;
  double strength;
  OCU_INLINE Vec row(int j, int c) const {
    return splat(rows[static_cast<Index>(j) * filter_row_size + c]);
  }
  OCU_INLINE Vec jacobian(int j) const { return splat(strength * face_jacobian[j]); }
  OCU_INLINE Vec inverse_h(int i) const { return splat(inverse_jacobian[i]); }
};

struct LaneFilter {
  const Real* rows;
  const Real* tail;
  int split;
  const Real* face_jacobian;
  const Real* inverse_jacobian;
  double strength;
  OCU_INLINE Vec row(int j, int c) const {
    if (j < split) return splat(rows[static_cast<Index>(j) * filter_row_size + c]);
    return load(tail + (static_cast<Index>(j - split) * filter_row_size + c) * tile_width);
  }
  OCU_INLINE Vec jacobian(int j) const {
    return splat(strength) * load(face_jacobian + static_cast<Index>(j) * tile_width);
  }
  OCU_INLINE Vec inverse_h(int i) const {
    return load(inverse_jacobian + static_cast<Index>(i) * tile_width);
  }
};

/// Conserved state of primitive values.
OCU_INLINE void conserved_of(const Context& ctx, const Vec w[5], Vec q[5]) {
  const Vec p = w[0] * splat(ctx.gas_constant) * w[4];
  q[0] = w[0];
  for (int a = 1; a < 4; ++a) q[a] = w[0] * w[a];
  q[4] = p * splat(1.0 / (ctx.gamma - 1.0)) +
         splat(0.5) * w[0] * (w[1] * w[1] + w[2] * w[2] + w[3] * w[3]);
}

/// Ghost nodes of a pencil along y or z: mirrored or periodic copies of the pencil itself, or the
/// conserved state of the domain ghosts of the last stage.
template <int D>
OCU_INLINE void fill_filter_ghosts(const Context& ctx, int i0, int j, int k, Real* pencil) {
  static_assert(D > 0);
  const LineView& line = ctx.line[D];
  const int n = ctx.n[D];
  const Block& w = ctx.W;
  const Index sl = D == 1 ? w.sj : w.sk;
  const Real* base = w.data + i0 + j * w.sj + k * w.sk;
  const auto copy = [&](int to, int from, LaneEnd end) {
    for (int f = 0; f < 5; ++f) {
      Vec v = load(pencil + (static_cast<Index>(from) * 5 + f) * tile_width);
      const bool flip = end == LaneEnd::mirrored_slip && f == 1 + D;
      if (flip) v = -v;
      store(pencil + (static_cast<Index>(to) * 5 + f) * tile_width, v);
    }
  };
  const auto ghost = [&](int node) {
    Vec p[5], q[5];
    for (int f = 0; f < 5; ++f) p[f] = load(base + node * sl + f * w.sf);
    conserved_of(ctx, p, q);
    for (int f = 0; f < 5; ++f)
      store(pencil + (static_cast<Index>(node) * 5 + f) * tile_width, q[f]);
  };
  for (int m = 0; m < 4; ++m) {
    if (line.periodic) {
      copy(-1 - m, n - 1 - m, LaneEnd::domain_ghost);
      copy(n + m, m, LaneEnd::domain_ghost);
      continue;
    }
    if (line.low != LaneEnd::mirrored_slip)
      ghost(-1 - m);
    else
      copy(-1 - m, m, line.low);
    if (line.high != LaneEnd::mirrored_slip)
      ghost(n + m);
    else
      copy(n + m, n - 1 - m, line.high);
  }
}

/// Filter fluxes vanish at the faces of marked nodes.
[[gnu::noinline]] inline void clear_marked(const Lanes& lanes, Real* buf) {
  for (int l = 0; l < tile_width; ++l) {
    if (((lanes.active >> l) & 1u) == 0) continue;
    for (int j = 0; j <= lanes.n[l]; ++j) {
      if (!touches_mark(lanes, l, j)) continue;
      for (int f = 0; f < 5; ++f)
        buf[(static_cast<Index>(j) * filter_record + f) * tile_width + l] = 0.0;
    }
  }
}

OCU_INLINE constexpr int filter_class(int axis, int f) {
  if (f == 0 || f == 4) return 0;
  return f == 1 + axis ? 1 : 2;
}

/// Adds the filter's change to node i from the weighted fluxes of its faces.
OCU_INLINE void change_node(Real* pencil, int i, const Vec right[5], const Vec left[5],
                            Vec inverse_h, unsigned keep) {
#pragma GCC unroll 5
  for (int f = 0; f < 5; ++f) {
    Vec change = right[f] - left[f];
    if ((keep & all_lanes) != 0) change = select(keep, splat(0.0), change);
    Real* q = pencil + (static_cast<Index>(i) * 5 + f) * tile_width;
    store(q, madd(change, inverse_h, load(q)));
  }
}

/// Right side and elimination of the faces [begin, end]; all eight nodes around them exist, or
/// their weights are zero and nothing must be read (Ends).
template <int D, bool Ends, class Coef>
OCU_INLINE void filter_forward(int n, int begin, int end, const Coef& coef, Real* buf,
                               const Real* pencil, Vec g[5]) {
  for (int j = begin; j <= end; ++j) {
    const Real* at = pencil + static_cast<Index>(j) * 5 * tile_width;
    const auto pair = [&](int m, int f) OCU_FORCE {
      return load(at + (m * 5 + f) * tile_width) - load(at + ((-1 - m) * 5 + f) * tile_width);
    };
    Real* out = buf + static_cast<Index>(j) * filter_record * tile_width;
#pragma GCC unroll 5
    for (int f = 0; f < 5; ++f) {
      const int k = filter_class_size * filter_class(D, f);
      Vec rhs = coef.row(j, k) * pair(0, f);
#pragma GCC unroll 3
      for (int m = 1; m < 4; ++m) {
        if (Ends && (j - 1 - m < -4 || j + m > n + 3)) continue;
        rhs = madd(coef.row(j, k + m), pair(m, f), rhs);
      }
      g[f] = nmadd(coef.row(j, k + filter_weights), g[f], rhs);
      store(out + f * tile_width, g[f]);
    }
  }
}

struct NothingKnown {
  void operator()() const {}
};

/// Filters nodes 0 .. n - 1 of the pencil in place; lanes in `keep` stay as they are. `put_known`
/// puts fluxes that are known lane by lane into the buffer after the forward walk.
template <int D, class Coef, class PutKnown = NothingKnown>
OCU_INLINE void filter_pencil(const LineView& line, int n, int face_begin, int face_end,
                              const Coef& coef, Real* buf, Real* pencil, unsigned keep,
                              const Lanes* marked, Index group = 0,
                              const PutKnown& put_known = {}) {
  const auto at = [&](int j) { return buf + static_cast<Index>(j) * filter_record * tile_width; };
  Vec g[5];
  for (int f = 0; f < 5; ++f) g[f] = splat(0.0);
  const KnownEnd &low = line.known_low, &high = line.known_high;
  start_known(low.filter, low.filter_faces, group, g);
  const int inner_end = face_end < n ? face_end : n;
  filter_forward<D, true>(n, face_begin, -1, coef, buf, pencil, g);
  filter_forward<D, false>(n, face_begin > 0 ? face_begin : 0, inner_end, coef, buf, pencil, g);
  filter_forward<D, true>(n, inner_end + 1, face_end, coef, buf, pencil, g);
  store_known<filter_record>(low.filter, low.filter_faces, group, 0, buf);
  store_known<filter_record>(high.filter, high.filter_faces, group, n + 1 - high.filter_faces, buf);
  if (high.filter != nullptr) start_known(high.filter, high.filter_faces, group, g);
  put_known();
  const auto substitute = [&](int j) OCU_FORCE {
#pragma GCC unroll 5
    for (int f = 0; f < 5; ++f) {
      g[f] = nmadd(coef.row(j, filter_class_size * filter_class(D, f) + filter_weights + 1), g[f],
                   load(at(j) + f * tile_width));
    }
  };
  Vec right[5], left[5];
  if (!line.periodic && marked == nullptr) {
    for (int j = face_end - 1; j >= n; --j) substitute(j);
    for (int f = 0; f < 5; ++f) right[f] = coef.jacobian(n) * g[f];
    for (int i = n - 1; i >= 0; --i) {
      substitute(i);
      const Vec jacobian = coef.jacobian(i);
      for (int f = 0; f < 5; ++f) left[f] = jacobian * g[f];
      change_node(pencil, i, right, left, coef.inverse_h(i), keep);
      for (int f = 0; f < 5; ++f) right[f] = left[f];
    }
    return;
  }
  for (int j = face_end - 1; j >= 0; --j) {
    substitute(j);
    for (int f = 0; f < 5; ++f) store(at(j) + f * tile_width, g[f]);
  }
  if (line.periodic) {
    for (int f = 0; f < 5; ++f) {
      const Vec shift = (load(at(0) + f * tile_width) +
                         splat(line.filter_wrap_last) * load(at(n - 1) + f * tile_width)) *
                        splat(line.filter_wrap_scale);
      for (int j = 0; j < n; ++j) {
        store(at(j) + f * tile_width,
              load(at(j) + f * tile_width) - splat(line.filter_wrap[j]) * shift);
      }
      store(at(n) + f * tile_width, load(at(0) + f * tile_width));
    }
  }
  if (marked != nullptr) clear_marked(*marked, buf);
  for (int f = 0; f < 5; ++f) right[f] = coef.jacobian(n) * load(at(n) + f * tile_width);
  for (int i = n - 1; i >= 0; --i) {
    for (int f = 0; f < 5; ++f) left[f] = coef.jacobian(i) * load(at(i) + f * tile_width);
    change_node(pencil, i, right, left, coef.inverse_h(i), keep);
    for (int f = 0; f < 5; ++f) right[f] = left[f];
  }
}

/// z pencils of whole lines.
OCU_INLINE void filter_line(const LineView& line, int n, const UniformFilter& coef, Real* buf,
                            Real* pencil, unsigned keep, const Lanes* marked, Index group) {
  filter_pencil<2>(line, n, line.face_begin, line.face_end, coef, buf, pencil, keep, marked, group);
}

inline void filter_x(const Context& shared, Real* scratch, int k, int g0, int g1) {
  const Context ctx = shared;
  const LineView& line = ctx.line[0];
  const int n = ctx.n[0];
  Real* buf = face_zero(scratch);
  Real* pencil = scratch + face_doubles(ctx) + tile_width * 5 * tile_width;
  constexpr Index step = 5 * tile_width;
  const UniformFilter coef{line.filter, line.face_jacobian, line.filter_inverse_jacobian,
                           ctx.filter_strength};
  for (int g = g0; g < g1; ++g) {
    const int j0 = g * tile_width;
    const unsigned rows = existing(j0, ctx.n[1]);
    const Index flag = static_cast<Index>(k) * ctx.mask_groups + g;
    const unsigned cut = ctx.bodies ? ctx.cut[0][flag] : 0u;
    if ((cut & rows) == rows) continue;
    Real* a_row[tile_width];
    const Real* w_row[tile_width];
    for (int l = 0; l < tile_width; ++l) {
      const int j = j0 + l < ctx.n[1] ? j0 + l : ctx.n[1] - 1;
      a_row[l] = ctx.A.data + j * ctx.A.sj + k * ctx.A.sk;
      w_row[l] = ctx.W.data + j * ctx.W.sj + k * ctx.W.sk;
    }
    for (int t = 0; t < ctx.tiles; ++t) {
      const Index i0 = static_cast<Index>(t) * tile_width;
      for (int f = 0; f < 5; ++f) {
        for (Index i = i0; i < i0 + tile_width; i += 4) {
          rows_to_nodes(a_row, f * ctx.A.sf + i, pencil + i * step + f * tile_width, step);
        }
      }
      for (int l = 0; l < tile_width;
           ++l) {  // the rows that come next, and where their primitives go
        prefetch_next(a_row[l] + tile_width * ctx.A.sj + i0, ctx.A.sf, 5);
        prefetch_next(w_row[l] + i0, ctx.W.sf, 5);
      }
    }
    const auto set = [&](int to, int f, Vec v) {
      store(pencil + static_cast<Index>(to) * step + f * tile_width, v);
    };
    const auto get = [&](int from, int f) {
      return load(pencil + static_cast<Index>(from) * step + f * tile_width);
    };
    const auto copy = [&](int to, int from, LaneEnd end) {
      for (int f = 0; f < 5; ++f) {
        const bool flip = end == LaneEnd::mirrored_slip && f == 1;
        set(to, f, flip ? -get(from, f) : get(from, f));
      }
    };
    const auto ghost = [&](int i) {
      Vec w[5], q[5];
      for (int f = 0; f < 5; ++f) {
        Real lane[tile_width];
        for (int l = 0; l < tile_width; ++l) lane[l] = w_row[l][f * ctx.W.sf + i];
        w[f] = load(lane);
      }
      conserved_of(ctx, w, q);
      for (int f = 0; f < 5; ++f) set(i, f, q[f]);
    };
    for (int m = 0; m < 4; ++m) {
      if (line.periodic) {
        copy(n + m, m, LaneEnd::domain_ghost);
        copy(-1 - m, n - 1 - m, LaneEnd::domain_ghost);
        continue;
      }
      if (line.high != LaneEnd::mirrored_slip)
        ghost(n + m);
      else
        copy(n + m, n - 1 - m, line.high);
      if (line.low != LaneEnd::mirrored_slip)
        ghost(-1 - m);
      else
        copy(-1 - m, m, line.low);
    }
    const unsigned marked = ctx.any_mark ? ctx.line_marked[0][flag] & rows : 0u;
    const Lanes lanes = whole_lanes<0>(ctx, 0, j0, k, marked);
    filter_pencil<0>(line, n, line.face_begin, line.face_end, coef, buf, pencil, cut,
                     marked != 0 ? &lanes : nullptr, flag);
    for (int t = 0; t < ctx.tiles; ++t) {
      const Index i0 = static_cast<Index>(t) * tile_width;
      for (int f = 0; f < 5; ++f) {
        Vec r[tile_width];
        for (int a = 0; a < tile_width; ++a) r[a] = load(pencil + (i0 + a) * step + f * tile_width);
        store_columns(a_row, f * ctx.A.sf + i0, r, rows);
      }
    }
  }
}

inline void filter_y(const Context& shared, Real* scratch, int k, int t0, int t1) {
  const Context ctx = shared;
  const LineView& line = ctx.line[1];
  const int n = ctx.n[1];
  Real* buf = face_zero(scratch);
  Real* pencil = scratch + face_doubles(ctx) + tile_width * 5 * tile_width;
  const UniformFilter coef{line.filter, line.face_jacobian, line.inverse_jacobian,
                           ctx.filter_strength};
  for (int t = t0; t < t1; ++t) {
    const int i0 = t * tile_width;
    const Index flag = static_cast<Index>(k) * ctx.mask_tiles + t;
    const unsigned columns = existing(i0, ctx.n[0]);
    const unsigned cut = ctx.bodies ? ctx.cut[1][flag] : 0u;
    if ((cut & columns) == columns) continue;
    Real* a = ctx.A.data + i0 + k * ctx.A.sk;
    for (int j = 0; j < n; ++j) {
      for (int f = 0; f < 5; ++f) {
        store(pencil + (static_cast<Index>(j) * 5 + f) * tile_width,
              load(a + j * ctx.A.sj + f * ctx.A.sf));
      }
    }
    fill_filter_ghosts<1>(ctx, i0, 0, k, pencil);
    const unsigned marked = ctx.any_mark ? ctx.line_marked[1][flag] & columns : 0u;
    const Lanes lanes = whole_lanes<1>(ctx, i0, 0, k, marked);
    filter_pencil<1>(line, n, line.face_begin, line.face_end, coef, buf, pencil, cut | ~columns,
                     marked != 0 ? &lanes : nullptr, flag);
    for (int j = 0; j < n; ++j) {
      for (int f = 0; f < 5; ++f) {
        store(a + j * ctx.A.sj + f * ctx.A.sf,
              load(pencil + (static_cast<Index>(j) * 5 + f) * tile_width));
      }
    }
  }
}

}  // namespace ocublast::flow::OCU_ISA
