#pragma once

#include "solid_solver/elements/hex8_geometry.hpp"
#include "solid_solver/elements/hex8_kernels.hpp"

namespace ocublast::solid {

/// hex, 8 points, one pressure (mean dilatation, Simo, Taylor & Pister 1985).
struct Hex8Q1p0 {
  static constexpr const char* name = "hex8_q1p0";
  static constexpr const char* help =
      "hex, 8 points, one pressure (mean dilatation, Simo, Taylor & Pister 1985)";
  static constexpr Shape shape = Shape::hex8;
  static constexpr Volumetric volumetric = Volumetric::mean;
  static constexpr bool hourglass = false;
  static constexpr bool planar = false;
  static constexpr bool axisymmetric = false;
  static constexpr double step_factor = 0.7;
  static constexpr double cost = 1.0;
  template <int W>
  using Kernels = Hex8Kernels<W>;
  static ElementGeometry geometry() { return hex8_geometry(); }
};

}  // namespace ocublast::solid
