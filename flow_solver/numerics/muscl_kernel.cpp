// Sweeps and updates of the MUSCL-HLLC scheme. The stencil is explicit: x-lines read shifted
// vectors along the row, y and z lines and cut segments a tile of lines side by side. Time: half a
// step with first-order fluxes, then q^{n+1} = q^n - dt R(q^{n+1/2}) (van Leer's integrator: Stone
// and Gardiner 2009, New Astronomy 14:139). Steps with marked nodes: Heun, q1 = q^n - dt R(q^n),
// q^{n+1} = (q^n + q1 - dt R(q1)) / 2, a mean of two Euler steps, each positive at marked nodes.

#include "flow_solver/numerics/kernel_segment.hpp"
#include "flow_solver/numerics/muscl.hpp"
#include "flow_solver/numerics/muscl_flux.hpp"

namespace ocublast::flow::inline OCU_PRECISION::OCU_ISA {
namespace {

/// Lanes of the faces i0 .. i0 + 7 of an x-line that border a marked node.
unsigned marked_faces_x(const Context& ctx, int i0, int j, int k) {
  const std::uint8_t* mark = ctx.mark + mark_at(ctx, 0, j, k);
  const int n = ctx.n[0];
  const bool periodic = ctx.line[0].periodic;
  unsigned bits = 0;
  for (int l = 0; l < tile_width; ++l) {
    const int face = i0 + l;
    if (face > n) break;
    const bool left = face > 0 ? mark[face - 1] != 0 : periodic && mark[n - 1] != 0;
    const bool right = face < n ? mark[face] != 0 : periodic && mark[0] != 0;
    if (left || right) bits |= 1u << l;
  }
  return bits;
}

/// Lanes with a mark on either side of face m of lines along D > 0 in the tile at i0.
template <int D>
unsigned marked_faces(const Context& ctx, int i0, int j, int k, int m) {
  const int n = ctx.n[D];
  const bool periodic = ctx.line[D].periodic;
  const auto bits_of = [&](int node) {
    if (node < 0 || node >= n) {
      if (!periodic) return 0u;
      node = node < 0 ? n - 1 : 0;
    }
    const std::uint8_t* mark =
        ctx.mark + (D == 1 ? mark_at(ctx, i0, node, k) : mark_at(ctx, i0, j, node));
    unsigned bits = 0;
    for (int l = 0; l < tile_width; ++l) bits |= mark[l] != 0 ? 1u << l : 0u;
    return bits;
  };
  return bits_of(m - 1) | bits_of(m);
}

/// Fluxes of one x row into `row` [6 (the last one pressure), faces].
void row_fluxes(const Context& ctx, int j, int k, Real* row, Index width, bool marked) {
  const Real* w = ctx.W.data + j * ctx.W.sj + k * ctx.W.sk;
  for (int i0 = 0; i0 <= ctx.n[0]; i0 += tile_width) {
    const unsigned low = marked ? marked_faces_x(ctx, i0, j, k) : 0u;
    const FaceFlux f = muscl_face<0>(ctx, w + i0, ctx.W.sf, 1, low);
    for (int q = 0; q < 5; ++q) store(row + q * width + i0, f.q[q]);
    store(row + 5 * width + i0, f.p);
  }
}

/// `cone` less the node's pressure times `opening` where the node is marked, else `plain`.
Vec cone_momentum(const Context& ctx, int i0, int j, int k, Vec plain, Vec cone, Vec opening) {
  const std::uint8_t* mark = ctx.mark + mark_at(ctx, i0, j, k);
  unsigned bits = 0;
  for (int l = 0; l < tile_width; ++l) bits |= mark[l] != 0 ? 1u << l : 0u;
  const Real* w = ctx.W.data + i0 + j * ctx.W.sj + k * ctx.W.sk;
  const Vec p = load(w) * splat(ctx.gas_constant) * load(w + 4 * ctx.W.sf);
  return select(bits, cone - p * opening, plain);
}

/// Radial lines (x is the radius): area-weighted fluxes over r^m J, the pressure as a plain
/// gradient; at marked nodes as in a cone whose side walls carry the node's pressure, which is
/// positive.
void radial_divergence(const Context& ctx, const Real* row, Index width, int j, int k, bool marked,
                       Real* r) {
  const RadialView& radial = ctx.radial;
  for (int t = 0; t < ctx.tiles; ++t) {
    const int i = t * tile_width;
    const Vec inverse_volume = load(radial.inverse_volume + i),
              inverse_h = load(ctx.line[0].inverse_jacobian + i);
    const Vec area_l = load(radial.face_area + i), area_r = load(radial.face_area + i + 1);
    const Vec p_l = load(row + 5 * width + i), p_r = load(row + 5 * width + i + 1);
    for (int q = 0; q < 5; ++q) {
      Vec left = load(row + q * width + i), right = load(row + q * width + i + 1);
      if (q == 1) {
        left = left - p_l;
        right = right - p_r;
      }
      Vec div = (right * area_r - left * area_l) * inverse_volume;
      if (q == 1) {
        const Vec plain = div + (p_r - p_l) * inverse_h;
        div = marked ? cone_momentum(ctx, i, j, k, plain,
                                     div + (p_r * area_r - p_l * area_l) * inverse_volume,
                                     (area_r - area_l) * inverse_volume)
                     : plain;
      }
      store(r + q * ctx.R.sf + i, div);
    }
  }
}

void sweep_x_row(const Context& ctx, Real* scratch, int j, int k) {
  Real* r = ctx.R.data + j * ctx.R.sj + k * ctx.R.sk;
  const int group = j / tile_width, bit = j % tile_width;
  const Index flag = static_cast<Index>(k) * ctx.mask_groups + group;
  if (ctx.bodies && ((ctx.cut[0][flag] >> bit) & 1u) != 0) {
    for (int q = 0; q < 5; ++q) {
      for (int t = 0; t < ctx.tiles; ++t) store(r + q * ctx.R.sf + t * tile_width, splat(0.0));
    }
    return;
  }
  const bool marked = ctx.any_mark && ((ctx.line_marked[0][flag] >> bit) & 1u) != 0;
  const Index width = static_cast<Index>(ctx.tiles + 2) * tile_width;
  row_fluxes(ctx, j, k, scratch, width, marked);
  if (ctx.radial.power > 0) {
    radial_divergence(ctx, scratch, width, j, k, marked, r);
    return;
  }
  for (int t = 0; t < ctx.tiles; ++t) {
    const int i = t * tile_width;
    const Vec inverse_h = load(ctx.line[0].inverse_jacobian + i);
    for (int q = 0; q < 5; ++q) {
      const Real* f = scratch + q * width + i;
      store(r + q * ctx.R.sf + i, (load(f + 1) - load(f)) * inverse_h);
    }
  }
}

void sweep_x(const Context& shared, Real* scratch, int k, int g0, int g1) {
  const Context ctx = shared;  // a copy: vector stores could alias the shared one
  const int end = g1 * tile_width < ctx.n[1] ? g1 * tile_width : ctx.n[1];
  for (int j = g0 * tile_width; j < end; ++j) sweep_x_row(ctx, scratch, j, k);
}

void sweep_y_tile(const Context& ctx, int k, int tile) {
  const int i0 = tile * tile_width, n = ctx.n[1];
  const Index flag = static_cast<Index>(k) * ctx.mask_tiles + tile;
  const unsigned columns = existing(i0, ctx.n[0]);
  const unsigned cut = ctx.bodies ? ctx.cut[1][flag] : 0u;
  if ((cut & columns) == columns) return;
  const bool marked = ctx.any_mark && (ctx.line_marked[1][flag] & columns) != 0;
  const Real* w = ctx.W.data + i0 + k * ctx.W.sk;
  Real* r = ctx.R.data + i0 + k * ctx.R.sk;
  FaceFlux low =
      muscl_face<1>(ctx, w, ctx.W.sf, ctx.W.sj, marked ? marked_faces<1>(ctx, i0, 0, k, 0) : 0u);
  for (int j = 0; j < n; ++j) {
    const FaceFlux high = muscl_face<1>(ctx, w + (j + 1) * ctx.W.sj, ctx.W.sf, ctx.W.sj,
                                        marked ? marked_faces<1>(ctx, i0, 0, k, j + 1) : 0u);
    const Vec inverse_h = splat(ctx.line[1].inverse_jacobian[j]);
    for (int q = 0; q < 5; ++q) {
      Vec div = (high.q[q] - low.q[q]) * inverse_h;
      if (cut != 0) div = select(cut, splat(0.0), div);
      Real* at = r + j * ctx.R.sj + q * ctx.R.sf;
      store(at, load(at) + div);
    }
    low = high;
  }
}

void sweep_y(const Context& shared, Real*, int k, int t0, int t1) {
  const Context ctx = shared;
  for (int t = t0; t < t1; ++t) sweep_y_tile(ctx, k, t);
}

void sweep_plane(const Context& ctx, Real* scratch, int k) {
  sweep_x(ctx, scratch, k, 0, ctx.row_groups);
  if (ctx.present[1]) sweep_y(ctx, scratch, k, 0, ctx.tiles);
}

/// Lanes of a batch whose face m borders a marked node.
unsigned marked_faces_of(const Lanes& lanes, int m) {
  unsigned bits = 0;
  for (int l = 0; l < tile_width; ++l) {
    if (((lanes.active >> l) & 1u) != 0 && m <= lanes.n[l] && touches_mark(lanes, l, m))
      bits |= 1u << l;
  }
  return bits;
}

/// First-order flux at a wall with the given motion: the own state mirrored. A flux between the
/// wall's ghost and the node can swallow a supersonic stream.
template <int D>
void mirrored_wall_flux(const Context& ctx, const Real* motion, bool low, const Real* node,
                        Real* face) {
  double u[3] = {node[tile_width], node[2 * tile_width], node[3 * tile_width]};
  const PointState own = point_from_primitive(ctx, node[0], u, node[4 * tile_width]);
  double f[5];
  if (low)
    first_order_flux<D>(state_across<D>(ctx, LaneEnd::wall, own, motion, 1), own, f);
  else
    first_order_flux<D>(own, state_across<D>(ctx, LaneEnd::wall, own, motion, 1), f);
  for (int q = 0; q < 5; ++q) face[q * tile_width] = rounded(f[q]);
}

/// Does the gas at the node before a wall stream at it faster than half the speed of sound? No
/// smooth flow does; at the speed of sound and above the ghost's pressure no longer holds it back.
template <int D>
bool streams_at_wall(const Context& ctx, const Real* motion, bool low, const Real* node) {
  const double u = node[(1 + D) * tile_width] - motion[3 + D];
  const double towards = low ? -u : u;
  return towards > 0.0 &&
         4.0 * towards * towards > ctx.gamma * ctx.gas_constant * node[4 * tile_width];
}

template <int D>
void sweep_segment_batch_muscl(const Context& ctx, Real* scratch, const SegmentBatch& s) {
  const SegmentScratch mem(ctx, scratch);
  const SegmentLanes t = lanes_of_batch(ctx, D, s);
  for (int l = 0; l < tile_width; ++l) load_lane<D, false>(ctx, s, t, l, mem.nodes);
  load_metric(ctx, D, s, t, mem);
  const Lanes lanes = segment_lanes<D>(ctx, s, t);
  constexpr Index step = node_record * tile_width;
  const auto face_at = [&](int m) {
    return mem.buf + static_cast<Index>(m) * largest_face_record * tile_width;
  };
  for (int m = 0; m <= t.longest; ++m) {
    const unsigned first_order = lanes.active != 0 ? marked_faces_of(lanes, m) : 0u;
    const FaceFlux f = muscl_face<D>(ctx, mem.nodes + m * step, tile_width, step, first_order);
    for (int q = 0; q < 5; ++q) store(face_at(m) + q * tile_width, f.q[q]);
  }
  for (int l = 0; l < s.lanes; ++l) {
    const int n = s.length[l];
    const bool marked = ((lanes.active >> l) & 1u) != 0;
    const auto treat = [&](bool low, int wall, int end_node, int end_face) {
      const Real* motion = ctx.wall_motion[D] + static_cast<Index>(wall) * 6;
      const Real* node = mem.nodes + end_node * step + l;
      if ((marked && touches_mark(lanes, l, end_face)) ||
          streams_at_wall<D>(ctx, motion, low, node)) {
        mirrored_wall_flux<D>(ctx, motion, low, node, face_at(end_face) + l);
      }
    };
    if (t.low[l] == LaneEnd::wall) treat(true, s.wall_low[l], 0, 0);
    if (t.high[l] == LaneEnd::wall) treat(false, s.wall_high[l], n - 1, n);
  }
  const Index rl = stride_along(ctx.R, D);
  for (int l = 0; l < s.lanes; ++l) {
    Real* r = ctx.R.data + offset_in(ctx.R, t.origin[l]);
    for (int i = 0; i < s.length[l]; ++i) {
      const Real inverse_h = mem.inverse_h[i * tile_width + l];
      for (int q = 0; q < 5; ++q) {
        r[i * rl + q * ctx.R.sf] +=
            (face_at(i + 1)[q * tile_width + l] - face_at(i)[q * tile_width + l]) * inverse_h;
      }
    }
  }
}

void sweep_segments_muscl(const Context& ctx, Real* scratch, int axis, const SegmentBatch& s,
                          const SegmentBatch*) {
  if (axis == 0) sweep_segment_batch_muscl<0>(ctx, scratch, s);
  if (axis == 1) sweep_segment_batch_muscl<1>(ctx, scratch, s);
  if (axis == 2) sweep_segment_batch_muscl<2>(ctx, scratch, s);
}

/// One node vector: stage update from the whole divergence. Returns the bits of failed lanes.
unsigned update_node_muscl(const Context& ctx, int i0, int tile, int j, int k, const Vec R[5]) {
  const unsigned fluid = ctx.fluid[tile_at(ctx, tile, j, k)];
  Real* a = ctx.A.data + i0 + j * ctx.A.sj + k * ctx.A.sk;
  const Real* qn = ctx.Q.data + i0 + j * ctx.Q.sj + k * ctx.Q.sk;
  const bool heun = ctx.any_mark;
  const Vec dt = splat(ctx.stage == 0 && !heun ? 0.5 * ctx.dt : ctx.dt);
  Vec q[5];
  for (int f = 0; f < 5; ++f) {
    const Vec change = fluid == all_lanes ? dt * R[f] : select(fluid, dt * R[f], splat(0.0));
    const Vec old = load(qn + f * ctx.Q.sf);
    q[f] = ctx.stage == 0 || !heun ? old - change
                                   : splat(0.5) * ((old + load(a + f * ctx.A.sf)) - change);
    store(a + f * ctx.A.sf, q[f]);
  }
  return store_primitives(ctx, q, ctx.W.data + i0 + j * ctx.W.sj + k * ctx.W.sk, fluid, true);
}

long update_column_muscl(const Context& ctx, const Context& shared, int j, int tile) {
  const int i0 = tile * tile_width;
  long failures = 0;
  Real* r = ctx.R.data + i0 + j * ctx.R.sj;
  const auto update = [&](int k, const Vec R[5]) {
    const unsigned bad = update_node_muscl(ctx, i0, tile, j, k, R);
    if (bad != 0) failures += note_failures(shared, bad, i0, j, k);
  };
  Vec R[5];
  if (!ctx.present[2]) {
    for (int q = 0; q < 5; ++q) R[q] = load(r + q * ctx.R.sf);
    update(0, R);
    return failures;
  }
  const int n = ctx.n[2];
  const Index flag = static_cast<Index>(j) * ctx.mask_tiles + tile;
  const unsigned columns = existing(i0, ctx.n[0]);
  const unsigned cut = ctx.bodies ? ctx.cut[2][flag] : 0u;
  const bool whole_cut = (cut & columns) == columns;
  const bool marked = ctx.any_mark && (ctx.line_marked[2][flag] & columns) != 0;
  const Real* w = ctx.W.data + i0 + j * ctx.W.sj;
  // The update changes nodes that later faces of this column read: their old values stay in R until
  // all fluxes of the column are known.
  if (!whole_cut) {
    FaceFlux low =
        muscl_face<2>(ctx, w, ctx.W.sf, ctx.W.sk, marked ? marked_faces<2>(ctx, i0, j, 0, 0) : 0u);
    for (int k = 0; k < n; ++k) {
      const FaceFlux high = muscl_face<2>(ctx, w + (k + 1) * ctx.W.sk, ctx.W.sf, ctx.W.sk,
                                          marked ? marked_faces<2>(ctx, i0, j, 0, k + 1) : 0u);
      const Vec inverse_h = splat(ctx.line[2].inverse_jacobian[k]);
      for (int q = 0; q < 5; ++q) {
        Vec div = (high.q[q] - low.q[q]) * inverse_h;
        if (cut != 0) div = select(cut, splat(0.0), div);
        Real* at = r + k * ctx.R.sk + q * ctx.R.sf;
        store(at, load(at) + div);
      }
      low = high;
    }
  }
  for (int k = 0; k < n; ++k) {
    for (int q = 0; q < 5; ++q) R[q] = load(r + k * ctx.R.sk + q * ctx.R.sf);
    update(k, R);
  }
  return failures;
}

long update_row_muscl(const Context& shared, Real*, int j) {
  const Context ctx = shared;
  long failures = 0;
  for (int t = 0; t < ctx.tiles; ++t) failures += update_column_muscl(ctx, shared, j, t);
  return failures;
}

constexpr MusclKernels muscl_table{entry<sweep_plane>, entry<sweep_x>, entry<sweep_y>,
                                   entry<sweep_segments_muscl>, entry<update_row_muscl>};

}  // namespace

const MusclKernels& muscl_kernels() noexcept {
  return muscl_table;
}

}  // namespace ocublast::flow::OCU_ISA
