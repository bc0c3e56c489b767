#pragma once

#include <array>

#include "solid_solver/materials/law.hpp"

namespace ocublast::solid {

/// Yeoh solid: psi = sum_k ck0 (I1bar - 3)^k, k = 1..3, + K/4 (J^2 - 1 - 2 ln J); G = 2 c10.
/// A negative c30 loses stiffness at large stretch.
struct Yeoh {
  static constexpr const char* name = "yeoh";
  static constexpr const char* help = "Yeoh solid: cubic in I1bar - 3, stiffens";
  static constexpr bool finite_strain = true;
  static constexpr int n_fields = 0;
  enum Constant { c10, c20, c30, K, n_constants };
  static constexpr std::array<LawConstant, n_constants> constants{
      {{"c10_Pa", "Pa", "factor of I1bar - 3", 1e5},
       {"c20_Pa", "Pa", "factor of (I1bar - 3)^2", 2e5, -no_limit, no_limit, false},
       {"c30_Pa", "Pa", "factor of (I1bar - 3)^3", 1e5, -no_limit, no_limit, false},
       {"bulk_modulus_Pa", "Pa", "initial bulk modulus K", 3e6}}};

  [[nodiscard]] static ElasticModuli moduli(const double* c) {
    return {.shear = 2.0 * c[c10], .bulk = c[K]};
  }

  template <class V>
  OCU_LAW_INLINE V volumetric_stress(const V* c, V j) {
    return volumetric_stress_log(c[K], j);
  }
  template <class V>
  OCU_LAW_INLINE void isochoric_stress(const V* c, const Gradient<V>& g, V P[9]) {
    const V x = isochoric_invariant_excess(g);
    for (int i = 0; i < 9; ++i) P[i] = V{};
    add_isochoric_invariant_slope(g, c[c10] + x * (2.0 * c[c20] + 3.0 * c[c30] * x), P);
  }
  OCU_LAW_INLINE double volumetric_energy(const double* c, double j) {
    return volumetric_energy_log(c[K], j);
  }
  template <class V>
  OCU_LAW_INLINE V isochoric_energy(const V* c, const Gradient<V>& g) {
    const V x = isochoric_invariant_excess(g);
    return x * (c[c10] + x * (c[c20] + x * c[c30]));
  }
};

}  // namespace ocublast::solid
