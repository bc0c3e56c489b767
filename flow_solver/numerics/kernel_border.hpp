#pragma once

// Lines that go on in another rank's block. The flux of a face is a row of the inverse of its
// line's system times the right side, hence a weighted sum over the nodes of the line; the weights
// decay geometrically from the face. Here each rank forms its nodes' part of the sums for the faces
// around a border; once the parts are added, the solve of the block starts from known fluxes
// (start_known).

#include "flow_solver/numerics/kernel_stress.hpp"

namespace ocublast::flow::inline OCU_PRECISION::OCU_ISA {

/// Most faces around a border: of the filter, known_filter_faces on either side, the border once.
inline constexpr int most_border_faces = 2 * known_filter_faces - 1;
/// Nodes that one column takes before the next one of a group goes on (as in forward_columns).
inline constexpr int border_walk = 8;

/// Weight of node i (counted from the first of the sum) for face m and component q along D.
template <int D>
OCU_INLINE Vec border_weight(const BorderSum& sum, int i, int m, int q) {
  return splat(
      sum.weight[(static_cast<Index>(i - sum.first) * sum.faces + m) * n_classes + class_of<D>(q)]);
}

/// Whether nodes [n0, n1) are all in the far part of the sum, where one sum serves every face.
OCU_INLINE bool all_far(const BorderSum& sum, int n0, int n1) {
  return n1 <= sum.near_first || n0 >= sum.near_last;
}

/// Adds a sum of far nodes, weighted for the first face, to those of all faces.
template <int D>
OCU_INLINE void add_far(const BorderSum& sum, const Vec far[5], Real* out) {
  for (int m = 0; m < sum.faces; ++m) {
    for (int q = 0; q < 5; ++q) {
      Real* at = out + (m * 5 + q) * tile_width;
      store(at, madd(splat(sum.ratio[m * n_classes + class_of<D>(q)]), far[q], load(at)));
    }
  }
}

/// Adds the fluxes of nodes [n0, n1) to the sums of one line group.
template <int D, int Visc, int Faces>
OCU_INLINE void add_border_flux(const GasVec& gas, const Source& src, const BorderSum& sum, int n0,
                                int n1, Real* out) {
  if (all_far(sum, n0, n1)) {
    Vec far[5];
    for (int q = 0; q < 5; ++q) far[q] = splat(0.0);
    for (int i = n0; i < n1; ++i) {
      const Flux f = line_flux<D, Visc>(gas, src, i);
      for (int q = 0; q < 5; ++q) far[q] = madd(border_weight<D>(sum, i, 0, q), f.q[q], far[q]);
    }
    add_far<D>(sum, far, out);
    return;
  }
  Vec total[Faces][5];
  for (int m = 0; m < Faces; ++m) {
    for (int q = 0; q < 5; ++q) total[m][q] = load(out + (m * 5 + q) * tile_width);
  }
  for (int i = n0; i < n1; ++i) {
    const Flux f = line_flux<D, Visc>(gas, src, i);
#pragma GCC unroll 5
    for (int m = 0; m < Faces; ++m) {
#pragma GCC unroll 5
      for (int q = 0; q < 5; ++q)
        total[m][q] = madd(border_weight<D>(sum, i, m, q), f.q[q], total[m][q]);
    }
  }
  for (int m = 0; m < Faces; ++m) {
    for (int q = 0; q < 5; ++q) store(out + (m * 5 + q) * tile_width, total[m][q]);
  }
}

OCU_INLINE Real* border_place(const BorderSum& sum, Index group) {
  return sum.out + group * sum.faces * 5 * tile_width;
}
OCU_INLINE void clear_border(const BorderSum& sum, Index group) {
  Real* out = border_place(sum, group);
  for (int v = 0; v < sum.faces * 5; ++v) store(out + v * tile_width, splat(0.0));
}

/// y- and z-lines: neighbouring columns walk together.
template <int D, int Visc, bool Eight>
void border_flux_columns(const Context& shared, const BorderSum& sum, int c, int t0, int t1) {
  const Context ctx = shared;
  constexpr int faces = 2 * known_flux_faces(Eight) - 1;
  const GasVec gas(ctx);
  const int j = D == 1 ? 0 : c, k = D == 1 ? c : 0;
  for (int t = t0; t < t1; ++t) {
    clear_border(sum, line_group<D>(ctx, t * tile_width, j, k));
    if (D == 2 && ctx.bulk) fill_bulk_ghosts_z(ctx, t * tile_width, c);
  }
  const Source rows = whole_source<D, Visc>(ctx, t0 * tile_width, j, k);
  for (int n0 = sum.first; n0 < sum.last; n0 += border_walk) {
    const int n1 = n0 + border_walk < sum.last ? n0 + border_walk : sum.last;
    for (int t = t0; t < t1; ++t) {
      for (int n = n1 + (t - t0); n < n1 + border_walk && n < sum.last; n += t1 - t0) {
        prefetch_rows(rows.p + n * rows.sl, rows.sf, field_bulk + 1, t1 - t0);
      }
      const Source src = whole_source<D, Visc>(ctx, t * tile_width, j, k);
      add_border_flux<D, Visc, faces>(gas, src, sum, n0, n1,
                                      border_place(sum, line_group<D>(ctx, t * tile_width, j, k)));
    }
  }
}

/// x-lines, through transposed tiles of nodes.
template <int Visc, bool Eight>
void border_flux_rows(const Context& shared, Real* scratch, const BorderSum& sum, int k,
                      int group) {
  const Context ctx = shared;
  constexpr int faces = 2 * known_flux_faces(Eight) - 1;
  constexpr Index step = node_record * tile_width;
  const GasVec gas(ctx);
  const Real* w_row[tile_width];
  const Real* g_row[tile_width];
  for (int l = 0; l < tile_width; ++l) {
    const int j = group * tile_width + l < ctx.n[1] ? group * tile_width + l : ctx.n[1] - 1;
    w_row[l] = ctx.W.data + j * ctx.W.sj + k * ctx.W.sk;
    g_row[l] = ctx.G.data == nullptr ? nullptr : ctx.G.data + j * ctx.G.sj + k * ctx.G.sk;
  }
  const Index at = line_group<0>(ctx, 0, group * tile_width, k);
  clear_border(sum, at);
  const int begin =
      (sum.first + tile_width) / tile_width * tile_width - tile_width;  // node -1: tile of -8
  for (int i0 = begin; i0 < sum.last; i0 += tile_width) {
    load_x_block<Visc>(ctx, w_row, g_row, i0, 0, tile_width, scratch);
    const Real* base = scratch - i0 * step;
    Source src{base, tile_width, step, nullptr, {}, step};
    for (int q = 0; q < 4; ++q) src.g[q] = base + (node_gradient + q) * tile_width;
    const int n0 = i0 > sum.first ? i0 : sum.first;
    const int n1 = i0 + tile_width < sum.last ? i0 + tile_width : sum.last;
    add_border_flux<0, Visc, faces>(gas, src, sum, n0, n1, border_place(sum, at));
  }
}

template <int Visc, bool Eight>
void border_flux_groups(const Context& ctx, Real* scratch, int axis, const BorderSum& sum, int c,
                        int g0, int g1) {
  if (axis == 0) {
    for (int g = g0; g < g1; ++g) border_flux_rows<Visc, Eight>(ctx, scratch, sum, c, g);
    return;
  }
  by_column_groups(g0, g1, [&](int first, int count) {
    if (axis == 1)
      border_flux_columns<1, Visc, Eight>(ctx, sum, c, first, first + count);
    else
      border_flux_columns<2, Visc, Eight>(ctx, sum, c, first, first + count);
  });
}

inline void border_flux(const Context& ctx, Real* scratch, int axis, const BorderSum& sum, int c,
                        int g0, int g1) {
  OCU_VARIANT(ctx, border_flux_groups, ctx, scratch, axis, sum, c, g0, g1);
}

/// Conserved states of a tile of lines along D at node i: of A within the block, else of the ghosts
/// of W.
template <int D>
OCU_INLINE void border_states(const Context& ctx, int group, int c, int i, Vec q[5]) {
  const bool inside = i >= 0 && i < ctx.n[D];
  const Block& b = inside ? ctx.A : ctx.W;
  Vec v[5];
  if constexpr (D == 0) {
    for (int f = 0; f < 5; ++f) {
      Real lane[tile_width];
      for (int l = 0; l < tile_width; ++l) {
        const int j = group * tile_width + l < ctx.n[1] ? group * tile_width + l : ctx.n[1] - 1;
        lane[l] = b.data[i + f * b.sf + j * b.sj + c * b.sk];
      }
      v[f] = load(lane);
    }
  } else {
    const Real* at =
        b.data + group * tile_width + (D == 1 ? i * b.sj + c * b.sk : c * b.sj + i * b.sk);
    for (int f = 0; f < 5; ++f) v[f] = load(at + f * b.sf);
  }
  if (inside) {
    for (int f = 0; f < 5; ++f) q[f] = v[f];
  } else {
    conserved_of(ctx, v, q);
  }
}

/// Adds nodes [n0, n1) to the filter's sums of one line group: state(i, q) gives their conserved
/// states.
template <int D, class State>
OCU_INLINE void add_border_filter(const BorderSum& sum, int n0, int n1, Real* out,
                                  const State& state) {
  Vec q[border_walk][5];
  for (int i = n0; i < n1; ++i) state(i, q[i - n0]);
  if (all_far(sum, n0, n1)) {
    Vec far[5];
    for (int f = 0; f < 5; ++f) {
      far[f] = splat(0.0);
      for (int i = n0; i < n1; ++i)
        far[f] = madd(border_weight<D>(sum, i, 0, f), q[i - n0][f], far[f]);
    }
    add_far<D>(sum, far, out);
    return;
  }
  for (int f = 0; f < 5; ++f) {
    Vec total[most_border_faces];
    for (int m = 0; m < most_border_faces; ++m) total[m] = load(out + (m * 5 + f) * tile_width);
    for (int i = n0; i < n1; ++i) {
#pragma GCC unroll 7
      for (int m = 0; m < most_border_faces; ++m) {
        total[m] = madd(border_weight<D>(sum, i, m, f), q[i - n0][f], total[m]);
      }
    }
    for (int m = 0; m < most_border_faces; ++m) store(out + (m * 5 + f) * tile_width, total[m]);
  }
}

template <int D>
void border_filter_groups(const Context& shared, const BorderSum& sum, int c, int g0, int g1) {
  const Context ctx = shared;
  const auto place = [&](int g) {
    return D == 0 ? line_group<0>(ctx, 0, g * tile_width, c)
                  : line_group<D>(ctx, g * tile_width, D == 1 ? 0 : c, D == 1 ? c : 0);
  };
  for (int g = g0; g < g1; ++g) clear_border(sum, place(g));
  for (int n0 = sum.first; n0 < sum.last; n0 += border_walk) {
    const int n1 = n0 + border_walk < sum.last ? n0 + border_walk : sum.last;
    for (int g = g0; g < g1; ++g) {
      add_border_filter<D>(sum, n0, n1, border_place(sum, place(g)),
                           [&](int i, Vec q[5]) OCU_FORCE { border_states<D>(ctx, g, c, i, q); });
    }
  }
}

inline void border_filter(const Context& ctx, Real*, int axis, const BorderSum& sum, int c, int g0,
                          int g1) {
  if (axis == 0) border_filter_groups<0>(ctx, sum, c, g0, g1);
  if (axis == 1) border_filter_groups<1>(ctx, sum, c, g0, g1);
  if (axis == 2) border_filter_groups<2>(ctx, sum, c, g0, g1);
}

inline void filter_z(const Context& ctx, Real* scratch, int j) {
  for (int t = 0; t < ctx.tiles; ++t) {
    const Column col = make_column(ctx, scratch, j, t, 0);
    const Real* a = ctx.A.data + col.i0 + j * ctx.A.sj;
    for (int k = 0; k < ctx.n[2]; ++k) {
      for (int f = 0; f < 5; ++f) {
        store(col.pencil + (static_cast<Index>(k) * 5 + f) * tile_width,
              load(a + k * ctx.A.sk + f * ctx.A.sf));
      }
    }
    finish_pencil(ctx, col);
  }
}

}  // namespace ocublast::flow::OCU_ISA
