#pragma once

#include <array>
#include <cmath>

#include "solid_solver/materials/law.hpp"

namespace ocublast::solid {

/// Ogden solid of up to three terms: psi = sum_p mu_p/alpha_p (sum_a lbar_a^alpha_p - 3) +
/// K/4 (J^2 - 1 - 2 ln J), lbar_a = J^(-1/3) lambda_a; G = 1/2 sum mu_p alpha_p.
/// Eigenvalues of C - I by Jacobi rotations (accurate for equal stretches too) element after
/// element: some ten times dearer than the laws in invariants.
struct Ogden {
  static constexpr const char* name = "ogden";
  static constexpr const char* help = "Ogden solid of up to three terms in the principal stretches";
  static constexpr bool finite_strain = true;
  static constexpr int n_fields = 0;
  enum Constant { mu_1, alpha_1, mu_2, alpha_2, mu_3, alpha_3, K, n_constants };
  static constexpr std::array<LawConstant, n_constants> constants{
      {{"mu_1_Pa", "Pa", "modulus of term 1", 1e5, -no_limit, no_limit, false},
       {"alpha_1", "1", "exponent of term 1, not 0", 2.5, -no_limit, no_limit, false},
       {"mu_2_Pa", "Pa", "modulus of term 2", -3e4, -no_limit, no_limit, false, 0.0},
       {"alpha_2", "1", "exponent of term 2, not 0", -1.8, -no_limit, no_limit, false, 1.0},
       {"mu_3_Pa", "Pa", "modulus of term 3", 1e3, -no_limit, no_limit, false, 0.0},
       {"alpha_3", "1", "exponent of term 3, not 0", 6.0, -no_limit, no_limit, false, 1.0},
       {"bulk_modulus_Pa", "Pa", "initial bulk modulus K", 3e6}}};

  [[nodiscard]] static ElasticModuli moduli(const double* c) {
    double shear = 0.0;
    for (int p = 0; p < 3; ++p) shear += 0.5 * c[2 * p] * c[2 * p + 1];
    return {.shear = shear, .bulk = c[K]};
  }

  template <class V>
  OCU_LAW_INLINE V volumetric_stress(const V* c, V j) {
    return volumetric_stress_log(c[K], j);
  }
  /// P = F S, S = sum_a (beta_a / lambda_a^2) N_a (x) N_a, beta_a = d psi / d ln lambda_a =
  /// sum_p mu_p (lbar_a^alpha_p - 1/3 sum_b lbar_b^alpha_p).
  template <class V>
  OCU_LAW_INLINE void isochoric_stress(const V* c, const Gradient<V>& g, V P[9]) {
    for (std::size_t l = 0; l < sizeof(V) / sizeof(double); ++l) {
      Stretches s = stretches(g, l);
      double beta[3] = {};
      for (int p = 0; p < 3; ++p) {
        const double mu = c[2 * p][l];
        if (mu == 0.0) continue;
        double power[3];
        for (int a = 0; a < 3; ++a) power[a] = std::expm1(c[2 * p + 1][l] * s.log_bar[a]);
        const double mean = (power[0] + power[1] + power[2]) / 3.0;
        for (int a = 0; a < 3; ++a) beta[a] += mu * (power[a] - mean);
      }
      double S[9] = {};
      for (int a = 0; a < 3; ++a)
        for (int i = 0; i < 3; ++i)
          for (int k = 0; k < 3; ++k)
            S[3 * i + k] += beta[a] / (1.0 + s.excess[a]) * s.N[i][a] * s.N[k][a];
      for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k) {
          double sum = S[3 * i + k];
          for (int m = 0; m < 3; ++m) sum += g.H[3 * i + m][l] * S[3 * m + k];
          P[3 * i + k][l] = sum;
        }
    }
  }
  OCU_LAW_INLINE double volumetric_energy(const double* c, double j) {
    return volumetric_energy_log(c[K], j);
  }
  template <class V>
  OCU_LAW_INLINE V isochoric_energy(const V* c, const Gradient<V>& g) {
    V energy{};
    for (std::size_t l = 0; l < sizeof(V) / sizeof(double); ++l) {
      const Stretches s = stretches(g, l);
      for (int p = 0; p < 3; ++p) {
        const double alpha = c[2 * p + 1][l];
        double sum = 0.0;
        for (int a = 0; a < 3; ++a) sum += std::expm1(alpha * s.log_bar[a]);
        energy[l] += c[2 * p][l] / alpha * sum;
      }
    }
    return energy;
  }

 private:
  struct Stretches {
    double excess[3];   ///< eigenvalues of C - I
    double log_bar[3];  ///< ln of the isochoric principal stretches
    double N[3][3];     ///< eigenvectors in columns
  };
  template <class V>
  OCU_LAW_INLINE Stretches stretches(const Gradient<V>& g, std::size_t l) {
    double A[3][3];
    Stretches s{};
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k) {
        A[i][k] = g.H[3 * i + k][l] + g.H[3 * k + i][l];
        for (int m = 0; m < 3; ++m) A[i][k] += g.H[3 * m + i][l] * g.H[3 * m + k][l];
        s.N[i][k] = i == k ? 1.0 : 0.0;
      }
    // Cyclic Jacobi converges quadratically: five sweeps reach round-off from any 3x3 matrix.
    for (int sweep = 0; sweep < 5; ++sweep)
      for (int p = 0; p < 2; ++p)
        for (int q = p + 1; q < 3; ++q) rotate(A, s.N, p, q);
    double mean = 0.0;
    for (int a = 0; a < 3; ++a) {
      s.excess[a] = A[a][a];
      s.log_bar[a] = 0.5 * std::log1p(A[a][a]);
      mean += s.log_bar[a] / 3.0;
    }
    for (double& value : s.log_bar) value -= mean;
    return s;
  }
  OCU_LAW_INLINE void rotate(double A[3][3], double N[3][3], int p, int q) {
    if (A[p][q] == 0.0) return;
    const double theta = 0.5 * (A[q][q] - A[p][p]) / A[p][q];
    const double t =
        (theta < 0.0 ? -1.0 : 1.0) / (std::fabs(theta) + std::sqrt(1.0 + theta * theta));
    const double cosine = 1.0 / std::sqrt(1.0 + t * t);
    const double sine = t * cosine;
    for (int k = 0; k < 3; ++k) {
      const double a = A[k][p];
      const double b = A[k][q];
      A[k][p] = cosine * a - sine * b;
      A[k][q] = sine * a + cosine * b;
    }
    for (int k = 0; k < 3; ++k) {
      const double a = A[p][k];
      const double b = A[q][k];
      A[p][k] = cosine * a - sine * b;
      A[q][k] = sine * a + cosine * b;
    }
    for (int k = 0; k < 3; ++k) {
      const double a = N[k][p];
      const double b = N[k][q];
      N[k][p] = cosine * a - sine * b;
      N[k][q] = sine * a + cosine * b;
    }
  }
};

}  // namespace ocublast::solid
