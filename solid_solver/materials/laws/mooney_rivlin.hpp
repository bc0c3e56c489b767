#pragma once

#include <array>

#include "solid_solver/materials/law.hpp"

namespace ocublast::solid {

/// Mooney-Rivlin solid: psi = c10 (I1bar - 3) + c01 (I2bar - 3) + K/4 (J^2 - 1 - 2 ln J);
/// G = 2 (c10 + c01).
struct MooneyRivlin {
  static constexpr const char* name = "mooney_rivlin";
  static constexpr const char* help = "Mooney-Rivlin solid, nearly incompressible";
  static constexpr bool finite_strain = true;
  static constexpr int n_fields = 0;
  enum Constant { c10, c01, K, n_constants };
  static constexpr std::array<LawConstant, n_constants> constants{
      {{"c10_Pa", "Pa", "factor of I1bar - 3", 7e4},
       {"c01_Pa", "Pa", "factor of I2bar - 3", 3e4, 0.0, no_limit, false},
       {"bulk_modulus_Pa", "Pa", "initial bulk modulus K", 3e6}}};

  [[nodiscard]] static ElasticModuli moduli(const double* c) {
    return {.shear = 2.0 * (c[c10] + c[c01]), .bulk = c[K]};
  }

  template <class V>
  OCU_LAW_INLINE V volumetric_stress(const V* c, V j) {
    return volumetric_stress_log(c[K], j);
  }
  /// I2bar = J^(-4/3) I2, dI2/dF = 2 (I1 F - F F^T F), and I2 = cof F : cof F.
  template <class V>
  OCU_LAW_INLINE void isochoric_stress(const V* c, const Gradient<V>& g, V P[9]) {
    for (int i = 0; i < 9; ++i) P[i] = V{};
    add_isochoric_invariant_slope(g, c[c10], P);
    const V y = inverse_cbrt(1.0 + g.j);
    const V y2 = y * y;
    V F[9];
    for (int i = 0; i < 9; ++i) F[i] = deformation(g, i);
    const V I1 = 3.0 + first_invariant_excess(g);
    V I2{};
    for (int i = 0; i < 9; ++i) I2 += g.cof[i] * g.cof[i];
    V b[9];  // F F^T
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k)
        b[3 * i + k] =
            F[3 * i] * F[3 * k] + (F[3 * i + 1] * F[3 * k + 1] + F[3 * i + 2] * F[3 * k + 2]);
    const V alpha = (2.0 * c[c01]) * (y2 * y2);
    const V beta = (2.0 / 3.0) * I2 * (y2 * y);  // (4/3) I2 / J over the factor 2
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k) {
        const V bF = b[3 * i] * F[k] + (b[3 * i + 1] * F[3 + k] + b[3 * i + 2] * F[6 + k]);
        P[3 * i + k] += alpha * (I1 * F[3 * i + k] - bF - beta * g.cof[3 * i + k]);
      }
  }
  OCU_LAW_INLINE double volumetric_energy(const double* c, double j) {
    return volumetric_energy_log(c[K], j);
  }
  /// With J^(-4/3) - 1 = s (2 + s) of s = J^(-2/3) - 1, and I2 - 3 from cof F - I.
  template <class V>
  OCU_LAW_INLINE V isochoric_energy(const V* c, const Gradient<V>& g) {
    const V s = inverse_cbrt_square_minus_one(g.j);
    const V t = s * (2.0 + s);
    V excess{};
    for (int i = 0; i < 9; ++i) {
      const V d = i % 4 == 0 ? g.cof[i] - 1.0 : g.cof[i];
      excess += d * d + (i % 4 == 0 ? 2.0 * d : V{});
    }
    return c[c10] * isochoric_invariant_excess(g) + c[c01] * (3.0 * t + (1.0 + t) * excess);
  }
};

}  // namespace ocublast::solid
