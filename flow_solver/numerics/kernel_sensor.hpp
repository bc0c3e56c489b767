#pragma once

// Artificial diffusivity, once per step (seed eqs. 10-12, after Kawai and Lele 2008): explicit
// fourth differences of the dilatation (in compression only) or of the strain rate, and of the
// internal energy; nine-point Gaussian (Cook and Cabot 2005); cap on the diffusivities. In R: field
// 0 theta, 1 bulk sensor, 2 heat sensor, 3 strain rate, 4 shear sensor.

#include <limits>

#include "flow_solver/numerics/kernel_gas.hpp"
#include "flow_solver/numerics/kernel_update.hpp"

namespace ocublast::flow::inline OCU_PRECISION::OCU_ISA {

enum SensorField : int {
  sensor_theta = 0,
  sensor_bulk = 1,
  sensor_heat = 2,
  sensor_strain = 3,
  sensor_shear = 4
};

// Truncated Gaussian of width four cells; sum one, no response to the shortest wave.
inline constexpr double gauss[5] = {3565.0 / 10368.0, 3091.0 / 12960.0, 1997.0 / 25920.0,
                                    149.0 / 12960.0, 107.0 / 103680.0};
// Spectral radius of the discrete diffusion by h^2: the compact derivative of the central
// dilatation (largest product of both symbols), and the narrow second difference.
inline constexpr double bulk_radius = 1.79;
inline constexpr double narrow_radius = 4.0;

OCU_INLINE Index stride_of(const Block& b, int axis) {
  return axis == 0 ? 1 : (axis == 1 ? b.sj : b.sk);
}

/// Metric along an axis at node vector i0 of row j, plane k.
OCU_INLINE Vec along(const Real* const values[3], int axis, int i0, int j, int k) {
  if (axis == 0) return load(values[0] + i0);
  return splat(axis == 1 ? values[1][j] : values[2][k]);
}

struct Metrics {
  const Real* h[3];
  const Real* inverse[3];
  OCU_INLINE explicit Metrics(const Context& ctx) {
    for (int a = 0; a < 3; ++a) {
      h[a] = ctx.line[a].jacobian;
      inverse[a] = ctx.line[a].inverse_jacobian;
    }
  }
};

/// Second-order central dilatation at the node vector w.
OCU_INLINE Vec dilatation(const Context& ctx, const Metrics& m, const Real* w, int i0, int j,
                          int k) {
  const Block& b = ctx.W;
  Vec theta = splat(0.0);
  for (int a = 0; a < 3; ++a) {
    if (!ctx.present[a]) continue;
    const Index s = stride_of(b, a);
    const Real* u = w + (1 + a) * b.sf;
    theta = theta + (load(u + s) - load(u - s)) * (splat(0.5) * along(m.inverse, a, i0, j, k));
  }
  return theta;
}

/// Sixth-order central slope of the field at p along its stride.
OCU_INLINE Vec central_slope(const Real* p, Index s, Vec inverse_h) {
  return (splat(45.0) * (load(p + s) - load(p - s)) -
          splat(9.0) * (load(p + 2 * s) - load(p - 2 * s)) + (load(p + 3 * s) - load(p - 3 * s))) *
         (splat(1.0 / 60.0) * inverse_h);
}

/// Sixth-order central dilatation.
OCU_INLINE Vec smooth_dilatation(const Context& ctx, const Metrics& m, const Real* w, int i0, int j,
                                 int k) {
  Vec theta = splat(0.0);
  for (int a = 0; a < 3; ++a) {
    if (!ctx.present[a]) continue;
    theta = theta + central_slope(w + (1 + a) * ctx.W.sf, stride_of(ctx.W, a),
                                  along(m.inverse, a, i0, j, k));
  }
  return theta;
}

OCU_INLINE Vec fourth_difference(const Real* p, Index s) {
  return (load(p - 2 * s) + load(p + 2 * s)) - splat(4.0) * (load(p - s) + load(p + s)) +
         splat(6.0) * load(p);
}

/// Magnitude of the strain rate tensor, seed eq. 12.
OCU_INLINE Vec strain_rate(const Context& ctx, const Metrics& m, const Real* w, int i0, int j,
                           int k) {
  Vec g[3][3];
  const Block& b = ctx.W;
  for (int a = 0; a < 3; ++a) {
    for (int d = 0; d < 3; ++d) {
      g[a][d] = splat(0.0);
      if (!ctx.present[d]) continue;
      const Index s = stride_of(b, d);
      const Real* u = w + (1 + a) * b.sf;
      g[a][d] = (load(u + s) - load(u - s)) * (splat(0.5) * along(m.inverse, d, i0, j, k));
    }
  }
  Vec sum = splat(0.0);
  for (int a = 0; a < 3; ++a) {
    for (int d = 0; d < 3; ++d) {
      const Vec half = splat(0.5) * (g[a][d] + g[d][a]);
      sum = sum + half * half;
    }
  }
  return vsqrt(sum);
}

inline void bulk_rows(const Context& shared, int k, int j0, int j1) {
  const Context ctx = shared;
  const Metrics m(ctx);
  const Block& b = ctx.W;
  const int n0 = ctx.n[0];
  for (int j = j0; j < j1; ++j) {
    Real* row = b.data + k * b.sk + j * b.sj + field_bulk * b.sf;
    for (int t = 0; t < ctx.tiles; ++t) {
      const int i0 = t * tile_width;
      const Real* w = row - field_bulk * b.sf + i0;
      const Vec theta =
          ctx.paper ? smooth_dilatation(ctx, m, w, i0, j, k) : dilatation(ctx, m, w, i0, j, k);
      store(row + i0, -(load(w + field_beta * b.sf) * theta));
    }
    const LineView& x = ctx.line[0];
    for (int g = 0; g < 4; ++g) {
      const int low = x.periodic ? n0 - 1 - g : (x.low == LaneEnd::domain_ghost ? 0 : g);
      const int high = x.periodic ? g : (x.high == LaneEnd::domain_ghost ? n0 - 1 : n0 - 1 - g);
      row[n0 + g] = row[high];
      row[-1 - g] = row[low];
    }
  }
}

inline void bulk_ghost_rows(const Context& ctx, int k) {
  if (!ctx.present[1]) return;
  const Block& b = ctx.W;
  Real* plane = b.data + k * b.sk + field_bulk * b.sf;
  const int n1 = ctx.n[1];
  const LineView& y = ctx.line[1];
  for (int g = 0; g < 4; ++g) {
    const int low = y.periodic ? n1 - 1 - g : (y.low == LaneEnd::domain_ghost ? 0 : g);
    const int high = y.periodic ? g : (y.high == LaneEnd::domain_ghost ? n1 - 1 : n1 - 1 - g);
    for (int t = 0; t < ctx.tiles; ++t) {
      const int i0 = t * tile_width;
      store(plane + (-1 - g) * b.sj + i0, load(plane + low * b.sj + i0));
      store(plane + (n1 + g) * b.sj + i0, load(plane + high * b.sj + i0));
    }
  }
}

inline void theta_plane(const Context& shared, int k, PlaneMaxima& out) {
  const Context ctx = shared;
  const Metrics m(ctx);
  const Block& b = ctx.W;
  Vec convection = splat(0.0), fastest = splat(0.0), p_max = splat(0.0);
  Vec p_min = splat(std::numeric_limits<Real>::max());
  const Vec gamma_R = splat(ctx.gamma * ctx.gas_constant), R = splat(ctx.gas_constant);
  for (int j = 0; j < ctx.n[1]; ++j) {
    for (int t = 0; t < ctx.tiles; ++t) {
      const int i0 = t * tile_width;
      const Real* w = b.data + i0 + j * b.sj + k * b.sk;
      Real* r = ctx.R.data + i0 + j * ctx.R.sj + k * ctx.R.sk;
      store(r + sensor_theta * ctx.R.sf, dilatation(ctx, m, w, i0, j, k));
      if (ctx.need_strain) store(r + sensor_strain * ctx.R.sf, strain_rate(ctx, m, w, i0, j, k));
      const unsigned fluid = ctx.fluid[tile_at(ctx, t, j, k)];
      const Vec T = load(w + 4 * b.sf);
      const Vec c = vsqrt(gamma_R * T);
      const Vec p = load(w) * R * T;
      Vec rate = splat(0.0), one = splat(0.0);
      for (int a = 0; a < 3; ++a) {
        if (!ctx.present[a]) continue;
        const Vec axis_rate = (vabs(load(w + (1 + a) * b.sf)) + c) * along(m.inverse, a, i0, j, k);
        rate = rate + axis_rate;
        one = vmax(one, axis_rate);
      }
      if (fluid == all_lanes) {
        convection = vmax(convection, rate);
        fastest = vmax(fastest, one);
        p_max = vmax(p_max, p);
        p_min = vmin(p_min, p);
      } else {
        convection = vmax(convection, select(fluid, rate, convection));
        fastest = vmax(fastest, select(fluid, one, fastest));
        p_max = vmax(p_max, select(fluid, p, p_max));
        p_min = vmin(p_min, select(fluid, p, p_min));
      }
    }
  }
  out.convection = largest_lane(convection);
  out.fastest = largest_lane(fastest);
  out.p_max = largest_lane(p_max);
  out.p_min = smallest_lane(p_min);
}

inline long premark_plane(const Context& ctx, int k, double ratio) {
  const Block& b = ctx.W;
  const Vec X = splat(ratio), R = splat(ctx.gas_constant);
  long count = 0;
  for (int j = 0; j < ctx.n[1]; ++j) {
    for (int t = 0; t < ctx.tiles; ++t) {
      const Real* w = b.data + t * tile_width + j * b.sj + k * b.sk;
      const Real* T = w + 4 * b.sf;
      const Vec p = load(w) * R * load(T);
      const Vec high = X * p;
      unsigned hit = 0;
      for (int a = 0; a < 3; ++a) {
        if (!ctx.present[a]) continue;
        const Index s = stride_of(b, a);
        for (int side = -1; side <= 1; side += 2) {
          const Index d = side * s;
          const Vec other = load(w + d) * R * load(T + d);
          hit |= less(high, other) | less(X * other, p);
        }
      }
      hit &= ctx.fluid[tile_at(ctx, t, j, k)];
      if (hit != 0) count += note_failures(ctx, hit, t * tile_width, j, k);
    }
  }
  return count;
}

inline void sensor_rows(const Context& shared, int k, int j0, int j1) {
  const Context ctx = shared;
  const Metrics m(ctx);
  const Block& r = ctx.R;
  const Vec cv = splat(ctx.gas_constant / (ctx.gamma - 1.0)), zero = splat(0.0);
  for (int j = j0; j < j1; ++j) {
    for (int t = 0; t < ctx.tiles; ++t) {
      const int i0 = t * tile_width;
      Real* at = r.data + i0 + j * r.sj + k * r.sk;
      const Real* T = ctx.W.data + i0 + j * ctx.W.sj + k * ctx.W.sk + 4 * ctx.W.sf;
      const Real* bulk_of = at + (ctx.strain_sensor ? sensor_strain : sensor_theta) * r.sf;
      Vec bulk = zero, heat = zero, shear = zero;
      for (int a = 0; a < 3; ++a) {
        if (!ctx.present[a]) continue;
        const Vec h = along(m.h, a, i0, j, k);
        bulk = bulk + h * h * fourth_difference(bulk_of, stride_of(r, a));
        heat = heat + h * fourth_difference(T, stride_of(ctx.W, a));
        if (ctx.need_strain)
          shear = shear + h * h * fourth_difference(at + sensor_strain * r.sf, stride_of(r, a));
      }
      bulk = vabs(bulk);
      if (!ctx.strain_sensor) bulk = select(less(load(at + sensor_theta * r.sf), zero), bulk, zero);
      heat = vabs(cv * heat);
      shear = vabs(shear);
      const unsigned fluid = ctx.fluid[tile_at(ctx, t, j, k)];
      if (fluid != all_lanes) {
        bulk = select(fluid, bulk, zero);
        heat = select(fluid, heat, zero);
        shear = select(fluid, shear, zero);
      }
      store(at + sensor_bulk * r.sf, bulk);
      store(at + sensor_heat * r.sf, heat);
      if (ctx.need_strain) store(at + sensor_shear * r.sf, shear);
    }
  }
}

OCU_INLINE Vec gauss_sum(const Real* p, Index s) {
  Vec sum = splat(gauss[0]) * load(p);
#pragma GCC unroll 4
  for (int d = 1; d <= 4; ++d) sum = madd(splat(gauss[d]), load(p - d * s) + load(p + d * s), sum);
  return sum;
}

struct Diffusivity {
  Vec bulk, heat, shear;  ///< averaged sensors
};

/// Coefficients of one node vector from the averaged sensors; returns the diffusion rate.
OCU_INLINE Vec store_coefficients(const Context& ctx, const Metrics& m, const Diffusivity& s,
                                  int i0, int j, int k) {
  const Block& b = ctx.W;
  Real* w = b.data + i0 + j * b.sj + k * b.sk;
  const Vec rho = load(w), T = load(w + 4 * b.sf);
  Vec inverse_h2 = splat(0.0), nodal_h2 = splat(0.0);
  double directions = 0.0;
  for (int a = 0; a < 3; ++a) {
    if (!ctx.present[a]) continue;
    const Vec inverse = along(m.inverse, a, i0, j, k);
    inverse_h2 = inverse_h2 + inverse * inverse;
    nodal_h2 = nodal_h2 + splat(ctx.nodal_radius[a]) * inverse * inverse;
    directions += 1.0;
  }
  const Vec nu_cap = splat(ctx.cap * directions) / inverse_h2;
  const Vec c_over_T = vsqrt(splat(ctx.gamma * ctx.gas_constant) / T);
  const double heat_to_nu = (ctx.gamma - 1.0) / ctx.gas_constant;
  const Vec beta_nu = vmin(splat(ctx.C_beta) * s.bulk, nu_cap);
  const Vec heat_nu = vmin(splat(ctx.C_kappa) * c_over_T * s.heat * splat(heat_to_nu), nu_cap);
  Vec motion = (ctx.paper ? nodal_h2 : splat(bulk_radius) * inverse_h2) * beta_nu;
  Vec heat = (ctx.paper ? nodal_h2 : splat(narrow_radius) * inverse_h2) * heat_nu;
  if (ctx.nodal_stress) {
    const Vec mu_gas = gas_viscosity(ctx, T);
    const Vec mu = vmin(splat(ctx.C_mu) * s.shear, nu_cap) * rho;
    store(w + field_mu * b.sf, mu);
    motion = motion + splat(4.0 / 3.0) * nodal_h2 * (mu + mu_gas) / rho;
    heat = heat + nodal_h2 * splat(heat_to_nu * ctx.heat_per_viscosity) * mu_gas / rho;
  }
  store(w + field_beta * b.sf, beta_nu * rho);
  store(w + field_kappa * b.sf, heat_nu * rho * splat(1.0 / heat_to_nu));
  return vmax(motion, heat);
}

inline void diffusivity_rows(const Context& shared, Real* scratch, int k, int j0, int j1,
                             PlaneMaxima& out) {
  const Context ctx = shared;
  const Metrics m(ctx);
  const Block& r = ctx.R;
  const int fields = ctx.need_strain ? 3 : 2;
  const int field[3] = {sensor_bulk, sensor_heat, sensor_shear};
  // A row with its margins; node 0 at 8.
  const Index width = tile_width + (ctx.n[0] + 4 + tile_width - 1) / tile_width * tile_width;
  const int low = j0 - (ctx.present[1] ? 4 : 0), rows = j1 - j0 + (ctx.present[1] ? 8 : 0);
  Real* averaged_z = scratch;
  Real* averaged_y = scratch + static_cast<Index>(rows) * 3 * width;
  const Index first = -tile_width;
  for (int jj = 0; jj < rows; ++jj) {
    for (int f = 0; f < fields; ++f) {
      const Real* from = r.data + (low + jj) * r.sj + k * r.sk + field[f] * r.sf + first;
      Real* to = averaged_z + (static_cast<Index>(jj) * 3 + f) * width;
      for (Index i = 0; i < width; i += tile_width) {
        store(to + i, ctx.present[2] ? gauss_sum(from + i, r.sk) : load(from + i));
      }
    }
  }
  Vec worst = splat(0.0);
  for (int j = j0; j < j1; ++j) {
    for (int f = 0; f < fields; ++f) {
      const Real* from = averaged_z + (static_cast<Index>(j - low) * 3 + f) * width;
      for (Index i = 0; i < width; i += tile_width) {
        store(averaged_y + f * width + i,
              ctx.present[1] ? gauss_sum(from + i, 3 * width) : load(from + i));
      }
    }
    for (int t = 0; t < ctx.tiles; ++t) {
      const int i0 = t * tile_width;
      const Real* at = averaged_y + tile_width + i0;
      Diffusivity s{gauss_sum(at, 1), gauss_sum(at + width, 1), splat(0.0)};
      if (ctx.need_strain) s.shear = gauss_sum(at + 2 * width, 1);
      const Vec rate = store_coefficients(ctx, m, s, i0, j, k);
      const unsigned fluid = ctx.fluid[tile_at(ctx, t, j, k)];
      worst = vmax(worst, fluid == all_lanes ? rate : select(fluid, rate, worst));
    }
  }
  const double largest = largest_lane(worst);
  if (largest > out.diffusion) out.diffusion = largest;
}

}  // namespace ocublast::flow::OCU_ISA
