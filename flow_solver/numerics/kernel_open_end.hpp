#pragma once

// Ghosts beyond open ends with a constant gas far away, a tile of lines at a time: the
// characteristic state of boundary/open_ends.hpp in vectors.

#include "flow_solver/numerics/kernel.hpp"
#include "flow_solver/numerics/simd.hpp"

namespace ocublast::flow::inline OCU_PRECISION::OCU_ISA {

/// Values at a tile of end nodes: density, velocities with that along the axis outwards,
/// temperature.
struct EndNodes {
  Vec rho, un, ut[2], T;
};

/// The same beyond the end: outgoing Riemann invariant of the node, incoming one of the gas far
/// away; entropy and tangential velocity from where the gas comes.
OCU_INLINE EndNodes characteristic_nodes(const OutflowEnd& e, const EndNodes& s,
                                         const EndNodes& far) {
  const Vec zero = splat(0.0), gm1 = splat(e.gamma - 1.0), two = splat(2.0);
  const Vec c = vsqrt(splat(e.gamma) * splat(e.gas_constant) * s.T);
  const Vec c_far = vsqrt(splat(e.gamma) * splat(e.gas_constant) * far.T);
  const Vec outgoing = s.un + two * c / gm1;
  const Vec incoming = far.un - two * c_far / gm1;
  const Vec un = splat(0.5) * (outgoing + incoming);
  const Vec c_end = splat(0.25) * gm1 * (outgoing - incoming);
  const unsigned leaves = less(zero, un);
  const Vec donor_T = select(leaves, s.T, far.T), donor_rho = select(leaves, s.rho, far.rho);
  EndNodes b;
  b.un = un;
  for (int a = 0; a < 2; ++a) b.ut[a] = select(leaves, s.ut[a], far.ut[a]);
  b.T = c_end * c_end / (splat(e.gamma) * splat(e.gas_constant));
  const Vec ratio = b.T / donor_T;
  b.rho = donor_rho * (ratio * ratio * vsqrt(ratio));  // isentropic, gamma = 1.4
  // Supersonic ends, and states that have no sound speed, take one side whole.
  const unsigned fast = ~less(s.un, c), in = ~less(-c, s.un) & ~fast;
  const unsigned out = fast | (~less(zero, c_end) & ~in);
  const auto choose = [&](Vec inner, Vec own, Vec outer)
                          OCU_FORCE { return select(in, outer, select(out, own, inner)); };
  b.rho = choose(b.rho, s.rho, far.rho);
  b.un = choose(b.un, s.un, far.un);
  for (int a = 0; a < 2; ++a) b.ut[a] = choose(b.ut[a], s.ut[a], far.ut[a]);
  b.T = choose(b.T, s.T, far.T);
  return b;
}

/// Lanes in which all values equal those far away.
OCU_INLINE unsigned undisturbed(const EndNodes& s, const EndNodes& far) {
  const auto differs = [](Vec a, Vec b) OCU_FORCE { return less(a, b) | less(b, a); };
  return ~(differs(s.rho, far.rho) | differs(s.un, far.un) | differs(s.ut[0], far.ut[0]) |
           differs(s.ut[1], far.ut[1]) | differs(s.T, far.T)) &
         all_lanes;
}

OCU_INLINE EndNodes far_nodes(const OutflowEnd& e) {
  const int t0 = e.axis == 0 ? 1 : 0, t1 = e.axis == 2 ? 1 : 2;
  return {splat(e.rho), splat(e.sign * e.u[e.axis]), {splat(e.u[t0]), splat(e.u[t1])}, splat(e.T)};
}

/// Ghosts of a tile of ends from the values of their end nodes.
OCU_INLINE void end_values(const OutflowEnd& e, const EndNodes& far, const Vec node[5],
                           Vec ghost[5]) {
  const int t0 = e.axis == 0 ? 1 : 0, t1 = e.axis == 2 ? 1 : 2;
  const Vec sign = splat(e.sign);
  const EndNodes s{node[0], sign * node[1 + e.axis], {node[1 + t0], node[1 + t1]}, node[4]};
  const unsigned still = undisturbed(s, far);
  EndNodes b = far;
  if (still != all_lanes) {
    b = characteristic_nodes(e, s, far);
    b.rho = select(still, far.rho, b.rho);
    b.un = select(still, far.un, b.un);
    for (int a = 0; a < 2; ++a) b.ut[a] = select(still, far.ut[a], b.ut[a]);
    b.T = select(still, far.T, b.T);
  }
  ghost[0] = b.rho;
  ghost[1 + e.axis] = sign * b.un;
  ghost[1 + t0] = b.ut[0];
  ghost[1 + t1] = b.ut[1];
  ghost[4] = b.T;
}

/// Ghosts of `count` neighbouring lines along x; their end nodes lie at node + i, the ghosts at
/// multiples of `outwards` from there. At least a tile of lines: the last ones overlap the others.
inline void outflow_rows(const OutflowEnd& e, Real* node, Index sf, Index outwards, int count) {
  const EndNodes far = far_nodes(e);
  for (int i0 = 0; i0 < count; i0 += tile_width) {
    const int i = i0 + tile_width <= count ? i0 : count - tile_width;
    Vec w[5], ghost[5];
    for (int f = 0; f < 5; ++f) w[f] = load(node + i + f * sf);
    end_values(e, far, w, ghost);
    for (int layer = 1; layer <= 4; ++layer) {
      for (int f = 0; f < 5; ++f) store(node + i + f * sf + layer * outwards, ghost[f]);
    }
  }
}

/// The same of `count` x-lines; `node` is the end node of the first, the next line lies sj further.
inline void outflow_columns(const OutflowEnd& e, Real* node, Index sf, Index sj, int outwards,
                            int count) {
  const EndNodes far = far_nodes(e);
  for (int j0 = 0; j0 < count; j0 += tile_width) {
    const int lanes = j0 + tile_width <= count ? tile_width : count - j0;
    for (int l = 0; l < tile_width; ++l) {  // every line is a page away from the last one
      for (int f = 0; f < 5; ++f) {
        const Real* later = node + (j0 + tile_width + l) * sj + f * sf;
        __builtin_prefetch(later, 0, 2);
        __builtin_prefetch(later + outwards, 1, 2);
      }
    }
    Real value[5][tile_width];
    for (int l = 0; l < tile_width; ++l) {
      const Real* from = node + (j0 + (l < lanes ? l : 0)) * sj;
      for (int f = 0; f < 5; ++f) value[f][l] = from[f * sf];
    }
    Vec w[5], ghost[5];
    for (int f = 0; f < 5; ++f) w[f] = load(value[f]);
    end_values(e, far, w, ghost);
    for (int f = 0; f < 5; ++f) store(value[f], ghost[f]);
    for (int l = 0; l < lanes; ++l) {
      Real* lowest =
          node + (j0 + l) * sj + (outwards > 0 ? 1 : -4);  // the four layers lie side by side
      for (int f = 0; f < 5; ++f) {
        for (int layer = 0; layer < 4; ++layer) lowest[f * sf + layer] = value[f][l];
      }
    }
  }
}

}  // namespace ocublast::flow::OCU_ISA
