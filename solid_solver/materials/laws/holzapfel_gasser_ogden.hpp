#pragma once

#include <array>

#include "solid_solver/materials/law.hpp"

namespace ocublast::solid {

/// Two families of dispersed collagen fibres in a neo-Hookean ground (Gasser, Ogden & Holzapfel
/// 2006, DOI 10.1098/rsif.2005.0073): psi = G/2 (I1bar - 3) + sum_i k1/(2 k2) (exp(k2 E_i^2) - 1) +
/// K/4 (J^2 - 1 - 2 ln J), E_i = kappa (I1bar - 3) + (1 - 3 kappa)(I4bar_i - 1). Fibres carry
/// tension only: a family counts while E_i > 0. Fields: its two unit directions in the reference
/// state.
struct HolzapfelGasserOgden {
  static constexpr const char* name = "holzapfel_gasser_ogden";
  static constexpr const char* help = "two fibre families in a neo-Hookean ground (cornea, sclera)";
  static constexpr bool finite_strain = true;
  static constexpr int n_fields = 6;
  enum Constant { G, k1, k2, kappa, K, n_constants };
  static constexpr std::array<LawConstant, n_constants> constants{
      {{"shear_modulus_Pa", "Pa", "shear modulus G of the ground", 1e5},
       {"k1_Pa", "Pa", "fibre stiffness k1", 2e5, 0.0, no_limit, false},
       {"k2", "1", "fibre exponent k2", 20.0, 0.0, 1e4},
       {"dispersion", "1", "kappa: 0 aligned, 1/3 isotropic", 0.1, 0.0, 1.0 / 3.0, false},
       {"bulk_modulus_Pa", "Pa", "initial bulk modulus K", 3e6}}};

  /// The fibres' share at zero strain in their own direction: 8/3 k1 (1 - 3 kappa)^2 in the shear
  /// modulus of the stiffest shear, as a bound for two coincident families.
  [[nodiscard]] static ElasticModuli moduli(const double* c) {
    const double aligned = 1.0 - 3.0 * c[kappa];
    return {.shear = c[G] + 8.0 / 3.0 * c[k1] * aligned * aligned, .bulk = c[K]};
  }

  template <class V>
  OCU_LAW_INLINE V volumetric_stress(const V* c, V j) {
    return volumetric_stress_log(c[K], j);
  }
  template <class V>
  OCU_LAW_INLINE void isochoric_stress(const V* c, const Gradient<V>& g, V P[9]) {
    const V y = inverse_cbrt(1.0 + g.j);
    const V y2 = y * y;
    V on_I1 = 0.5 * c[G];
    for (int i = 0; i < 9; ++i) P[i] = V{};
    for (int family = 0; family < 2; ++family) {
      const V* a = c + n_constants + 3 * family;
      V Fa[3];
      V strain;
      const V I4 = fibre(c, g, a, Fa, strain);
      const V slope = c[k1] * strain * exponential(c[k2] * (strain * strain));  // d psi / d E_i
      on_I1 += slope * c[kappa];
      // d I4bar / dF = 2 J^(-2/3) (F a (x) a - I4 / (3 J) cof F)
      const V factor = (2.0 * slope) * ((1.0 - 3.0 * c[kappa]) * y2);
      const V trace = (1.0 / 3.0) * I4 * (y2 * y);
      for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k)
          P[3 * i + k] += factor * (Fa[i] * a[k] - trace * g.cof[3 * i + k]);
    }
    add_isochoric_invariant_slope(g, on_I1, P);
  }
  OCU_LAW_INLINE double volumetric_energy(const double* c, double j) {
    return volumetric_energy_log(c[K], j);
  }
  template <class V>
  OCU_LAW_INLINE V isochoric_energy(const V* c, const Gradient<V>& g) {
    V energy = 0.5 * c[G] * isochoric_invariant_excess(g);
    for (int family = 0; family < 2; ++family) {
      V Fa[3];
      V strain;
      fibre(c, g, c + n_constants + 3 * family, Fa, strain);
      const V x = c[k2] * (strain * strain);
      V e{};
      for (std::size_t l = 0; l < sizeof(V) / sizeof(double); ++l) e[l] = std::expm1(x[l]);
      energy += 0.5 * c[k1] / c[k2] * e;
    }
    return energy;
  }

 private:
  /// I4 of a family; F a; the fibre strain E_i, zero in compression.
  template <class V>
  OCU_LAW_INLINE V fibre(const V* c, const Gradient<V>& g, const V* a, V Fa[3], V& strain) {
    V excess{};  // I4 - 1 = 2 a.H a + |H a|^2 for unit a
    V I4{};
    for (int i = 0; i < 3; ++i) {
      const V Ha = g.H[3 * i] * a[0] + (g.H[3 * i + 1] * a[1] + g.H[3 * i + 2] * a[2]);
      Fa[i] = Ha + a[i];
      excess += (2.0 * a[i] + Ha) * Ha;
      I4 += Fa[i] * Fa[i];
    }
    const V s = inverse_cbrt_square_minus_one(g.j);
    const V I4bar = s + (1.0 + s) * excess;  // less 1
    const V E = c[kappa] * isochoric_invariant_excess(g) + (1.0 - 3.0 * c[kappa]) * I4bar;
    strain = E > 0.0 ? E : V{};
    return I4;
  }
  template <class V>
  OCU_LAW_INLINE V exponential(V x) {
    V e{};
    for (std::size_t l = 0; l < sizeof(V) / sizeof(double); ++l) e[l] = std::exp(x[l]);
    return e;
  }
};

}  // namespace ocublast::solid
