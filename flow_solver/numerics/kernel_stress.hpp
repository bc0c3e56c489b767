#pragma once

// Viscous stress and heat flux at nodes (seed eqs. 8 and 9), from sixth-order differences in index
// space over the metric; they join the convective fluxes in the compact solve, so that viscous
// terms are of sixth order on smooth non-uniform grids. Fields of G: the stress xx xy xz yy yz zz,
// then the energy flux u tau + q per direction; with bodies the nine velocity gradients behind
// them, for the second-order fluxes of cut lines.

#include "flow_solver/numerics/kernel_sensor.hpp"

namespace ocublast::flow::inline OCU_PRECISION::OCU_ISA {

/// Stress and energy flux of one node vector into G.
OCU_INLINE void store_stress(const Context& ctx, const Metrics& m, int i0, int j, int k) {
  const Block& b = ctx.W;
  const Real* w = b.data + i0 + j * b.sj + k * b.sk;
  Real* out = ctx.G.data + i0 + j * ctx.G.sj + k * ctx.G.sk;
  Vec g[3][3], heat[3];
  for (int d = 0; d < 3; ++d) {
    const Index s = stride_of(b, d);
    heat[d] = splat(0.0);
    for (int a = 0; a < 3; ++a) g[a][d] = splat(0.0);
    if (!ctx.present[d]) continue;
    const Vec inverse_h = along(m.inverse, d, i0, j, k);
    for (int a = 0; a < 3; ++a) g[a][d] = central_slope(w + (1 + a) * b.sf, s, inverse_h);
    heat[d] = central_slope(w + 4 * b.sf, s, inverse_h);
  }
  if (ctx.bodies) {
    for (int a = 0; a < 3; ++a) {
      for (int d = 0; d < 3; ++d) store(out + (first_gradient + 3 * a + d) * ctx.G.sf, g[a][d]);
    }
  }
  const Vec mu_gas = gas_viscosity(ctx, load(w + 4 * b.sf));
  const Vec mu = mu_gas + load(w + field_mu * b.sf);
  Vec kappa = mu_gas * splat(ctx.heat_per_viscosity);
  if (ctx.paper) kappa = kappa + load(w + field_kappa * b.sf);
  // Seed eq. 8 has the gas's mu alone in the last term; with mu + mu* the stress is free of trace.
  const Vec spherical =
      splat(2.0 / 3.0) * (ctx.paper ? mu_gas : mu) * (g[0][0] + g[1][1] + g[2][2]);
  Vec tau[3][3];
  for (int a = 0; a < 3; ++a) {
    for (int d = a; d < 3; ++d) tau[a][d] = tau[d][a] = mu * (g[a][d] + g[d][a]);
    tau[a][a] = tau[a][a] - spherical;
  }
  const Vec u[3] = {load(w + b.sf), load(w + 2 * b.sf), load(w + 3 * b.sf)};
  int at = 0;
  for (int a = 0; a < 3; ++a) {
    for (int d = a; d < 3; ++d) store(out + at++ * ctx.G.sf, tau[a][d]);
  }
  for (int d = 0; d < 3; ++d) {
    const Vec work = u[0] * tau[0][d] + u[1] * tau[1][d] + u[2] * tau[2][d];
    store(out + at++ * ctx.G.sf, work + kappa * heat[d]);
  }
}

/// Ghosts of the stress beyond one end of lines along D; w and g at the node next to the end,
/// `step` and `gstep` one node inwards. A slip wall and a plane of symmetry mirror it, a no-slip
/// wall is reached by the odd continuation about the flux at the wall, an open end takes the first
/// ghost.
template <int D, class T>
OCU_INLINE void fill_stress_end(const Context& ctx, const LineView& line, bool low, const Real* w,
                                Index step, Real* g, Index gstep, int n) {
  using A = Access<T>;
  const Index sf = ctx.W.sf, gf = ctx.G.sf;
  const LaneEnd end = low ? line.low : line.high;
  if (line.periodic) {
    for (int layer = 0; layer < 4; ++layer) {
      for (int q = 0; q < 4; ++q) {
        Real* at = g + stress_component[D][q] * gf;
        A::put(at - (1 + layer) * gstep, A::get(at + (n - 1 - layer) * gstep));
      }
    }
    return;
  }
  if (end == LaneEnd::mirrored_slip) {
    for (int layer = 0; layer < 4; ++layer) {
      for (int q = 0; q < 4; ++q) {
        Real* at = g + stress_component[D][q] * gf;
        const T v = A::get(at + layer * gstep);
        A::put(at - (1 + layer) * gstep, q == D ? v : A::all(0.0) - v);
      }
    }
    return;
  }
  if (end == LaneEnd::domain_ghost) {
    for (int layer = 1; layer < 4; ++layer) {
      for (int q = 0; q < 4; ++q) {
        Real* at = g + stress_component[D][q] * gf;
        A::put(at - (1 + layer) * gstep, A::get(at - gstep));
      }
    }
    return;
  }
  const WallEnd& wall = low ? line.wall_low : line.wall_high;
  const auto slope = [&](int f, double value) {
    const Real* p = w + f * sf;
    return (A::all(wall_slope[0] * value) + A::all(wall_slope[1]) * A::get(p) +
            A::all(wall_slope[2]) * A::get(p + step) +
            A::all(wall_slope[3]) * A::get(p + 2 * step)) *
           A::all(wall.inverse_spacing);
  };
  const bool isothermal = wall.temperature > 0.0;
  const T T_wall = isothermal ? A::all(wall.temperature) : A::get(w + 4 * sf);
  const T mu_gas = gas_viscosity(ctx, T_wall);
  const T mu = mu_gas + A::get(w + field_mu * sf);
  T at_wall[4];
  at_wall[3] = isothermal ? mu_gas * A::all(ctx.heat_per_viscosity) * slope(4, wall.temperature)
                          : A::all(0.0);
  for (int a = 0; a < 3; ++a) {
    if (a == D) continue;
    at_wall[a] = A::all(0.0);
    if (end == LaneEnd::held_slip_wall) continue;
    at_wall[a] = mu * slope(1 + a, wall.velocity[a]);
    at_wall[3] = at_wall[3] + A::all(wall.velocity[a]) * at_wall[a];
  }
  for (int layer = 0; layer < 4; ++layer) {
    for (int q = 0; q < 4; ++q) {
      Real* at = g + stress_component[D][q] * gf;
      const T v = A::get(at + layer * gstep);
      // The normal stress is even; the other fluxes end at the wall with their value there.
      A::put(at - (1 + layer) * gstep, q == D ? v : A::all(2.0) * at_wall[q] - v);
    }
  }
}

/// Stress of rows [j0, j1) of plane k with the ghosts of their x lines; with the first ghost rows
/// of open y ends next to the first and the last row.
inline void stress_rows(const Context& shared, int k, int j0, int j1) {
  const Context ctx = shared;
  const Metrics m(ctx);
  const LineView &x = ctx.line[0], &y = ctx.line[1];
  const int n0 = ctx.n[0], n1 = ctx.n[1];
  const auto open = [](const LineView& line, LaneEnd end) {
    return !line.periodic && end == LaneEnd::domain_ghost;
  };
  const int first_tile = open(x, x.low) ? -1 : 0;
  const int end_tile = ctx.tiles + (open(x, x.high) && n0 % tile_width == 0 ? 1 : 0);
  const bool y_low = ctx.present[1] && open(y, y.low), y_high = ctx.present[1] && open(y, y.high);
  const int first = y_low && j0 == 0 ? -1 : j0, last = y_high && j1 == n1 ? n1 + 1 : j1;
  for (int j = first; j < last; ++j) {
    for (int t = first_tile; t < end_tile; ++t) store_stress(ctx, m, t * tile_width, j, k);
  }
  for (int j = j0; j < j1; ++j) {
    const Real* w = ctx.W.data + j * ctx.W.sj + k * ctx.W.sk;
    Real* g = ctx.G.data + j * ctx.G.sj + k * ctx.G.sk;
    fill_stress_end<0, Scalar>(ctx, x, true, w, 1, g, 1, n0);
    fill_stress_end<0, Scalar>(ctx, x, false, w + n0 - 1, -1, g + n0 - 1, -1, n0);
  }
}

/// Ghosts of the y lines of plane k, after all its rows.
inline void stress_ends_y(const Context& shared, int k) {
  if (!shared.present[1]) return;
  const Context ctx = shared;
  const LineView& y = ctx.line[1];
  const int n1 = ctx.n[1];
  for (int t = 0; t < ctx.tiles; ++t) {
    const Real* w = ctx.W.data + t * tile_width + k * ctx.W.sk;
    Real* g = ctx.G.data + t * tile_width + k * ctx.G.sk;
    const Index last = n1 - 1;
    fill_stress_end<1, Vec>(ctx, y, true, w, ctx.W.sj, g, ctx.G.sj, n1);
    fill_stress_end<1, Vec>(ctx, y, false, w + last * ctx.W.sj, -ctx.W.sj, g + last * ctx.G.sj,
                            -ctx.G.sj, n1);
  }
}

/// Ghosts of the z lines of row j, after all planes (with the first ghost planes of open ends).
inline void stress_ends_z(const Context& shared, int j) {
  const Context ctx = shared;
  const LineView& z = ctx.line[2];
  const Index last = ctx.n[2] - 1;
  for (int t = 0; t < ctx.tiles; ++t) {
    const Real* w = ctx.W.data + t * tile_width + j * ctx.W.sj;
    Real* g = ctx.G.data + t * tile_width + j * ctx.G.sj;
    fill_stress_end<2, Vec>(ctx, z, true, w, ctx.W.sk, g, ctx.G.sk, ctx.n[2]);
    fill_stress_end<2, Vec>(ctx, z, false, w + last * ctx.W.sk, -ctx.W.sk, g + last * ctx.G.sk,
                            -ctx.G.sk, ctx.n[2]);
  }
}

}  // namespace ocublast::flow::OCU_ISA
