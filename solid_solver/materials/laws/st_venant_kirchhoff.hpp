#pragma once

#include <array>

#include "solid_solver/materials/law.hpp"

namespace ocublast::solid {

/// St-Venant-Kirchhoff solid: S = lambda tr(E) I + 2 G E, psi = lambda/2 tr(E)^2 + G E:E with
/// lambda = K - 2 G / 3. The part U = K/2 (J - 1)^2 is split off as volumetric, so that elements
/// with one pressure do not lock; at a point the sum is the law unchanged. Softens in compression
/// (no stress at full collapse): for large rotations and moderate strains.
struct StVenantKirchhoff {
  static constexpr const char* name = "st_venant_kirchhoff";
  static constexpr const char* help = "linear law between Green strain and second Piola stress";
  static constexpr bool finite_strain = true;
  static constexpr int n_fields = 0;
  enum Constant { G, K, n_constants };
  static constexpr std::array<LawConstant, n_constants> constants{
      {{"shear_modulus_Pa", "Pa", "shear modulus G", 2e5},
       {"bulk_modulus_Pa", "Pa", "bulk modulus K", 1e6}}};

  [[nodiscard]] static ElasticModuli moduli(const double* c) {
    return {.shear = c[G], .bulk = c[K]};
  }

  template <class V>
  OCU_LAW_INLINE V volumetric_stress(const V* c, V j) {
    return c[K] * j;
  }
  template <class V>
  OCU_LAW_INLINE void isochoric_stress(const V* c, const Gradient<V>& g, V P[9]) {
    V E[6];
    green(g, E);
    const V pressure = (c[K] - (2.0 / 3.0) * c[G]) * (E[0] + E[1] + E[2]);
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k) {
        V sum{};
        for (int m = 0; m < 3; ++m) {
          const V S = 2.0 * c[G] * E[component(m, k)] + (m == k ? pressure : V{});
          sum += deformation(g, 3 * i + m) * S;
        }
        P[3 * i + k] = sum - (c[K] * g.j) * g.cof[3 * i + k];
      }
  }
  OCU_LAW_INLINE double volumetric_energy(const double* c, double j) { return 0.5 * c[K] * j * j; }
  template <class V>
  OCU_LAW_INLINE V isochoric_energy(const V* c, const Gradient<V>& g) {
    V E[6];
    green(g, E);
    const V trace = E[0] + E[1] + E[2];
    V square{};
    for (int m = 0; m < 6; ++m) square += (m < 3 ? 1.0 : 2.0) * (E[m] * E[m]);
    return (0.5 * (c[K] - (2.0 / 3.0) * c[G])) * (trace * trace) + c[G] * square -
           (0.5 * c[K]) * (g.j * g.j);
  }

 private:
  static constexpr int component(int i, int k) {
    return i == k ? i : i + k == 1 ? 3 : i + k == 3 ? 4 : 5;
  }
  /// Green strain: xx, yy, zz, xy, yz, zx.
  template <class V>
  OCU_LAW_INLINE void green(const Gradient<V>& g, V E[6]) {
    constexpr int row[6] = {0, 1, 2, 0, 1, 2};
    constexpr int column[6] = {0, 1, 2, 1, 2, 0};
    for (int m = 0; m < 6; ++m) {
      V sum = g.H[3 * row[m] + column[m]] + g.H[3 * column[m] + row[m]];
      for (int k = 0; k < 3; ++k) sum += g.H[3 * k + row[m]] * g.H[3 * k + column[m]];
      E[m] = 0.5 * sum;
    }
  }
};

}  // namespace ocublast::solid
