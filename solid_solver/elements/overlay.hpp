#pragma once

// Rate-dependent stress on top of any law, point by point:
//  - finite-strain viscoelasticity (Simo 1987, DOI 10.1016/0045-7825(87)90107-1; Holzapfel 2000,
//    section 6.10): the isochoric second Piola-Kirchhoff stress S of the law is the instantaneous
//    one, S_visco = (1 - sum g_i) S + sum h_i, h_i(n+1) = exp(-dt/tau_i) h_i(n) +
//    g_i exp(-dt/(2 tau_i)) (S(n+1) - S(n)). Material frame, so it is objective.
//  - Newtonian viscosity: Cauchy stress 2 eta dev(D), D from the change of the Green strain.
// State per point: E (6), overlay stress S (6), S of the law (6), h_i (6 each).

#include "solid_solver/elements/lanes.hpp"

namespace ocublast::solid {
namespace {

constexpr int sym_row[6] = {0, 1, 2, 0, 1, 2};
constexpr int sym_column[6] = {0, 1, 2, 1, 2, 0};
constexpr double sym_weight[6] = {1.0, 1.0, 1.0, 2.0, 2.0, 2.0};
constexpr int sym_index[3][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}};

template <int W>
struct Overlay {
  using V = Lanes<W>;

  /// Symmetric part of (A^T B A) s by components, A row-major.
  OCU_LANE_INLINE void congruence(const V A[9], const V B[6], V s, V out[6]) {
    V T[9];
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        V sum{};
        for (int k = 0; k < 3; ++k) sum += B[sym_index[i][k]] * A[3 * k + j];
        T[3 * i + j] = sum;
      }
    for (int m = 0; m < 6; ++m) {
      V sum{};
      for (int k = 0; k < 3; ++k) sum += A[3 * k + sym_row[m]] * T[3 * k + sym_column[m]];
      out[m] = s * sum;
    }
  }
  OCU_LANE_INLINE void green_strain(const V H[9], V E[6]) {
    for (int m = 0; m < 6; ++m) {
      const int i = sym_row[m];
      const int j = sym_column[m];
      V sum = H[3 * i + j] + H[3 * j + i];
      for (int k = 0; k < 3; ++k) sum += H[3 * k + i] * H[3 * k + j];
      E[m] = 0.5 * sum;
    }
  }
  /// 2 eta J F^-1 dev(D) F^-T with D = F^-T E' F^-1.
  OCU_LANE_INLINE void viscous_stress(const Gradient<V>& g, const V rate[6], V eta, V S[6]) {
    const V inverse_J = 1.0 / (1.0 + g.j);
    V transposed[9];  // F^-1 = cof^T / J; congruence takes A = F^-1
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) transposed[3 * i + j] = g.cof[3 * j + i];
    V D[6];
    congruence(transposed, rate, inverse_J * inverse_J, D);
    const V mean = (D[0] + D[1] + D[2]) * (1.0 / 3.0);
    for (int i = 0; i < 3; ++i) D[i] -= mean;
    congruence(g.cof, D, 2.0 * eta * inverse_J, S);
  }

  /// Adds the overlay to the isochoric stress P of the law. inverse_step > 0 advances the state and
  /// adds weight * work to `work`; otherwise the state's stresses are shown as they are.
  OCU_LANE_INLINE void apply(const OverlayView& view, std::int64_t batch, int lane, int n_points,
                             int point, double inverse_step, const Gradient<V>& g, V w, V P[9],
                             V& work) {
    const double* parameters =
        view.parameters + batch * (1 + 2 * view.n_terms) * batch_lanes + lane;
    double* state = view.state + ((batch * n_points + point) * view.n_state) * batch_lanes + lane;
    const auto at = [&](int k) { return state + k * batch_lanes; };
    V stress[6];
    if (inverse_step > 0.0)
      advance(view.n_terms, parameters, at, inverse_step, g, w, P, stress, work);
    else
      for (int m = 0; m < 6; ++m) stress[m] = load<W>(at(6 + m));
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        V sum = stress[sym_index[i][j]];
        for (int k = 0; k < 3; ++k) sum += g.H[3 * i + k] * stress[sym_index[k][j]];
        P[3 * i + j] += sum;
      }
  }

 private:
  template <class At>
  OCU_LANE_INLINE void advance(int n_terms, const double* parameters, const At& at,
                               double inverse_step, const Gradient<V>& g, V w, const V P[9],
                               V stress[6], V& work) {
    V E[6];
    V change[6];
    green_strain(g.H, E);
    for (int m = 0; m < 6; ++m) {
      change[m] = E[m] - load<W>(at(m));
      store<W>(at(m), E[m]);
    }
    const V eta = load<W>(parameters);
    V rate[6];
    for (int m = 0; m < 6; ++m) rate[m] = change[m] * inverse_step;
    viscous_stress(g, rate, eta, stress);
    if (n_terms > 0) {
      const V inverse_J = 1.0 / (1.0 + g.j);
      V S[6];
      V jump[6];
      for (int m = 0; m < 6; ++m) {  // S = F^-1 P
        V sum{};
        for (int k = 0; k < 3; ++k) sum += g.cof[3 * k + sym_row[m]] * P[3 * k + sym_column[m]];
        S[m] = inverse_J * sum;
        jump[m] = S[m] - load<W>(at(12 + m));
        store<W>(at(12 + m), S[m]);
      }
      for (int t = 0; t < n_terms; ++t) {
        const V ratio = load<W>(parameters + (1 + 2 * t) * batch_lanes);
        const V inverse_time = load<W>(parameters + (2 + 2 * t) * batch_lanes);
        V half;  // exp(-dt / (2 tau)), alike in all lanes of one material
        for (int l = 0; l < W; ++l) half[l] = __builtin_exp(-0.5 * inverse_time[l] / inverse_step);
        for (int m = 0; m < 6; ++m) {
          const V h = half * (half * load<W>(at(18 + 6 * t + m)) + ratio * jump[m]);
          store<W>(at(18 + 6 * t + m), h);
          stress[m] += h - ratio * S[m];
        }
      }
    }
    V power{};
    for (int m = 0; m < 6; ++m) {
      power += sym_weight[m] * (0.5 * (stress[m] + load<W>(at(6 + m)))) * change[m];
      store<W>(at(6 + m), stress[m]);
    }
    work += w * power;
  }
};

/// Doubles of state per point.
constexpr int overlay_state(int n_terms) {
  return 18 + 6 * n_terms;
}

}  // namespace
}  // namespace ocublast::solid
