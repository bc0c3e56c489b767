#pragma once

#include "solid_solver/elements/tet4_geometry.hpp"
#include "solid_solver/elements/tet4_kernels.hpp"

namespace ocublast::solid {

/// tet with averaged nodal pressure, per material (Bonet & Burton 1998).
struct Tet4Anp {
  static constexpr const char* name = "tet4_anp";
  static constexpr const char* help =
      "tet with averaged nodal pressure, per material (Bonet & Burton 1998)";
  static constexpr Shape shape = Shape::tet4;
  static constexpr Volumetric volumetric = Volumetric::nodal;
  static constexpr bool hourglass = false;
  static constexpr bool planar = false;
  static constexpr bool axisymmetric = false;
  static constexpr double step_factor = 0.8;
  static constexpr double cost = 0.25;
  template <int W>
  using Kernels = Tet4Kernels<W>;
  static ElementGeometry geometry() { return tet4_geometry(); }
};

}  // namespace ocublast::solid
