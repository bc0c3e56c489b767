#pragma once

#include "solid_solver/elements/kernel_table.hpp"
#include "solid_solver/elements/lanes.hpp"

namespace ocublast::solid {
namespace {

/// Sums over the points of W elements what `evaluate` reports: volume means of the Cauchy stress
/// and of grad u, the strain energy, the smallest Jacobian. Not in the force loop: the volumetric
/// energies take logarithms from the library.
template <class Law, int W>
struct CellMeans {
  using V = Lanes<W>;
  V kirchhoff[6] = {};
  V gradient[9] = {};
  V volume{};  ///< current, m^3
  V energy{};  ///< J
  V smallest = V{} + 1e300;

  inline __attribute__((always_inline)) void add(const V* c, const V H[9], V mean_stress, V w) {
    Gradient<V> g;
    for (int i = 0; i < 9; ++i) g.H[i] = H[i];
    complete<Law>(g);
    V P[9];
    Law::template isochoric_stress<V>(c, g, P);
    for (int i = 0; i < 9; ++i) P[i] += mean_stress * g.cof[i];
    V F[9];
    for (int i = 0; i < 9; ++i) {
      F[i] = V{} + (i % 4 == 0 ? 1.0 : 0.0);
      if constexpr (Law::finite_strain) F[i] += H[i];
    }
    constexpr int row[6] = {0, 1, 2, 0, 1, 2};
    constexpr int column[6] = {0, 1, 2, 1, 2, 0};
    for (int k = 0; k < 6; ++k) {
      V sum{};
      for (int m = 0; m < 3; ++m) sum += P[3 * row[k] + m] * F[3 * column[k] + m];
      kirchhoff[k] += w * sum;
    }
    for (int i = 0; i < 9; ++i) gradient[i] += w * H[i];
    volume += Law::finite_strain ? w * (1.0 + g.j) : w;
    smallest = g.j + 1.0 < smallest ? g.j + 1.0 : smallest;
    energy += w * Law::template isochoric_energy<V>(c, g);
  }
  inline __attribute__((always_inline)) void add_volumetric(const V* c, V dilatation,
                                                            V reference_volume) {
    for (int l = 0; l < W; ++l) {
      double constants[Law::n_constants];
      for (int k = 0; k < Law::n_constants; ++k) constants[k] = c[k][l];
      energy[l] += reference_volume[l] * Law::volumetric_energy(constants, dilatation[l]);
    }
  }
  inline __attribute__((always_inline)) void write(V reference_volume, V dilatation,
                                                   double* out) const {
    for (int k = 0; k < 6; ++k)
      store<W>(out + (stress_xx + k) * batch_lanes, kirchhoff[k] / volume);
    store<W>(out + dilatation_mean * batch_lanes, dilatation);
    store<W>(out + strain_energy * batch_lanes, energy);
    for (int i = 0; i < 9; ++i)
      store<W>(out + (gradient_00 + i) * batch_lanes, gradient[i] / reference_volume);
    store<W>(out + smallest_jacobian * batch_lanes, smallest);
  }
};

}  // namespace
}  // namespace ocublast::solid
