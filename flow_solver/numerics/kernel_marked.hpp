#pragma once

// Slow copy of the backward pass: periodic lines, and lines with marked nodes, whose faces carry
// the local Lax-Friedrichs flux of the state at the start of the step. Frozen over the stages it
// makes the whole step of such a node one Euler step, positive for a convective number up to one.

#include "flow_solver/numerics/kernel_line.hpp"

namespace ocublast::flow::inline OCU_PRECISION::OCU_ISA {

struct PointState {
  double q[5];
  double u[3];
  double p, c;
};

OCU_INLINE PointState point_from_conserved(const Context& ctx, const double q[5]) {
  PointState s;
  for (int f = 0; f < 5; ++f) s.q[f] = q[f];
  const double inverse = 1.0 / q[0];
  for (int a = 0; a < 3; ++a) s.u[a] = q[1 + a] * inverse;
  const double kinetic = 0.5 * (q[1] * s.u[0] + q[2] * s.u[1] + q[3] * s.u[2]);
  s.p = (ctx.gamma - 1.0) * (q[4] - kinetic);
  const double c2 = ctx.gamma * s.p * inverse;
  s.c = c2 > 0.0 ? __builtin_sqrt(c2) : 0.0;
  return s;
}

OCU_INLINE PointState point_from_primitive(const Context& ctx, double rho, const double u[3],
                                           double T) {
  const double p = rho * ctx.gas_constant * T;
  const double q[5] = {
      rho, rho * u[0], rho * u[1], rho * u[2],
      p / (ctx.gamma - 1.0) + 0.5 * rho * (u[0] * u[0] + u[1] * u[1] + u[2] * u[2])};
  return point_from_conserved(ctx, q);
}

/// State across the end of a lane next to own state s. At an immersed wall `ghost` is its motion:
/// unit normal (zero: no slip), velocity; at a held one its velocity.
template <int D>
OCU_INLINE PointState state_across(const Context& ctx, LaneEnd end, const PointState& s,
                                   const Real* ghost, Index stride) {
  double u[3] = {s.u[0], s.u[1], s.u[2]};
  const double T = s.p / (s.q[0] * ctx.gas_constant);
  if (end == LaneEnd::mirrored_slip || end == LaneEnd::held_slip_wall) {
    u[D] = -u[D];
    return point_from_primitive(ctx, s.q[0], u, T);
  }
  if (end == LaneEnd::held_wall) {
    for (int a = 0; a < 3; ++a) u[a] = 2.0 * ghost[a] - u[a];
    return point_from_primitive(ctx, s.q[0], u, T);
  }
  if (end == LaneEnd::wall) {
    // The own state mirrored: a flux between the interpolated ghost and the first node can swallow
    // a supersonic stream.
    const Real* normal = ghost;
    const Real* wall = ghost + 3;
    double approach = 0.0;
    bool slip = false;
    for (int a = 0; a < 3; ++a) {
      approach += (s.u[a] - wall[a]) * normal[a];
      slip = slip || normal[a] != 0.0;
    }
    for (int a = 0; a < 3; ++a) {
      u[a] = slip ? s.u[a] - 2.0 * approach * normal[a] : 2.0 * wall[a] - s.u[a];
    }
    return point_from_primitive(ctx, s.q[0], u, T);
  }
  for (int a = 0; a < 3; ++a) u[a] = ghost[(1 + a) * stride];
  return point_from_primitive(ctx, ghost[0], u, ghost[4 * stride]);
}

template <int D>
OCU_INLINE void first_order_flux(const PointState& l, const PointState& r, double f[5]) {
  const double al = (l.u[D] < 0.0 ? -l.u[D] : l.u[D]) + l.c;
  const double ar = (r.u[D] < 0.0 ? -r.u[D] : r.u[D]) + r.c;
  const double a = al > ar ? al : ar;
  for (int q = 0; q < 5; ++q) {
    double fl = l.q[q] * l.u[D], fr = r.q[q] * r.u[D];
    if (q == 1 + D) {
      fl += l.p;
      fr += r.p;
    }
    if (q == 4) {
      fl += l.p * l.u[D];
      fr += r.p * r.u[D];
    }
    f[q] = 0.5 * (fl + fr) - 0.5 * a * (r.q[q] - l.q[q]);
  }
}

/// Whether a face of a lane borders a marked node.
OCU_INLINE bool touches_mark(const Lanes& lanes, int l, int j) {
  const int n = lanes.n[l];
  const bool periodic = lanes.low[l] == LaneEnd::periodic;
  const auto marked = [&](int i) { return lanes.mark[l][i * lanes.ml] != 0; };
  const bool left =
      j > 0 ? marked(j - 1) : (periodic && marked(n - 1)) || ((lanes.low_marked >> l) & 1u) != 0;
  const bool right =
      j < n ? marked(j) : (periodic && marked(0)) || ((lanes.high_marked >> l) & 1u) != 0;
  return left || right;
}

/// Replaces the total face fluxes of marked nodes in the buffer (diffusive parts set to zero).
template <int D, int Visc>
[[gnu::noinline]] void replace_marked(const Context& ctx, const Lanes& lanes, Real* buf) {
  for (int l = 0; l < tile_width; ++l) {
    if (((lanes.active >> l) & 1u) == 0) continue;
    const int n = lanes.n[l];
    const auto state = [&](int i) {
      double q[5];
      for (int f = 0; f < 5; ++f) q[f] = lanes.q[l][f * lanes.qf + i * lanes.ql];
      return point_from_conserved(ctx, q);
    };
    const bool periodic = lanes.low[l] == LaneEnd::periodic;
    for (int j = 0; j <= n; ++j) {
      if (!touches_mark(lanes, l, j)) continue;
      double f[5];
      if (periodic && (j == 0 || j == n)) {
        first_order_flux<D>(state(n - 1), state(0), f);
      } else if ((j == 0 && lanes.low[l] == LaneEnd::neighbour) ||
                 (j == n && lanes.high[l] == LaneEnd::neighbour)) {
        first_order_flux<D>(state(j - 1), state(j), f);
      } else if (j == 0) {
        const PointState own = state(0);
        first_order_flux<D>(
            state_across<D>(ctx, lanes.low[l], own, lanes.low_state[l], lanes.low_stride[l]), own,
            f);
      } else if (j == n) {
        const PointState own = state(n - 1);
        first_order_flux<D>(
            own,
            state_across<D>(ctx, lanes.high[l], own, lanes.high_state[l], lanes.high_stride[l]), f);
      } else {
        first_order_flux<D>(state(j - 1), state(j), f);
      }
      Real* face = buf + static_cast<Index>(j) * face_record<Visc> * tile_width;
      f[1 + D] -= pressure_offset(ctx);
      for (int q = 0; q < 5; ++q) face[q * tile_width + l] = rounded(f[q]);
      for (int q = 5; q < face_record<Visc>; ++q) face[q * tile_width + l] = 0.0;
    }
  }
}

template <int D, int Visc, class Coef, class Sink>
OCU_INLINE void backward_slow(const Context& ctx, const LineView& line, int n, int face_end,
                              const Coef& coef, Real* buf, const Lanes* lanes, Sink&& sink) {
  const auto at = [&](int j) {
    return buf + static_cast<Index>(j) * face_record<Visc> * tile_width;
  };
  for (int j = face_end - 1; j >= 0; --j) {
    for (int q = 0; q < 5; ++q) {
      const Vec above = load(at(j + 1) + q * tile_width);
      store(at(j) + q * tile_width,
            nmadd(coef.row(j, flux_class_size * class_of<D>(q) + flux_weights + 1), above,
                  load(at(j) + q * tile_width)));
    }
  }
  if (line.periodic) {
    Vec shift[5];
    for (int q = 0; q < 5; ++q) {
      shift[q] = (load(at(0) + q * tile_width) +
                  splat(line.flux_wrap_last) * load(at(n - 1) + q * tile_width)) *
                 splat(line.flux_wrap_scale);
    }
    for (int j = 0; j < n; ++j) {
      for (int q = 0; q < 5; ++q) {
        Real* face = at(j) + q * tile_width;
        store(face, load(face) - splat(line.flux_wrap[j]) * shift[q]);
      }
    }
    for (int q = 0; q < 5; ++q) store(at(n) + q * tile_width, load(at(0) + q * tile_width));
  }
  if (lanes != nullptr) replace_marked<D, Visc>(ctx, *lanes, buf);
  for (int i = n - 1; i >= 0; --i) {
    Vec div[5];
    for (int q = 0; q < 5; ++q) {
      Vec right = load(at(i + 1) + q * tile_width), left = load(at(i) + q * tile_width);
      if (q == 4) {
        right = right + load(at(i + 1) + 5 * tile_width);
        left = left + load(at(i) + 5 * tile_width);
      } else if (Visc == narrow_viscosity && q > 0) {
        right = right + load(at(i + 1) + (5 + q) * tile_width);
        left = left + load(at(i) + (5 + q) * tile_width);
      }
      div[q] = (right - left) * coef.inverse_h(i);
    }
    sink(i, div);
  }
}

}  // namespace ocublast::flow::OCU_ISA
