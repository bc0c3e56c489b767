#pragma once

// Coordinates in which x is the distance r from a point or an axis: div F = r^-m d(r^m F)/dr with
// m = 2 (spherical) or 1 (cylindrical, axisymmetric). Mass and energy keep sum of r^m J q to
// round-off; the pressure enters the radial momentum as a plain gradient, so that gas at rest stays
// at rest.

#include <vector>

#include "flow_solver/grid/grid.hpp"
#include "flow_solver/numerics/kernel.hpp"

namespace ocublast::flow::inline OCU_PRECISION {

/// Metric along x by node and face, offset by table_offset as in LineMetric.
template <class T>
struct RadialMetricOf {
  int power = 0;                  ///< m
  std::vector<T> node_weight;     ///< m^m, r^m; beyond a mirrored end that of the mirrored node
  std::vector<T> inverse_volume;  ///< 1/(r^m J)
  std::vector<T> face_area;       ///< a(j) with a(j) r(j) = sum of (m + 1) r^m J: a velocity u = r
                                  ///< has the divergence m + 1 in every cell, also at r = 0
  std::vector<T> power_over_r;    ///< 1/m, m/r
  std::vector<T> filter_face;     ///< face jacobian of the filter times the area
};

using RadialMetric = RadialMetricOf<double>;
using StoredRadialMetric = RadialMetricOf<Real>;
[[nodiscard]] StoredRadialMetric stored(RadialMetric metric);

/// Metric of the x axis of a radial grid; `mirrored_low`, `mirrored_high`: planes of symmetry or
/// walls.
[[nodiscard]] RadialMetric make_radial_metric(const Grid& grid, bool mirrored_low,
                                              bool mirrored_high);

/// Tables of the flux solve of r^m f. About r = 0 the cylindrical r f is not smooth in its odd
/// continuation: the first two faces take the second-order mean of f times the area.
[[nodiscard]] LineTable make_radial_table(const LineTable& plain, int power, bool from_axis);

/// Faces at an axis that are explicit (make_radial_table).
inline constexpr int explicit_axis_faces = 2;

/// Kernels that differ on a radial grid (compact schemes).
struct RadialKernels {
  /// x-lines of row groups [g0, g1): R = radial divergence.
  void (*sweep_x)(const Context&, Real* scratch, int k, int g0, int g1);
  /// Adds m u / r to the dilatation in R, field 0.
  void (*add_dilatation)(const Context&, int k);
  /// Adds -beta m u / r to the bulk pressure, and renews its ghosts.
  void (*add_bulk)(const Context&, int k);
};

namespace isa_baseline {
const RadialKernels& radial_kernels() noexcept;
}
namespace isa_avx2 {
const RadialKernels& radial_kernels() noexcept;
}
namespace isa_avx512 {
const RadialKernels& radial_kernels() noexcept;
}

}  // namespace ocublast::flow
