#pragma once

#include "solid_solver/elements/tet4_geometry.hpp"
#include "solid_solver/elements/tet4_kernels.hpp"

namespace ocublast::solid {

/// tet, 1 point; locks when nearly incompressible.
struct Tet4 {
  static constexpr const char* name = "tet4";
  static constexpr const char* help = "tet, 1 point; locks when nearly incompressible";
  static constexpr Shape shape = Shape::tet4;
  static constexpr Volumetric volumetric = Volumetric::point;
  static constexpr bool hourglass = false;
  static constexpr bool planar = false;
  static constexpr bool axisymmetric = false;
  static constexpr double step_factor = 0.8;
  static constexpr double cost = 0.2;
  template <int W>
  using Kernels = Tet4Kernels<W>;
  static ElementGeometry geometry() { return tet4_geometry(); }
};

}  // namespace ocublast::solid
