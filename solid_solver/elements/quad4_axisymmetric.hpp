#pragma once

#include "solid_solver/elements/isoparametric_geometry.hpp"
#include "solid_solver/elements/isoparametric_kernels.hpp"

namespace ocublast::solid {

/// quad of a body of revolution about y (x the radius), 4 points, one pressure.
struct Quad4Axisymmetric {
  static constexpr const char* name = "quad4_axisymmetric";
  static constexpr const char* help =
      "quad of a body of revolution about y (x the radius), 4 points, one pressure";
  static constexpr Shape shape = Shape::quad4;
  static constexpr Volumetric volumetric = Volumetric::mean;
  static constexpr bool hourglass = false;
  static constexpr bool planar = true;
  static constexpr bool axisymmetric = true;
  static constexpr double step_factor = 0.7;
  static constexpr double cost = 0.5;
  template <int W>
  using Kernels = IsoparametricKernels<W, 4, 4, Space::axisymmetric>;
  static ElementGeometry geometry() { return quad4_ring_geometry(); }
};

}  // namespace ocublast::solid
