#pragma once

#include <array>

#include "solid_solver/materials/law.hpp"

namespace ocublast::solid {

/// Nearly inviscid liquid (aqueous, vitreous): mean stress K (J - 1), cut off in tension at the
/// cavitation stress; no elastic shear. Give viscosity_Pa_s of the material for its viscosity.
/// Energy K/2 (J - 1)^2, growing linearly beyond the cut-off.
struct Liquid {
  static constexpr const char* name = "liquid";
  static constexpr const char* help = "bulk modulus only, tension cut off at cavitation";
  static constexpr bool finite_strain = true;
  static constexpr int n_fields = 0;
  enum Constant { K, cut_off, n_constants };
  static constexpr std::array<LawConstant, n_constants> constants{
      {{"bulk_modulus_Pa", "Pa", "bulk modulus K", 3e6},
       {"cavitation_stress_Pa", "Pa", "largest mean tension it bears", 1e9, 0.0, no_limit, false,
        no_limit}}};

  [[nodiscard]] static ElasticModuli moduli(const double* c) {
    return {.shear = 0.0, .bulk = c[K]};
  }

  template <class V>
  OCU_LAW_INLINE V volumetric_stress(const V* c, V j) {
    const V stress = c[K] * j;
    return stress < c[cut_off] ? stress : c[cut_off];
  }
  template <class V>
  OCU_LAW_INLINE void isochoric_stress(const V*, const Gradient<V>&, V P[9]) {
    for (int i = 0; i < 9; ++i) P[i] = V{};
  }
  OCU_LAW_INLINE double volumetric_energy(const double* c, double j) {
    if (c[K] * j <= c[cut_off]) return 0.5 * c[K] * j * j;
    return c[cut_off] * (j - 0.5 * c[cut_off] / c[K]);
  }
  template <class V>
  OCU_LAW_INLINE V isochoric_energy(const V*, const Gradient<V>&) {
    return V{};
  }
};

}  // namespace ocublast::solid
