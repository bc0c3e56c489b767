#pragma once

#include "solid_solver/elements/isoparametric_geometry.hpp"
#include "solid_solver/elements/isoparametric_kernels.hpp"

namespace ocublast::solid {

/// quad in plane strain, 4 points, one pressure, thickness 1 m.
struct Quad4PlaneStrain {
  static constexpr const char* name = "quad4_plane_strain";
  static constexpr const char* help = "quad in plane strain, 4 points, one pressure, thickness 1 m";
  static constexpr Shape shape = Shape::quad4;
  static constexpr Volumetric volumetric = Volumetric::mean;
  static constexpr bool hourglass = false;
  static constexpr bool planar = true;
  static constexpr bool axisymmetric = false;
  static constexpr double step_factor = 0.7;
  static constexpr double cost = 0.5;
  template <int W>
  using Kernels = IsoparametricKernels<W, 4, 4, Space::plane_strain>;
  static ElementGeometry geometry() { return quad4_plane_geometry(); }
};

}  // namespace ocublast::solid
