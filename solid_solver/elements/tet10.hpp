#pragma once

#include "solid_solver/elements/isoparametric_geometry.hpp"
#include "solid_solver/elements/isoparametric_kernels.hpp"

namespace ocublast::solid {

/// quadratic tet, 4 points, one pressure, positive lumping.
struct Tet10 {
  static constexpr const char* name = "tet10";
  static constexpr const char* help = "quadratic tet, 4 points, one pressure, positive lumping";
  static constexpr Shape shape = Shape::tet10;
  static constexpr Volumetric volumetric = Volumetric::mean;
  static constexpr bool hourglass = false;
  static constexpr bool planar = false;
  static constexpr bool axisymmetric = false;
  static constexpr double step_factor = 0.33;
  static constexpr double cost = 1.0;
  template <int W>
  using Kernels = IsoparametricKernels<W, 10, 4, Space::solid>;
  static ElementGeometry geometry() { return tet10_geometry(); }
};

}  // namespace ocublast::solid
