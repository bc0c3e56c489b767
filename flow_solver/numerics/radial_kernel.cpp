// Compact sweep along the radius, eight rows side by side: the fluxes r^m f of mass, momenta and
// energy and the plain pressure through the same solve. Marked nodes: local Lax-Friedrichs times
// area.

#include "flow_solver/numerics/kernel_segment.hpp"
#include "flow_solver/numerics/radial.hpp"

namespace ocublast::flow::inline OCU_PRECISION::OCU_ISA {
namespace {

// Places of the weighted fluxes in a node's record once its primitives are used up; temperature and
// kappa keep theirs.
constexpr int flux_slot[6] = {0, 1, 2, 3, 7, 8};
// Places in a face's record: five fluxes, diffusive energy, pressure.
constexpr int face_heat = 5, face_pressure = 6;

OCU_INLINE Real* node_at(Real* nodes, int i) {
  return nodes + static_cast<Index>(i) * node_record * tile_width;
}
OCU_INLINE Real* face_at(Real* buf, int j) {
  return buf + static_cast<Index>(j) * largest_face_record * tile_width;
}

/// Parity class of flux q; the pressure (5) is even as the normal momentum.
OCU_INLINE constexpr int radial_class(int q) {
  return q == 5 ? 1 : (q == 0 || q == 4 ? 0 : (q == 1 ? 1 : 2));
}

void load_nodes(const Context& ctx, const Real* const row[tile_width],
                const Real* const none[tile_width], Real* nodes) {
  for (int i0 = -tile_width; i0 < ctx.n[0] + n_ghost; i0 += tile_width) {
    load_x_block<no_viscosity>(ctx, row, none, i0, 0, tile_width, node_at(nodes, i0));
  }
}

/// Weighted fluxes of all nodes in place.
void nodal_fluxes(const Context& ctx, Real* nodes) {
  const GasVec gas(ctx);
  for (int i = -n_ghost; i < ctx.n[0] + n_ghost; ++i) {
    Real* p = node_at(nodes, i);
    const Vec total =
        load(p) * gas.R * load(p + 4 * tile_width) + load(p + field_bulk * tile_width);
    Flux f = nodal_flux<0>(gas, p, tile_width);
    f.q[1] = f.q[1] - total;
    const Vec weight = splat(ctx.radial.node_weight[i]);
    for (int q = 0; q < 5; ++q) store(p + flux_slot[q] * tile_width, weight * f.q[q]);
    store(p + flux_slot[5] * tile_width, total);
  }
}

/// Right sides and elimination of all faces.
void eliminate_radial(const Context& ctx, Real* nodes, Real* buf) {
  const LineView& line = ctx.line[0];
  const RadialView& radial = ctx.radial;
  const int n = ctx.n[0];
  const auto clamped = [&](int i) {
    return i < -n_ghost ? -n_ghost : (i > n + n_ghost - 1 ? n + n_ghost - 1 : i);
  };
  Vec before[6];
  for (Vec& v : before) v = splat(0.0);
  for (int j = line.face_begin; j <= line.face_end; ++j) {
    const Real* row = line.flux + static_cast<Index>(j) * flux_row_size;
    const Real* weighted_row = radial.flux + static_cast<Index>(j) * flux_row_size;
    const bool explicit_face =
        radial.from_axis && radial.power == 1 && j >= 0 && j <= explicit_axis_faces;
    Real* out = face_at(buf, j);
    for (int q = 0; q < 6; ++q) {
      const auto f = [&](int i) OCU_FORCE {
        return load(node_at(nodes, clamped(i)) + flux_slot[q] * tile_width);
      };
      const Real* rows = (q == 5 ? row : weighted_row) + flux_class_size * radial_class(q);
      Vec rhs = splat(rows[0]) * (f(j - 1) + f(j)) + splat(rows[1]) * (f(j - 2) + f(j + 1));
      if (ctx.eighth_order) rhs = rhs + splat(rows[2]) * (f(j - 3) + f(j + 2));
      if (explicit_face && q < 5) {
        rhs = splat(0.5 * radial.face_area[j] * rows[flux_weights + 2]) *
              (f(j - 1) * splat(1.0 / radial.node_weight[j - 1]) +
               f(j) * splat(1.0 / radial.node_weight[j]));
      }
      before[q] = rhs - splat(rows[flux_weights]) * before[q];
      store(out + (q == 5 ? face_pressure : q) * tile_width, before[q]);
    }
  }
}

void substitute_radial(const Context& ctx, Real* buf) {
  const LineView& line = ctx.line[0];
  for (int j = line.face_end - 1; j >= 0; --j) {
    for (int q = 0; q < 6; ++q) {
      const Real* rows =
          (q == 5 ? line.flux : ctx.radial.flux) + static_cast<Index>(j) * flux_row_size;
      const int slot = (q == 5 ? face_pressure : q) * tile_width;
      store(face_at(buf, j) + slot,
            load(face_at(buf, j) + slot) -
                splat(rows[flux_class_size * radial_class(q) + flux_weights + 1]) *
                    load(face_at(buf, j + 1) + slot));
    }
  }
}

void heat_fluxes(const Context& ctx, Real* nodes, Real* buf) {
  for (int j = 0; j <= ctx.n[0]; ++j) {
    const Real *l = node_at(nodes, j - 1), *r = node_at(nodes, j);
    const Vec kappa =
        splat(0.5) * (load(l + field_kappa * tile_width) + load(r + field_kappa * tile_width));
    const Vec slope = (load(l + 4 * tile_width) - load(r + 4 * tile_width)) *
                      splat(ctx.line[0].inverse_face_spacing[j] * ctx.radial.face_area[j]);
    store(face_at(buf, j) + face_heat * tile_width, kappa * slope);
  }
}

void replace_marked_radial(const Context& ctx, const Lanes& lanes, Real* buf) {
  for (int l = 0; l < tile_width; ++l) {
    if (((lanes.active >> l) & 1u) == 0) continue;
    const int n = lanes.n[l];
    const auto state = [&](int i) {
      double q[5];
      for (int f = 0; f < 5; ++f) q[f] = lanes.q[l][f * lanes.qf + i * lanes.ql];
      return point_from_conserved(ctx, q);
    };
    for (int j = 0; j <= n; ++j) {
      if (!touches_mark(lanes, l, j)) continue;
      const PointState left = j == 0 ? state_across<0>(ctx, lanes.low[l], state(0),
                                                       lanes.low_state[l], lanes.low_stride[l])
                                     : state(j - 1);
      const PointState right = j == n ? state_across<0>(ctx, lanes.high[l], state(n - 1),
                                                        lanes.high_state[l], lanes.high_stride[l])
                                      : state(j);
      double f[5];
      first_order_flux<0>(left, right, f);
      const double mean = 0.5 * (left.p + right.p);
      f[1] -= mean;
      Real* face = face_at(buf, j) + l;
      for (int q = 0; q < 5; ++q) face[q * tile_width] = rounded(ctx.radial.face_area[j] * f[q]);
      face[face_heat * tile_width] = 0.0;
      face[face_pressure * tile_width] = rounded(mean);
    }
  }
}

/// Divergence of node i of the eight rows.
OCU_INLINE void divergence(const Context& ctx, Real* buf, int i, Vec div[5]) {
  const Real *l = face_at(buf, i), *r = face_at(buf, i + 1);
  const Vec inverse_volume = splat(ctx.radial.inverse_volume[i]);
  const auto change = [&](int slot) OCU_FORCE {
    return load(r + slot * tile_width) - load(l + slot * tile_width);
  };
  for (int q = 0; q < 5; ++q)
    div[q] = (q == 4 ? change(4) + change(face_heat) : change(q)) * inverse_volume;
  div[1] = div[1] + change(face_pressure) * splat(ctx.line[0].inverse_jacobian[i]);
}

/// Radial momentum of marked nodes as in a cone whose side walls carry the node's own pressure:
/// with first-order fluxes at both ends that update is positive, also in the cell at r = 0.
void cone_momentum(const Context& ctx, const Lanes& lanes, const Real* buf, int i, Vec& div) {
  Real value[tile_width];
  store(value, div);
  const double a_l = ctx.radial.face_area[i], a_r = ctx.radial.face_area[i + 1];
  for (int l = 0; l < tile_width; ++l) {
    if (((lanes.active >> l) & 1u) == 0 || lanes.mark[l][i * lanes.ml] == 0) continue;
    double q[5];
    for (int f = 0; f < 5; ++f) q[f] = lanes.q[l][f * lanes.qf + i * lanes.ql];
    const double p = point_from_conserved(ctx, q).p;
    const Real* low = buf + static_cast<Index>(i) * largest_face_record * tile_width + l;
    const Real* high = low + largest_face_record * tile_width;
    value[l] =
        rounded((high[tile_width] - low[tile_width] + a_r * (high[face_pressure * tile_width] - p) -
                 a_l * (low[face_pressure * tile_width] - p)) *
                ctx.radial.inverse_volume[i]);
  }
  div = load(value);
}

void sweep_group(const Context& ctx, Real* scratch, int k, int group) {
  const SegmentScratch mem(ctx, scratch);
  const int n = ctx.n[0], j0 = group * tile_width;
  const unsigned rows = existing(j0, ctx.n[1]);
  const Real* w_row[tile_width];
  Real* r_row[tile_width];
  const Real* none[tile_width] = {};
  for (int l = 0; l < tile_width; ++l) {
    const int j = j0 + l < ctx.n[1] ? j0 + l : ctx.n[1] - 1;
    w_row[l] = ctx.W.data + j * ctx.W.sj + k * ctx.W.sk;
    r_row[l] = ctx.X.data + j * ctx.X.sj + k * ctx.X.sk;
  }
  load_nodes(ctx, w_row, none, mem.nodes);
  nodal_fluxes(ctx, mem.nodes);
  eliminate_radial(ctx, mem.nodes, mem.buf);
  substitute_radial(ctx, mem.buf);
  heat_fluxes(ctx, mem.nodes, mem.buf);
  const unsigned marked =
      ctx.any_mark ? ctx.line_marked[0][static_cast<Index>(k) * ctx.mask_groups + group] & rows
                   : 0u;
  const Lanes lanes = whole_lanes<0>(ctx, 0, j0, k, marked);
  if (marked != 0) replace_marked_radial(ctx, lanes, mem.buf);
  for (int i0 = 0; i0 < n; i0 += tile_width) {
    Vec div[tile_width][5];
    for (int a = 0; a < tile_width; ++a) {
      for (Vec& v : div[a]) v = splat(0.0);
      if (i0 + a >= n) continue;
      divergence(ctx, mem.buf, i0 + a, div[a]);
      if (marked != 0) cone_momentum(ctx, lanes, mem.buf, i0 + a, div[a][1]);
    }
    for (int f = 0; f < 5; ++f) {
      Vec r[tile_width];
      for (int a = 0; a < tile_width; ++a) r[a] = div[a][f];
      store_columns(r_row, f * ctx.X.sf + i0, r, rows);
    }
  }
}

void sweep_x_radial(const Context& shared, Real* scratch, int k, int g0, int g1) {
  const Context ctx = shared;
  for (int g = g0; g < g1; ++g) sweep_group(ctx, scratch, k, g);
}

void add_dilatation(const Context& ctx, int k) {
  for (int j = 0; j < ctx.n[1]; ++j) {
    const Real* u = ctx.W.data + ctx.W.sf + j * ctx.W.sj + k * ctx.W.sk;
    Real* theta = ctx.R.data + j * ctx.R.sj + k * ctx.R.sk;
    for (int i = 0; i < ctx.tiles * tile_width; i += tile_width) {
      store(theta + i, load(theta + i) + load(ctx.radial.power_over_r + i) * load(u + i));
    }
  }
}

void add_bulk(const Context& ctx, int k) {
  const Block& w = ctx.W;
  const int n0 = ctx.n[0], n1 = ctx.n[1];
  Real* plane = w.data + k * w.sk;
  for (int j = 0; j < n1; ++j) {
    Real* row = plane + j * w.sj;
    Real* bulk = row + field_bulk * w.sf;
    for (int i = 0; i < ctx.tiles * tile_width; i += tile_width) {
      store(bulk + i, load(bulk + i) - load(row + field_beta * w.sf + i) *
                                           load(ctx.radial.power_over_r + i) *
                                           load(row + w.sf + i));
    }
    for (int g = 0; g < n_ghost; ++g) {
      bulk[n0 + g] = bulk[ctx.line[0].high == LaneEnd::domain_ghost ? n0 - 1 : n0 - 1 - g];
      bulk[-1 - g] = bulk[ctx.line[0].low == LaneEnd::domain_ghost ? 0 : g];
    }
  }
  if (!ctx.present[1]) return;
  const LineView& y = ctx.line[1];
  Real* bulk = plane + field_bulk * w.sf;
  for (int g = 0; g < n_ghost; ++g) {
    const int low = y.periodic ? n1 - 1 - g : (y.low == LaneEnd::domain_ghost ? 0 : g);
    const int high = y.periodic ? g : (y.high == LaneEnd::domain_ghost ? n1 - 1 : n1 - 1 - g);
    for (int i = 0; i < ctx.tiles * tile_width; i += tile_width) {
      store(bulk + (-1 - g) * w.sj + i, load(bulk + low * w.sj + i));
      store(bulk + (n1 + g) * w.sj + i, load(bulk + high * w.sj + i));
    }
  }
}

constexpr RadialKernels radial_table{entry<sweep_x_radial>, entry<add_dilatation>, entry<add_bulk>};

}  // namespace

const RadialKernels& radial_kernels() noexcept {
  return radial_table;
}

}  // namespace ocublast::flow::OCU_ISA
