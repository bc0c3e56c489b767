#pragma once

#include <array>

#include "solid_solver/elements/element_type.hpp"

namespace ocublast::solid {

/// Reference geometry of a linear tet.
struct TetGeometry {
  std::array<std::array<double, 3>, 4> gradients;  ///< dN_a/dX, 1/m
  double volume = 0.0;                             ///< m^3, negative when inverted
};
/// Of the first four nodes.
[[nodiscard]] TetGeometry compute_tet_geometry(NodePositions x);

/// Smallest altitude 3 V / A_max of the first four nodes, m.
[[nodiscard]] double tet_length(NodePositions x);

/// Of the kernels in tet4_kernels.hpp.
[[nodiscard]] ElementGeometry tet4_geometry();

}  // namespace ocublast::solid
