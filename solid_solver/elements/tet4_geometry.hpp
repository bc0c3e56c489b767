#pragma once

#include <array>

namespace ocublast::solid {

using TetNodes = std::array<std::array<double, 3>, 4>;  ///< VTK order, m

/// Reference geometry of a linear tet.
struct TetGeometry {
  std::array<std::array<double, 3>, 4> gradients;  ///< dN_a/dX, 1/m
  double volume = 0.0;                             ///< m^3, negative when inverted
};
[[nodiscard]] TetGeometry compute_tet_geometry(const TetNodes& x);

/// Smallest altitude 3 V / A_max, the length of the step rule, m.
[[nodiscard]] double tet_length(const TetNodes& x);

}  // namespace ocublast::solid
