#pragma once

#include <array>

#include "solid_solver/materials/law.hpp"

namespace ocublast::solid {

/// Nearly incompressible neo-Hookean solid, Bhardwaj et al. (2014) eq. 17,
/// DOI 10.1007/s10237-013-0490-3: psi = G/2 (J^(-2/3) I1 - 3) + K/4 (J^2 - 1 - 2 ln J).
struct NeoHookean {
  static constexpr const char* name = "neo_hookean";
  static constexpr const char* help = "nearly incompressible neo-Hookean solid";
  static constexpr bool finite_strain = true;
  static constexpr int n_fields = 0;
  enum Constant { G, K, n_constants };
  static constexpr std::array<LawConstant, n_constants> constants{
      {{"shear_modulus_Pa", "Pa", "initial shear modulus G", 2e5},
       {"bulk_modulus_Pa", "Pa", "initial bulk modulus K", 3e6}}};

  [[nodiscard]] static ElasticModuli moduli(const double* c) {
    return {.shear = c[G], .bulk = c[K]};
  }

  template <class V>
  OCU_LAW_INLINE V volumetric_stress(const V* c, V j) {
    return volumetric_stress_log(c[K], j);
  }
  /// G J^(-2/3) (F - I1/(3 J) cof F).
  template <class V>
  OCU_LAW_INLINE void isochoric_factors(const V* c, const Gradient<V>& g, V& of_F, V& of_cof) {
    const V y = inverse_cbrt(1.0 + g.j);
    of_F = c[G] * (y * y);
    of_cof = -of_F * ((y * y * y) * ((3.0 + first_invariant_excess(g)) * (1.0 / 3.0)));
  }
  template <class V>
  OCU_LAW_INLINE void isochoric_stress(const V* c, const Gradient<V>& g, V P[9]) {
    V of_F;
    V of_cof;
    isochoric_factors(c, g, of_F, of_cof);
    for (int i = 0; i < 9; ++i) P[i] = of_F * deformation(g, i) + of_cof * g.cof[i];
  }
  /// Energies per reference volume of one element, for tables; not in the force loop.
  OCU_LAW_INLINE double volumetric_energy(const double* c, double j) {
    return volumetric_energy_log(c[K], j);
  }
  template <class V>
  OCU_LAW_INLINE V isochoric_energy(const V* c, const Gradient<V>& g) {
    return 0.5 * c[G] * isochoric_invariant_excess(g);
  }
};

}  // namespace ocublast::solid
