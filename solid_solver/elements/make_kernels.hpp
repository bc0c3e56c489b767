#pragma once

#include "solid_solver/elements/hex8_q1p0.hpp"
#include "solid_solver/elements/kernel_table.hpp"
#include "solid_solver/elements/tet4_anp.hpp"

namespace ocublast::solid {
namespace {

/// Stress and energy density at one displacement gradient, by the same code as the elements.
template <class Law>
double evaluate_point(const double* constants, const double H[9], double P[9]) noexcept {
  using V = Lanes<2>;
  V c[Law::n_constants];
  for (int k = 0; k < Law::n_constants; ++k) c[k] = V{} + constants[k];
  Gradient<V> g;
  for (int i = 0; i < 9; ++i) g.H[i] = V{} + H[i];
  complete<Law>(g);
  V stress[9];
  Law::template isochoric_stress<V>(c, g, stress);
  const V mean = Law::template volumetric_stress<V>(c, g.j);
  for (int i = 0; i < 9; ++i) P[i] = stress[i][0] + mean[0] * g.cof[i][0];
  return Law::template isochoric_energy<V>(c, g)[0] + Law::volumetric_energy(constants, g.j[0]);
}

/// All element kernels of one law with W lanes.
template <class Law, int W>
KernelTable make_kernels() {
  return {.hex_force = &Hex8Q1P0<Law, W>::force,
          .hex_evaluate = &Hex8Q1P0<Law, W>::evaluate,
          .tet_volume = &Tet4Anp<Law, W>::volume,
          .tet_pressure = &Tet4Anp<Law, W>::pressure,
          .tet_force = &Tet4Anp<Law, W>::force,
          .tet_evaluate = &Tet4Anp<Law, W>::evaluate,
          .point = &evaluate_point<Law>};
}

}  // namespace
}  // namespace ocublast::solid
