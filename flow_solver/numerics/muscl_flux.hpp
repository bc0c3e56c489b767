#pragma once

// Fluxes of the MUSCL-HLLC scheme at a tile of faces at once. Reconstruction: primitives with van
// Leer's harmonic slope (van Leer 1977), so that a face value lies between its nodes' and stays
// positive. HLLC after Toro (2009, section 10.4) with the wave speeds of Einfeldt (1988). Faces of
// marked nodes: local Lax-Friedrichs without slopes, positive up to a Courant number of one.

#include "flow_solver/numerics/kernel_marked.hpp"

namespace ocublast::flow::inline OCU_PRECISION::OCU_ISA {

/// Primitives at one side of a face: density, velocity, pressure.
struct FaceState {
  Vec rho, u[3], p;
};

/// Flux through a face, and the pressure that is part of it (radial grids take it apart).
struct FaceFlux {
  Vec q[5];
  Vec p;
};

OCU_INLINE Vec harmonic_slope(Vec low, Vec high) {
  const Vec product = low * high;
  const Vec sum = low + high;
  const unsigned same = less(splat(0.0), product);
  const Vec safe = select(same, sum, splat(1.0));
  return select(same, splat(2.0) * product / safe, splat(0.0));
}

/// Node values in the order density, velocity, pressure.
OCU_INLINE FaceState node_values(const Vec gas_constant, const Real* p, Index sf) {
  FaceState s;
  s.rho = load(p);
  for (int a = 0; a < 3; ++a) s.u[a] = load(p + (1 + a) * sf);
  s.p = s.rho * gas_constant * load(p + 4 * sf);
  return s;
}

/// Value of node b on its side towards c (sign +1/2) or a (-1/2).
OCU_INLINE FaceState reconstruct(const FaceState& a, const FaceState& b, const FaceState& c,
                                 double half) {
  FaceState s;
  const auto value = [&](Vec low, Vec mid, Vec high) OCU_FORCE {
    return mid + splat(half) * harmonic_slope(mid - low, high - mid);
  };
  s.rho = value(a.rho, b.rho, c.rho);
  for (int d = 0; d < 3; ++d) s.u[d] = value(a.u[d], b.u[d], c.u[d]);
  s.p = value(a.p, b.p, c.p);
  return s;
}

OCU_INLINE Vec total_energy(const FaceState& s, Vec inverse_gm1) {
  return s.p * inverse_gm1 +
         splat(0.5) * s.rho * (s.u[0] * s.u[0] + s.u[1] * s.u[1] + s.u[2] * s.u[2]);
}

template <int D>
OCU_INLINE FaceFlux physical_flux(const FaceState& s, Vec energy) {
  FaceFlux f;
  const Vec m = s.rho * s.u[D];
  f.q[0] = m;
  for (int a = 0; a < 3; ++a) f.q[1 + a] = m * s.u[a];
  f.q[1 + D] = f.q[1 + D] + s.p;
  f.q[4] = s.u[D] * (energy + s.p);
  f.p = s.p;
  return f;
}

template <int D>
OCU_INLINE FaceFlux flux_hllc(const FaceState& l, const FaceState& r, double gamma) {
  const Vec g = splat(gamma), inverse_gm1 = splat(1.0 / (gamma - 1.0)), half = splat(0.5);
  const Vec E_l = total_energy(l, inverse_gm1), E_r = total_energy(r, inverse_gm1);
  const Vec c_l = vsqrt(g * l.p / l.rho), c_r = vsqrt(g * r.p / r.rho);
  // Roe averages of velocity and sound speed (Einfeldt 1988, with the jump of u in the sound
  // speed).
  const Vec w_l = vsqrt(l.rho), w_r = vsqrt(r.rho);
  const Vec weight = splat(1.0) / (w_l + w_r);
  const Vec u_m = (w_l * l.u[D] + w_r * r.u[D]) * weight;
  const Vec jump = r.u[D] - l.u[D];
  const Vec c_m = vsqrt((w_l * c_l * c_l + w_r * c_r * c_r) * weight +
                        half * w_l * w_r * weight * weight * jump * jump);
  const Vec S_l = vmin(l.u[D] - c_l, u_m - c_m), S_r = vmax(r.u[D] + c_r, u_m + c_m);
  // Toro eq. 10.37; S_l < u_l and u_r < S_r keep the divisor negative.
  const Vec m_l = l.rho * (S_l - l.u[D]), m_r = r.rho * (S_r - r.u[D]);
  const Vec S_star = (r.p - l.p + m_l * l.u[D] - m_r * r.u[D]) / (m_l - m_r);
  const unsigned from_left = ~less(S_star, splat(0.0)) & all_lanes;
  const auto pick = [&](Vec a, Vec b) OCU_FORCE { return select(from_left, a, b); };
  FaceState k;
  k.rho = pick(l.rho, r.rho);
  for (int a = 0; a < 3; ++a) k.u[a] = pick(l.u[a], r.u[a]);
  k.p = pick(l.p, r.p);
  const Vec E = pick(E_l, E_r), S = pick(S_l, S_r), m = pick(m_l, m_r);
  FaceFlux f;
  // Fluxes of the star state in terms of S_star, so that a face at rest passes exactly nothing.
  const Vec rho_star = m / (S - S_star);
  f.p = k.p + m * (S_star - k.u[D]);
  const Vec e_star = E / k.rho + (S_star - k.u[D]) * (S_star + k.p / m);
  const Vec mass = rho_star * S_star;
  f.q[0] = mass;
  for (int a = 0; a < 3; ++a) f.q[1 + a] = a == D ? mass * S_star + f.p : mass * k.u[a];
  f.q[4] = S_star * (rho_star * e_star + f.p);
  const unsigned supersonic = (less(splat(0.0), S_l) | less(S_r, splat(0.0))) & all_lanes;
  if (supersonic != 0) {
    const FaceFlux whole = physical_flux<D>(k, E);
    for (int q = 0; q < 5; ++q) f.q[q] = select(supersonic, whole.q[q], f.q[q]);
    f.p = select(supersonic, whole.p, f.p);
  }
  return f;
}

template <int D>
OCU_INLINE FaceFlux flux_lax_friedrichs(const FaceState& l, const FaceState& r, double gamma) {
  const Vec g = splat(gamma), inverse_gm1 = splat(1.0 / (gamma - 1.0)), half = splat(0.5);
  const Vec E_l = total_energy(l, inverse_gm1), E_r = total_energy(r, inverse_gm1);
  const FaceFlux a = physical_flux<D>(l, E_l), b = physical_flux<D>(r, E_r);
  const Vec speed =
      half * vmax(vabs(l.u[D]) + vsqrt(g * l.p / l.rho), vabs(r.u[D]) + vsqrt(g * r.p / r.rho));
  FaceFlux f;
  f.q[0] = half * (a.q[0] + b.q[0]) - speed * (r.rho - l.rho);
  for (int d = 0; d < 3; ++d) {
    f.q[1 + d] = half * (a.q[1 + d] + b.q[1 + d]) - speed * (r.rho * r.u[d] - l.rho * l.u[d]);
  }
  f.q[4] = half * (a.q[4] + b.q[4]) - speed * (E_r - E_l);
  f.p = half * (l.p + r.p);
  return f;
}

/// Flux at the faces between nodes p - s and p; lanes in `first_order` border a marked node.
template <int D>
OCU_INLINE FaceFlux muscl_face(const Context& ctx, const Real* p, Index sf, Index s,
                               unsigned first_order) {
  const Vec R = splat(ctx.gas_constant);
  const FaceState b = node_values(R, p - s, sf), c = node_values(R, p, sf);
  if (first_order == all_lanes) return flux_lax_friedrichs<D>(b, c, ctx.gamma);
  if (ctx.stage == 0 && !ctx.any_mark) return flux_hllc<D>(b, c, ctx.gamma);  // predictor
  const FaceState a = node_values(R, p - 2 * s, sf), d = node_values(R, p + s, sf);
  FaceFlux f = flux_hllc<D>(reconstruct(a, b, c, 0.5), reconstruct(b, c, d, -0.5), ctx.gamma);
  if (first_order != 0) {
    const FaceFlux low = flux_lax_friedrichs<D>(b, c, ctx.gamma);
    for (int q = 0; q < 5; ++q) f.q[q] = select(first_order, low.q[q], f.q[q]);
    f.p = select(first_order, low.p, f.p);
  }
  return f;
}

}  // namespace ocublast::flow::OCU_ISA
