#pragma once

#include <cmath>

#include "solid_solver/elements/lanes.hpp"
#include "solid_solver/materials/moduli.hpp"

// How a material law is written: one header with a struct of static members
//   name, help, finite_strain (kinematics of Gradient), enum of constants, their description,
//   n_fields (numbers per element behind the constants, e.g. fibre directions), moduli(),
//   volumetric_stress(c, j), isochoric_stress(c, gradient, P), volumetric_energy, isochoric_energy.
// Where the isochoric stress is a F + b cof F, isochoric_factors(c, gradient, a, b) says so as
// well: that spares the force loop a third of the products at the end of a point. The stress is P =
// isochoric + volumetric_stress * g.cof; both are derivatives of the energies. The header lies in
// laws/; the build finds it there, compiles the law for every instruction set and puts it into the
// factory. Every element works with it, and the tests over all laws take it up.
#define OCU_LAW_INLINE static inline __attribute__((always_inline))

namespace ocublast::solid {

namespace {

/// Volumetric part K/4 (J^2 - 1 - 2 ln J) that the hyperelastic laws share (Bhardwaj et al. 2014,
/// eq. 17): dU/dJ = K/2 (J - 1/J), written in j = J - 1 so that nothing cancels.
template <class V>
OCU_LAW_INLINE V volumetric_stress_log(V K, V j) {
  return (0.5 * K) * (j * (2.0 + j) / (1.0 + j));
}
OCU_LAW_INLINE double volumetric_energy_log(double K, double j) {
  return 0.25 * K * (j * (2.0 + j) - 2.0 * std::log1p(j));
}

/// F_ij of a gradient.
template <class V>
OCU_LAW_INLINE V deformation(const Gradient<V>& g, int i) {
  return i % 4 == 0 ? g.H[i] + 1.0 : g.H[i];
}
/// I1 - 3 = 2 tr H + H:H.
template <class V>
OCU_LAW_INLINE V first_invariant_excess(const Gradient<V>& g) {
  V sum = 2.0 * (g.H[0] + g.H[4] + g.H[8]);
  for (int i = 0; i < 9; ++i) sum += g.H[i] * g.H[i];
  return sum;
}
/// J^(-2/3) I1 - 3 = 3 s + (1 + s) (I1 - 3), s = J^(-2/3) - 1: small strains give small
/// differences.
template <class V>
OCU_LAW_INLINE V isochoric_invariant_excess(const Gradient<V>& g) {
  const V s = inverse_cbrt_square_minus_one(g.j);
  return 3.0 * s + (1.0 + s) * first_invariant_excess(g);
}
/// Adds factor * d(J^(-2/3) I1)/dF = factor * 2 J^(-2/3) (F - I1/(3 J) cof F).
template <class V>
OCU_LAW_INLINE void add_isochoric_invariant_slope(const Gradient<V>& g, V factor, V P[9]) {
  const V y = inverse_cbrt(1.0 + g.j);
  const V alpha = (2.0 * factor) * (y * y);
  const V beta = (y * y * y) * ((3.0 + first_invariant_excess(g)) * (1.0 / 3.0));
  for (int i = 0; i < 9; ++i) P[i] += alpha * (deformation(g, i) - beta * g.cof[i]);
}

}  // namespace
}  // namespace ocublast::solid
