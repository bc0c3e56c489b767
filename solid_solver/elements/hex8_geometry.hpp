#pragma once

#include <array>

namespace ocublast::solid {

using HexNodes = std::array<std::array<double, 3>, 8>;  ///< VTK order, m

/// Kernels number the nodes of a hex by bits (xi, eta, zeta); entry b is the VTK node of binary
/// node b.
inline constexpr std::array<int, 8> hex_vtk_of_binary{0, 1, 3, 2, 4, 5, 7, 6};
/// Quads of a hex in VTK numbers, outward.
inline constexpr std::array<std::array<int, 4>, 6> hex_faces{
    {{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4}, {2, 3, 7, 6}, {1, 2, 6, 5}, {0, 4, 7, 3}}};

/// Reference geometry of a trilinear hex at its 2x2x2 Gauss points (point q by bits, as nodes).
struct HexGeometry {
  std::array<std::array<double, 9>, 8> gradients;  ///< (1/8) d xi_k / d X_j, row k, 1/m
  std::array<double, 8> weights;                   ///< det(dX/dxi), m^3
  std::array<double, 8> lumped;                    ///< sum_q w_q N_a, VTK order, m^3
  double volume = 0.0;                             ///< m^3
  double smallest_jacobian = 0.0;                  ///< m^3, over the points
};
[[nodiscard]] HexGeometry compute_hex_geometry(const HexNodes& x);

/// V / A_max, the length of the step rule, m.
[[nodiscard]] double hex_length(const HexNodes& x);

}  // namespace ocublast::solid
