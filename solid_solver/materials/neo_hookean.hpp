#pragma once

#include <array>
#include <cmath>

#include "solid_solver/materials/law.hpp"

namespace ocublast::solid {

/// Nearly incompressible neo-Hookean solid, Bhardwaj et al. (2014) eq. 17,
/// DOI 10.1007/s10237-013-0490-3: psi = G/2 (J^(-2/3) I1 - 3) + K/4 (J^2 - 1 - 2 ln J).
struct NeoHookean {
  static constexpr const char* name = "neo_hookean";
  static constexpr bool finite_strain = true;
  enum Constant { G, K, n_constants };
  static constexpr std::array<LawConstant, n_constants> constants{
      {{"shear_modulus_Pa", "Pa", "initial shear modulus G"},
       {"bulk_modulus_Pa", "Pa", "initial bulk modulus K"}}};

  [[nodiscard]] static ElasticModuli moduli(const double* c) {
    return {.shear = c[G], .bulk = c[K]};
  }

  /// Mean Kirchhoff stress over J, dU/dJ = K/2 (J - 1/J), written in j = J - 1.
  template <class V>
  OCU_LAW_INLINE V volumetric_stress(const V* c, V j) {
    return (0.5 * c[K]) * (j * (2.0 + j) / (1.0 + j));
  }
  /// Isochoric first Piola-Kirchhoff stress G J^(-2/3) (F - I1/(3 J) cof F).
  template <class V>
  OCU_LAW_INLINE void isochoric_stress(const V* c, const Gradient<V>& g, V P[9]) {
    const V J = 1.0 + g.j;
    const V y = inverse_cbrt(J);
    const V alpha = c[G] * (y * y);
    const V beta = (y * y * y) * (first_invariant(g) * (1.0 / 3.0));
    for (int i = 0; i < 9; ++i) {
      const V F = i % 4 == 0 ? g.H[i] + 1.0 : g.H[i];
      P[i] = alpha * (F - beta * g.cof[i]);
    }
  }
  /// Energies per reference volume of one element, for tables; not in the force loop.
  OCU_LAW_INLINE double volumetric_energy(const double* c, double j) {
    return 0.25 * c[K] * (j * (2.0 + j) - 2.0 * std::log1p(j));
  }
  /// G/2 (J^(-2/3) I1 - 3) with J^(-2/3) I1 - 3 = 3 s + (1 + s) (I1 - 3), s = J^(-2/3) - 1: small
  /// strains give small differences.
  template <class V>
  OCU_LAW_INLINE V isochoric_energy(const V* c, const Gradient<V>& g) {
    const V s = inverse_cbrt_square_minus_one(g.j);
    V excess = 2.0 * (g.H[0] + g.H[4] + g.H[8]);
    for (int i = 0; i < 9; ++i) excess += g.H[i] * g.H[i];
    return 0.5 * c[G] * (3.0 * s + (1.0 + s) * excess);
  }

 private:
  /// I1 = tr(F^T F) = 3 + 2 tr H + H:H.
  template <class V>
  OCU_LAW_INLINE V first_invariant(const Gradient<V>& g) {
    V sum = 2.0 * (g.H[0] + g.H[4] + g.H[8]);
    for (int i = 0; i < 9; ++i) sum += g.H[i] * g.H[i];
    return 3.0 + sum;
  }
};

}  // namespace ocublast::solid
