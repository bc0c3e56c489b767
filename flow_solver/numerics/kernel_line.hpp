#pragma once

// Compact flux solve along a tile of lines at once. Forward: nodal fluxes from a rolling window of
// nodes, right side, elimination; face values stay in a buffer. Backward: substitution, diffusive
// face fluxes added, divergence handed to a sink node by node. Sixth order (Lele 1992) in flux
// form: 1/3 F(j-1) + F(j) + 1/3 F(j+1) = 29/36 [f(j-1) + f(j)] + 1/36 [f(j-2) + f(j+1)].

#include "flow_solver/numerics/kernel.hpp"
#include "flow_solver/numerics/line_table.hpp"
#include "flow_solver/numerics/simd.hpp"

namespace ocublast::flow::inline OCU_PRECISION::OCU_ISA {

inline constexpr int face_margin = 6;  ///< faces kept below face 0 in the buffer

/// How viscous stress enters a line: not at all, through the nodal fluxes of whole lines, or as
/// second-order fluxes across the faces of cut lines.
enum ViscousForm : int { no_viscosity = 0, nodal_viscosity = 1, narrow_viscosity = 2 };

/// Vectors per face in the buffer: five fluxes of the solve, the flux of heat across the face, and
/// with narrow viscosity those of momentum. The filter needs five.
template <int Visc>
inline constexpr int face_record = Visc == narrow_viscosity ? 9 : 6;
inline constexpr int largest_face_record = 9;
inline constexpr int filter_record = 5;

/// Fields of G that join the fluxes along D: stress on x, y, z, energy flux.
inline constexpr int stress_component[3][4] = {{0, 1, 2, 6}, {1, 3, 4, 7}, {2, 4, 5, 8}};
inline constexpr int first_gradient = n_stresses;  ///< field of G with d u_0 / d x_0

// Components of the velocity gradient (3 a + b = d u_a / d x_b) that a face of a cut line along D
// needs beside its own differences: the two shear partners and the two transverse parts of the
// dilatation.
inline constexpr int shear_partner[3][3] = {{0, 1, 2}, {3, 0, 5}, {6, 7, 0}};
inline constexpr int transverse_1[3] = {4, 0, 0};
inline constexpr int transverse_2[3] = {8, 8, 4};

/// Class of a flux component about a mirrored end (line_table.hpp).
template <int D>
constexpr int class_of(int component) {
  if (component == 0 || component == 4) return 0;
  return component == 1 + D ? 1 : 2;
}

/// Asks for the cache lines of `fields` rows at p; never faults, whatever p is.
OCU_INLINE void prefetch_next(const Real* p, Index sf, int fields) {
  for (int f = 0; f < fields; ++f) __builtin_prefetch(p + f * sf, 0, 2);
}

/// Where the node values of a tile of lines lie: node i of field f at p[f * sf + i * sl].
struct Source {
  const Real* p;
  Index sf, sl;
  const Real* mu;  ///< shear viscosity, same stride
  /// Nodal: stress on x, y, z and energy flux. Narrow: shear partners (ascending component),
  /// transverse parts.
  const Real* g[4];
  Index gl;
  bool face_heat = true;  ///< kappa acts across faces
};

/// Same coefficients in all lanes.
struct UniformCoef {
  const Real* rows;
  const Real* inverse_spacing;
  const Real* inverse_jacobian;
  OCU_INLINE Vec row(int j, int c) const {
    return splat(rows[static_cast<Index>(j) * flux_row_size + c]);
  }
  OCU_INLINE Vec inverse_dx(int j) const { return splat(inverse_spacing[j]); }
  OCU_INLINE Vec inverse_h(int i) const { return splat(inverse_jacobian[i]); }
};

/// Common rows up to the face `split`, then a row per lane; metric per lane.
struct LaneCoef {
  const Real* rows;
  const Real* tail;  ///< [face - split, flux_row_size] vectors
  int split;
  const Real* inverse_spacing;   ///< vectors
  const Real* inverse_jacobian;  ///< vectors
  OCU_INLINE Vec row(int j, int c) const {
    if (j < split) return splat(rows[static_cast<Index>(j) * flux_row_size + c]);
    return load(tail + (static_cast<Index>(j - split) * flux_row_size + c) * tile_width);
  }
  OCU_INLINE Vec inverse_dx(int j) const {
    return load(inverse_spacing + static_cast<Index>(j) * tile_width);
  }
  OCU_INLINE Vec inverse_h(int i) const {
    return load(inverse_jacobian + static_cast<Index>(i) * tile_width);
  }
};

struct Flux {
  Vec q[5];
};

/// Gas constants in vectors, made once per line.
struct GasVec {
  Vec R, inverse_gm1, rest_pressure;
  OCU_INLINE explicit GasVec(const Context& c)
      : R(splat(c.gas_constant)),
        inverse_gm1(splat(1.0 / (c.gamma - 1.0))),
        rest_pressure(splat(c.rest_pressure)) {}
};

/// What the momentum fluxes leave out of the pressure.
OCU_INLINE double pressure_offset(const Context& ctx) {
  return is_single ? ctx.rest_pressure : 0.0;
}

/// Convective flux along D with the bulk pressure: seed eqs. 4-7, E + p from (rho, u, T).
template <int D>
OCU_INLINE Flux nodal_flux(const GasVec& gas, const Real* p, Index sf) {
  const Vec rho = load(p), u = load(p + sf), v = load(p + 2 * sf), w = load(p + 3 * sf);
  const Vec pressure = rho * gas.R * load(p + 4 * sf);
  const Vec bulk = load(p + field_bulk * sf);
  const Vec total = pressure + bulk;
  const Vec push = is_single ? (pressure - gas.rest_pressure) + bulk : total;
  const Vec un = D == 0 ? u : (D == 1 ? v : w);
  const Vec m = rho * un;
  const Vec speed2 = madd(w, w, madd(v, v, u * u));
  const Vec density_of_energy = madd(splat(0.5) * rho, speed2, pressure * gas.inverse_gm1);
  Flux f;
  f.q[0] = m;
  f.q[1] = D == 0 ? madd(m, u, push) : m * u;
  f.q[2] = D == 1 ? madd(m, v, push) : m * v;
  f.q[3] = D == 2 ? madd(m, w, push) : m * w;
  f.q[4] = un * (density_of_energy + total);
  return f;
}

/// The same at a node of a line, less the stress where that is nodal (seed eqs. 8 and 9).
template <int D, int Visc>
OCU_INLINE Flux line_flux(const GasVec& gas, const Source& src, Index at) {
  Flux f = nodal_flux<D>(gas, src.p + at * src.sl, src.sf);
  if constexpr (Visc == nodal_viscosity) {
    for (int c = 0; c < 4; ++c) f.q[1 + c] = f.q[1 + c] - load(src.g[c] + at * src.gl);
  }
  return f;
}

/// State of the forward walk between calls (x-lines come block by block).
template <int Visc, bool Eight>
struct Forward {
  Flux w[Eight ? 6 : 4];
  Vec face[5];
  Vec T, kappa, u[3], mu, g[4];
  int seen = 0;
};

/// Diffusive fluxes at the face between the node before and node `label` into the buffer.
template <int D, int Visc, bool Eight, class Coef>
OCU_INLINE void diffusive_face(Forward<Visc, Eight>& s, const Source& src, Index at, int label,
                               const Coef& coef, Real* buf) {
  const Real* p = src.p + at * src.sl;
  const Vec T = load(p + 4 * src.sf), kappa = load(p + field_kappa * src.sf);
  const Vec inverse_dx = coef.inverse_dx(label);
  const Vec half = splat(0.5);
  Real* out = buf + static_cast<Index>(label) * face_record<Visc> * tile_width;
  Vec energy = (half * (s.kappa + kappa)) * ((s.T - T) * inverse_dx);
  if constexpr (Visc == nodal_viscosity) {
    if (!src.face_heat) energy = splat(0.0);
  }
  if constexpr (Visc == narrow_viscosity) {
    Vec u[3], g[4];
    for (int a = 0; a < 3; ++a) u[a] = load(p + (1 + a) * src.sf);
    for (int q = 0; q < 4; ++q) g[q] = load(src.g[q] + at * src.gl);
    const Vec mu = load(src.mu + at * src.sl);
    const Vec mu_face = half * (s.mu + mu);
    // seed eq. 8 with mu + mu* also in the -2/3 term; beta* sits in the nodal bulk pressure.
    int shear = 0;
    for (int a = 0; a < 3; ++a) {
      const Vec slope = (u[a] - s.u[a]) * inverse_dx;
      Vec stress;
      if (a == D) {
        const Vec theta = slope + half * (s.g[2] + g[2]) + half * (s.g[3] + g[3]);
        stress = mu_face * (slope + slope - splat(2.0 / 3.0) * theta);
      } else {
        stress = mu_face * (slope + half * (s.g[shear] + g[shear]));
        ++shear;
      }
      store(out + (6 + a) * tile_width, -stress);
      energy = energy - half * (s.u[a] + u[a]) * stress;
    }
    for (int a = 0; a < 3; ++a) s.u[a] = u[a];
    for (int q = 0; q < 4; ++q) s.g[q] = g[q];
    s.mu = mu;
  }
  store(out + 5 * tile_width, energy);
  s.T = T;
  s.kappa = kappa;
}

/// Right side and elimination of face j from the window; b0..b1 straddle the face.
template <int D, int Visc, class Coef>
OCU_INLINE void eliminate_face(Vec face[5], const Flux& a1, const Flux& a0, const Flux& b0,
                               const Flux& b1, const Flux* outer, int j, const Coef& coef,
                               Real* buf) {
  Real* out = buf + static_cast<Index>(j) * face_record<Visc> * tile_width;
#pragma GCC unroll 5
  for (int q = 0; q < 5; ++q) {
    const int k = flux_class_size * class_of<D>(q);
    Vec rhs = madd(coef.row(j, k + 1), a1.q[q] + b1.q[q], coef.row(j, k) * (a0.q[q] + b0.q[q]));
    if (outer != nullptr) rhs = madd(coef.row(j, k + 2), outer[0].q[q] + outer[5].q[q], rhs);
    face[q] = nmadd(coef.row(j, k + 3), face[q], rhs);
    store(out + q * tile_width, face[q]);
  }
}

/// Takes nodes [begin, end) (memory places `at_begin` ...) into the walk.
template <int D, int Visc, bool Eight, class Coef>
OCU_INLINE void forward_nodes(Forward<Visc, Eight>& s, const GasVec& gas, const Source& src,
                              int begin, int end, const Coef& coef, Real* buf) {
  constexpr int width = Eight ? 6 : 4;
  constexpr int lag = Eight ? 2 : 1;  // a face waits for this many nodes behind it
  int i = begin;
  for (; i < end && s.seen < width - 1; ++i, ++s.seen) {
    diffusive_face<D>(s, src, i, i, coef, buf);
    s.w[s.seen] = line_flux<D, Visc>(gas, src, i);
  }
  if (i >= end) return;
  if constexpr (Eight) {
    for (; i < end; ++i) {
      diffusive_face<D>(s, src, i, i, coef, buf);
      s.w[5] = line_flux<D, Visc>(gas, src, i);
      eliminate_face<D, Visc>(s.face, s.w[1], s.w[2], s.w[3], s.w[4], s.w, i - lag, coef, buf);
      for (int m = 0; m < 5; ++m) s.w[m] = s.w[m + 1];
    }
  } else {
    const auto step = [&](Flux& a, Flux& b, Flux& c, Flux& d, int node) {
      diffusive_face<D>(s, src, node, node, coef, buf);
      d = line_flux<D, Visc>(gas, src, node);
      eliminate_face<D, Visc>(s.face, a, b, c, d, nullptr, node - lag, coef, buf);
    };
    Flux w0 = s.w[0], w1 = s.w[1], w2 = s.w[2], w3;
    for (; i + 4 <= end; i += 4) {
      step(w0, w1, w2, w3, i);
      step(w1, w2, w3, w0, i + 1);
      step(w2, w3, w0, w1, i + 2);
      step(w3, w0, w1, w2, i + 3);
    }
    for (; i < end; ++i) {
      step(w0, w1, w2, w3, i);
      w0 = w1;
      w1 = w2;
      w2 = w3;
    }
    s.w[0] = w0;
    s.w[1] = w1;
    s.w[2] = w2;
  }
}

/// Starts the walk at the first face of the solve; a node missing before a ghosted line's first one
/// is replaced by it (its weight is zero there).
template <int D, int Visc, bool Eight>
OCU_INLINE void start_forward(Forward<Visc, Eight>& s, const GasVec& gas, const Source& src,
                              int first_node, int missing) {
  const Real* p = src.p + first_node * src.sl;
  for (int q = 0; q < 5; ++q) s.face[q] = splat(0.0);
  for (int m = 0; m < missing; ++m) s.w[m] = line_flux<D, Visc>(gas, src, first_node);
  s.seen = missing;
  s.T = load(p + 4 * src.sf);
  s.kappa = load(p + field_kappa * src.sf);
  if constexpr (Visc == narrow_viscosity) {
    for (int a = 0; a < 3; ++a) s.u[a] = load(p + (1 + a) * src.sf);
    for (int q = 0; q < 4; ++q) s.g[q] = load(src.g[q] + first_node * src.gl);
    s.mu = load(src.mu + first_node * src.sl);
  }
}

/// Completes the faces that wait for nodes beyond the last one of a ghosted line.
template <int D, int Visc, bool Eight, class Coef>
OCU_INLINE void end_forward(Forward<Visc, Eight>& s, int last_node, int missing, const Coef& coef,
                            Real* buf) {
  for (int m = 0; m < missing; ++m) {
    if constexpr (Eight) {
      s.w[5] = s.w[4];
      eliminate_face<D, Visc>(s.face, s.w[1], s.w[2], s.w[3], s.w[4], s.w, last_node + 1 + m - 2,
                              coef, buf);
      for (int k = 0; k < 5; ++k) s.w[k] = s.w[k + 1];
    } else {
      eliminate_face<D, Visc>(s.face, s.w[0], s.w[1], s.w[2], s.w[2], nullptr, last_node + m, coef,
                              buf);
    }
  }
}

/// Nodes of the walk for faces [face_begin, face_end]: from `first` to `last`, with the numbers of
/// nodes that do not exist before and behind.
struct Walk {
  int first, last, missing_low, missing_high;
};
template <bool Eight>
OCU_INLINE Walk walk_of(int n, int face_begin, int face_end) {
  constexpr int reach = Eight ? 3 : 2;
  Walk w{face_begin - reach, face_end + reach - 1, 0, 0};
  if (w.first < -4) {
    w.missing_low = -4 - w.first;
    w.first = -4;
  }
  if (w.last > n + 3) {
    w.missing_high = w.last - (n + 3);
    w.last = n + 3;
  }
  return w;
}

/// State of the backward walk between calls.
struct Backward {
  Vec face[5], right[5];
};

template <int D, int Visc, class Coef>
OCU_INLINE void substitute_face(Backward& s, int j, const Coef& coef, const Real* buf) {
  const Real* at = buf + static_cast<Index>(j) * face_record<Visc> * tile_width;
#pragma GCC unroll 5
  for (int q = 0; q < 5; ++q) {
    s.face[q] = nmadd(coef.row(j, flux_class_size * class_of<D>(q) + flux_weights + 1), s.face[q],
                      load(at + q * tile_width));
  }
}

/// Whole flux of face j: that of the solve and what crosses the face directly.
template <int Visc>
OCU_INLINE void total_flux(const Backward& s, int j, const Real* buf, Vec out[5]) {
  const Real* at = buf + static_cast<Index>(j) * face_record<Visc> * tile_width;
  for (int q = 0; q < 5; ++q) out[q] = s.face[q];
  out[4] = out[4] + load(at + 5 * tile_width);
  if constexpr (Visc == narrow_viscosity) {
    for (int a = 0; a < 3; ++a) out[1 + a] = out[1 + a] + load(at + (6 + a) * tile_width);
  }
}

/// Faces from the end of the solve down to face n.
template <int D, int Visc, class Coef>
OCU_INLINE void start_backward(Backward& s, int n, int face_end, const Coef& coef,
                               const Real* buf) {
  for (int q = 0; q < 5; ++q) s.face[q] = splat(0.0);
  for (int j = face_end; j >= n; --j) substitute_face<D, Visc>(s, j, coef, buf);
  total_flux<Visc>(s, n, buf, s.right);
}

/// Nodes from `high` down to `low`; the sink gets (node, divergence).
template <int D, int Visc, class Coef, class Sink>
OCU_INLINE void backward_nodes(Backward& s, int high, int low, const Coef& coef, const Real* buf,
                               Sink&& sink) {
  for (int i = high; i >= low; --i) {
    substitute_face<D, Visc>(s, i, coef, buf);
    Vec left[5], div[5];
    total_flux<Visc>(s, i, buf, left);
    const Vec inverse_h = coef.inverse_h(i);
    for (int q = 0; q < 5; ++q) {
      div[q] = (s.right[q] - left[q]) * inverse_h;
      s.right[q] = left[q];
    }
    sink(i, div);
  }
}

/// Substitution over faces from `face_end` down; the sink gets (node, divergence) from n - 1 to 0.
template <int D, int Visc, class Coef, class Sink>
OCU_INLINE void backward(int n, int face_end, const Coef& coef, const Real* buf, Sink&& sink) {
  Backward s;
  start_backward<D, Visc>(s, n, face_end, coef, buf);
  backward_nodes<D, Visc>(s, n - 1, 0, coef, buf, sink);
}

/// The walk starts with the known flux next to the first row that is solved.
OCU_INLINE void start_known(const Real* known, int faces, Index group, Vec face[5]) {
  if (known == nullptr) return;
  const Real* at = known + ((group + 1) * faces - 1) * 5 * tile_width;
  for (int q = 0; q < 5; ++q) face[q] = load(at + q * tile_width);
}
/// Known fluxes of the faces from `first` on into the buffer.
template <int Record>
OCU_INLINE void store_known(const Real* known, int faces, Index group, int first, Real* buf) {
  if (known == nullptr) return;
  const Real* at = known + group * faces * 5 * tile_width;
  for (int j = 0; j < faces; ++j) {
    Real* to = buf + static_cast<Index>(first + j) * Record * tile_width;
    for (int q = 0; q < 5; ++q) store(to + q * tile_width, load(at + (j * 5 + q) * tile_width));
  }
}
/// Both ends after the forward walk: below, the rows held only the last of the known fluxes.
template <int Record>
OCU_INLINE void store_known_fluxes(const LineView& line, int n, Index group, Real* buf) {
  const KnownEnd &low = line.known_low, &high = line.known_high;
  store_known<Record>(low.flux, low.flux_faces, group, 0, buf);
  store_known<Record>(high.flux, high.flux_faces, group, n + 1 - high.flux_faces, buf);
}

/// Lanes of a line solve, for the first-order flux at marked nodes.
struct Lanes {
  const Real* q[tile_width];             ///< conserved state at node 0
  const std::uint8_t* mark[tile_width];  ///< mark at node 0
  int n[tile_width];
  LaneEnd low[tile_width], high[tile_width];
  const Real* low_state[tile_width];  ///< ghost primitive state, stride state_stride
  const Real* high_state[tile_width];
  Index low_stride[tile_width], high_stride[tile_width];
  Index qf, ql;                              ///< strides of the conserved state by field and node
  Index ml;                                  ///< stride of the marks by node
  unsigned active;                           ///< lanes in use
  unsigned low_marked = 0, high_marked = 0;  ///< lanes whose node beyond a border is marked
};

/// The same as `backward` in separate steps, with the periodic correction and with first-order
/// fluxes at the faces of marked nodes.
template <int D, int Visc, class Coef, class Sink>
OCU_INLINE void backward_slow(const Context& ctx, const LineView& line, int n, int face_end,
                              const Coef& coef, Real* buf, const Lanes* lanes, Sink&& sink);

}  // namespace ocublast::flow::OCU_ISA
