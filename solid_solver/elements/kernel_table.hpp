#pragma once

#include <cstdint>

namespace ocublast::solid {

/// What a kernel knows of the step.
struct KernelStep {
  const double* displacement = nullptr;  ///< [n_nodes, 4], m
  double* force = nullptr;               ///< [n_nodes, 4], N; internal force is added
  double inverse_step = 0.0;  ///< 1/s; 0: no bulk viscosity and no change of element memory
};

/// Elements of one type and law, in batches of 8 lanes; all arrays are batch-major, lane last.
struct BlockView {
  const std::int32_t* nodes = nullptr;  ///< [batch, nodes per element, 8]
  const double* reference =
      nullptr;  ///< hex: [batch, 8 points, 10, 8] gradients (1/m) and weight (m^3);
                ///< tet: [batch, 10, 8] gradients of 3 nodes and volume
  const double* constants = nullptr;  ///< [batch, n_constants, 8] of the law
  const double* viscosity =
      nullptr;  ///< [batch, 2, 8] linear (Pa s), quadratic (Pa s^2) bulk viscosity
  double* memory =
      nullptr;  ///< [batch, 2, 8] dilatation and viscous pressure (Pa) at the last step
  const std::int32_t* pressure_nodes = nullptr;  ///< tet: [batch, 4, 8] (node, material) pairs
  double* nodal_volume_change = nullptr;    ///< tet: [n_pressure_nodes] sum of V/4 (J - 1), m^3
  double* nodal_pressure = nullptr;         ///< tet: [n_pressure_nodes] dU/dJ, Pa
  const double* nodal_volume = nullptr;     ///< tet: [n_pressure_nodes] sum of V/4, m^3
  const double* nodal_constants = nullptr;  ///< tet: [n_pressure_nodes, n_constants]
};

/// What a run over batches gives back.
struct KernelSums {
  double viscous_work = 0.0;  ///< J dissipated by bulk viscosity since the last step
  std::uint64_t bad = 0;      ///< elements with J <= 0 or not a number
};

/// Numbers per element that `evaluate` writes, [batch, n_evaluated, 8].
enum Evaluated {
  stress_xx,
  stress_yy,
  stress_zz,
  stress_xy,
  stress_yz,
  stress_zx,        ///< Cauchy, cell mean, Pa
  dilatation_mean,  ///< J - 1
  strain_energy,    ///< J in the element
  gradient_00,
  gradient_last = gradient_00 + 8,  ///< mean grad u
  smallest_jacobian,                ///< of all points
  n_evaluated
};

/// Kernels of one law and one instruction set over batches [begin, end) of a block.
struct KernelTable {
  void (*hex_force)(const BlockView&, const KernelStep&, std::int64_t begin, std::int64_t end,
                    KernelSums&) noexcept;
  void (*hex_evaluate)(const BlockView&, const double* displacement, std::int64_t begin,
                       std::int64_t end, double* out) noexcept;
  void (*tet_volume)(const BlockView&, const KernelStep&, std::int64_t begin,
                     std::int64_t end) noexcept;
  void (*tet_pressure)(const BlockView&, std::int64_t begin,
                       std::int64_t end) noexcept;  ///< pressure nodes
  void (*tet_force)(const BlockView&, const KernelStep&, std::int64_t begin, std::int64_t end,
                    KernelSums&) noexcept;
  void (*tet_evaluate)(const BlockView&, const double* displacement, std::int64_t begin,
                       std::int64_t end, double* out) noexcept;
  /// Stress and energy of one displacement gradient, for tests: P [9] Pa, returns energy J/m^3.
  double (*point)(const double* constants, const double H[9], double P[9]) noexcept;
};

}  // namespace ocublast::solid
