#pragma once

#include <array>

#include "solid_solver/materials/law.hpp"

namespace ocublast::solid {

/// Isotropic Hooke's law at small strain: sigma = K tr(eps) I + 2 G dev(eps), eps = sym(grad u).
/// Not objective: for rotations and strains of a few per cent at most.
struct LinearElastic {
  static constexpr const char* name = "linear_elastic";
  static constexpr const char* help = "isotropic Hooke's law at small strain";
  static constexpr bool finite_strain = false;
  static constexpr int n_fields = 0;
  enum Constant { G, K, n_constants };
  static constexpr std::array<LawConstant, n_constants> constants{
      {{"shear_modulus_Pa", "Pa", "shear modulus G", 2e5},
       {"bulk_modulus_Pa", "Pa", "bulk modulus K", 3e6}}};

  [[nodiscard]] static ElasticModuli moduli(const double* c) {
    return {.shear = c[G], .bulk = c[K]};
  }

  template <class V>
  OCU_LAW_INLINE V volumetric_stress(const V* c, V j) {
    return c[K] * j;
  }
  template <class V>
  OCU_LAW_INLINE void isochoric_stress(const V* c, const Gradient<V>& g, V P[9]) {
    const V third = g.j * (1.0 / 3.0);
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k)
        P[3 * i + k] = c[G] * (g.H[3 * i + k] + g.H[3 * k + i] - (i == k ? 2.0 * third : V{}));
  }
  OCU_LAW_INLINE double volumetric_energy(const double* c, double j) { return 0.5 * c[K] * j * j; }
  template <class V>
  OCU_LAW_INLINE V isochoric_energy(const V* c, const Gradient<V>& g) {
    V sum{};
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k) {
        const V dev = 0.5 * (g.H[3 * i + k] + g.H[3 * k + i]) - (i == k ? g.j * (1.0 / 3.0) : V{});
        sum += dev * dev;
      }
    return c[G] * sum;
  }
};

}  // namespace ocublast::solid
