#pragma once

#include "solid_solver/elements/hex8_geometry.hpp"
#include "solid_solver/elements/hex8_kernels.hpp"

namespace ocublast::solid {

/// hex, 8 points, pressure per point; locks when nearly incompressible.
struct Hex8Full {
  static constexpr const char* name = "hex8_full";
  static constexpr const char* help =
      "hex, 8 points, pressure per point; locks when nearly incompressible";
  static constexpr Shape shape = Shape::hex8;
  static constexpr Volumetric volumetric = Volumetric::point;
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
