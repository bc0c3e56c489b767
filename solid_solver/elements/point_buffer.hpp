#pragma once

#include <cstdint>

// What element kernels and law kernels hand each other. An element turns nodal displacements into
// displacement gradients at its points; a law turns gradients into weighted stresses; the element
// turns those into nodal forces. The buffer between them stays in the first-level cache, so that
// laws and elements compile apart: n + m kernels instead of n m.

namespace ocublast::solid {

constexpr int batch_lanes = 8;    ///< elements per stored batch
constexpr int buffer_points = 8;  ///< points (times 8 lanes) handled at a time
constexpr int row_stride = 4;     ///< numbers per node: x, y, z and the nodal pressure

/// How the dilatation that sets the pressure is averaged.
enum class Volumetric {
  mean,   ///< over the element, weighted by reference volume (P0)
  point,  ///< not at all
  nodal   ///< at nodes over the elements of one material (averaged nodal pressure)
};

/// One group of batches on its way through the kernels, point-major, lane last.
struct alignas(64) PointBuffer {
  double gradient[buffer_points][9][batch_lanes];  ///< grad u, row-major
  double weight[buffer_points][batch_lanes];       ///< reference volume of the point, m^3
  double stress[buffer_points][9][batch_lanes];    ///< weight times first Piola-Kirchhoff, N m
  double mean_stress[buffer_points][batch_lanes];  ///< volumetric stress of the point, Pa
  double extra[buffer_points][12][batch_lanes];    ///< element's own, e.g. hourglass amplitudes
  double hourglass[buffer_points][batch_lanes];    ///< hourglass energy per element, J
};

/// Stress added to a law's own, alike for all laws (see overlay.hpp).
struct OverlayView {
  int n_terms = 0;                     ///< of the Prony series
  int n_state = 0;                     ///< doubles per point
  const double* parameters = nullptr;  ///< [batch, 1 + 2 n_terms, 8] viscosity Pa s, (g, 1/tau)
  double* state = nullptr;             ///< [batch, point, n_state, 8]
};

/// Elements of one type and one law, in batches of 8 lanes; all arrays are batch-major, lane last.
struct BlockView {
  int n_points = 0;
  Volumetric volumetric = Volumetric::mean;
  /// [batch, nodes per element, 8] Where a node's row lies among those of the element's chunk, in
  /// doubles: rows of `row_stride` numbers.
  const std::uint16_t* nodes = nullptr;
  const double* reference = nullptr;  ///< [batch, n_reference, 8], the element's own layout
  const double* constants = nullptr;  ///< [batch, n_values, 8] of the law
  const double* viscosity = nullptr;  ///< [batch, 2, 8] linear Pa s, quadratic Pa s^2
  double* memory = nullptr;           ///< [batch, 2, 8] dilatation, viscous stress (Pa)
  OverlayView overlay;
  double* nodal_volume_change = nullptr;    ///< nodal: [n_pressure_nodes] sum of V/4 (J - 1), m^3
  double* nodal_pressure = nullptr;         ///< nodal: [n_pressure_nodes] dU/dJ, Pa
  const double* nodal_volume = nullptr;     ///< nodal: [n_pressure_nodes] sum of V/4, m^3
  const double* nodal_constants = nullptr;  ///< nodal: [n_pressure_nodes, n_values]
  const double* dilatation_rows = nullptr;  ///< nodal, to evaluate: J - 1 by rows of the chunk
};

/// What a run over batches gives back.
struct KernelSums {
  double viscous_work = 0.0;      ///< J dissipated by bulk viscosity since the last step
  double overlay_work = 0.0;      ///< J of work on overlays since the last step
  double hourglass_energy = 0.0;  ///< J stored now
  std::uint64_t bad = 0;          ///< elements with J <= 0 or not a number
};

/// Numbers per element that `evaluate` writes, [batch, n_evaluated, 8].
enum Evaluated {
  stress_xx,
  stress_yy,
  stress_zz,
  stress_xy,
  stress_yz,
  stress_zx,         ///< Cauchy, cell mean, Pa
  dilatation_mean,   ///< J - 1
  strain_energy,     ///< J in the element, of the law
  hourglass_energy,  ///< J in the element, of the hourglass stiffness
  gradient_00,
  gradient_last = gradient_00 + 8,  ///< mean grad u
  smallest_jacobian,                ///< of all points
  n_evaluated
};

/// Kernels of one law for one instruction set over batches [begin, end) of a block, whose points
/// lie in the buffer from its start.
struct LawKernels {
  /// Stresses from gradients. inverse_step > 0 (1/s) adds bulk viscosity and advances memories.
  void (*stress)(const BlockView&, double inverse_step, std::int64_t begin, std::int64_t end,
                 PointBuffer&, KernelSums&) noexcept = nullptr;
  /// Pressures of pressure nodes [begin, end).
  void (*nodal_pressure)(const BlockView&, std::int64_t begin, std::int64_t end) noexcept = nullptr;
  /// Results per element, out [batch - begin, n_evaluated, 8].
  void (*evaluate)(const BlockView&, std::int64_t begin, std::int64_t end, const PointBuffer&,
                   double* out) noexcept = nullptr;
  /// Stress and energy of one displacement gradient, for tests: P [9] Pa, returns energy J/m^3.
  double (*point)(const double* values, const double H[9], double P[9]) noexcept = nullptr;
};

/// Kernels of one element for one instruction set, over batches [begin, end) of a block that belong
/// to one chunk: nodal rows are the chunk's own.
struct ElementKernels {
  /// Gradients and weights at the points from displacements [n, 4] m; nodal: the mean of the rows'
  /// fourth numbers (Pa) into mean_stress.
  void (*gradients)(const BlockView&, const double* rows, std::int64_t begin, std::int64_t end,
                    PointBuffer&) noexcept = nullptr;
  /// Adds nodal forces [n, 4] N from the weighted stresses.
  void (*forces)(const BlockView&, std::int64_t begin, std::int64_t end, const PointBuffer&,
                 double* force) noexcept = nullptr;
  /// Nodal only: adds V/4 (J - 1) (m^3; tr H for J - 1 of laws at small strain) to the first number
  /// of the nodes' rows.
  void (*add_volume)(const BlockView&, const double* rows, bool finite_strain, std::int64_t begin,
                     std::int64_t end, double* change) noexcept = nullptr;
};

}  // namespace ocublast::solid
