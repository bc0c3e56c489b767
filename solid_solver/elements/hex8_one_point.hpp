#pragma once

#include "solid_solver/elements/hex8_geometry.hpp"
#include "solid_solver/elements/hex8_one_point_kernels.hpp"

namespace ocublast::solid {

/// hex, 1 point with hourglass stiffness scaled by the shear modulus; the fast one.
struct Hex8OnePoint {
  static constexpr const char* name = "hex8_one_point";
  static constexpr const char* help =
      "hex, 1 point with hourglass stiffness scaled by the shear modulus; the fast one";
  static constexpr Shape shape = Shape::hex8;
  static constexpr Volumetric volumetric = Volumetric::point;
  static constexpr bool hourglass = true;
  static constexpr bool planar = false;
  static constexpr bool axisymmetric = false;
  static constexpr double step_factor = 0.7;
  static constexpr double cost = 0.5;
  template <int W>
  using Kernels = Hex8OnePointKernels<W>;
  static ElementGeometry geometry() { return hex8_one_point_geometry(); }
};

}  // namespace ocublast::solid
