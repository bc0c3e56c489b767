#pragma once

#include "solid_solver/elements/element_type.hpp"

namespace ocublast::solid {

/// Shape gradients and weights at the points of a cell of any shape.
struct PointGeometry {
  std::vector<std::array<double, 3>> gradients;  ///< [nodes] dN_a/dX, 1/m
  std::vector<double> shape;                     ///< [nodes] N_a
  double weight = 0.0;                           ///< m^3 (m^2 for quad4)
};
/// At the points of the elements tet10 (4), wedge6 (6), quad4 (4). Precondition: one of these.
[[nodiscard]] std::vector<PointGeometry> compute_point_geometry(Shape shape, NodePositions x);

/// Quadratic tet: 4 points; mass lumped in proportion to the diagonal of the consistent mass of the
/// straight tet (Hinton, Rock & Zienkiewicz 1976), 1/36 at corners and 4/27 at edges: row sums
/// would be negative at the corners.
[[nodiscard]] ElementGeometry tet10_geometry();
/// Wedge: 3 points in the triangle times 2 along; nodes 0-1-2 counter-clockwise seen from the
/// triangle 3-4-5 (the order of Gmsh, Abaqus and Exodus).
[[nodiscard]] ElementGeometry wedge6_geometry();
/// Quad in the plane: thickness 1 m, or the ring about the y axis at radius x.
[[nodiscard]] ElementGeometry quad4_plane_geometry();
[[nodiscard]] ElementGeometry quad4_ring_geometry();

}  // namespace ocublast::solid
