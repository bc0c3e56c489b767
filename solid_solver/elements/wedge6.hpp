#pragma once

#include "solid_solver/elements/isoparametric_geometry.hpp"
#include "solid_solver/elements/isoparametric_kernels.hpp"

namespace ocublast::solid {

/// wedge, 6 points, one pressure.
struct Wedge6 {
  static constexpr const char* name = "wedge6";
  static constexpr const char* help = "wedge, 6 points, one pressure";
  static constexpr Shape shape = Shape::wedge6;
  static constexpr Volumetric volumetric = Volumetric::mean;
  static constexpr bool hourglass = false;
  static constexpr bool planar = false;
  static constexpr bool axisymmetric = false;
  static constexpr double step_factor = 0.7;
  static constexpr double cost = 0.8;
  template <int W>
  using Kernels = IsoparametricKernels<W, 6, 6, Space::solid>;
  static ElementGeometry geometry() { return wedge6_geometry(); }
};

}  // namespace ocublast::solid
