#pragma once

#include <array>

#include "solid_solver/elements/element_type.hpp"

namespace ocublast::solid {

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
[[nodiscard]] HexGeometry compute_hex_geometry(NodePositions x);

/// Of the kernels in hex8_kernels.hpp and hex8_one_point_kernels.hpp.
[[nodiscard]] ElementGeometry hex8_geometry();
[[nodiscard]] ElementGeometry hex8_one_point_geometry();

}  // namespace ocublast::solid
