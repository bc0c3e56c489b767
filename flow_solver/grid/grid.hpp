#pragma once

#include <array>
#include <cstddef>
#include <numbers>
#include <vector>

namespace ocublast::flow {

/// Ghost nodes beyond each end of a present direction.
inline constexpr int n_ghost = 4;

/// One direction of a Cartesian grid. Nodes are cell centres; faces lie half-way in index space.
/// Entry i + n_ghost of a vector belongs to node i, i = -n_ghost .. n + n_ghost - 1 (an absent
/// direction has n = 1 and no ghosts: entry 0).
struct Axis {
  int n = 1;
  bool present = false;
  double min = 0.0;              ///< m, first domain face
  double max = 0.0;              ///< m, last domain face
  std::vector<double> node;      ///< m
  std::vector<double> jacobian;  ///< m, dx/dxi at the nodes, from the same face solve as the fluxes
  std::vector<double> inverse;   ///< 1/m, 1/jacobian
  [[nodiscard]] int ghosts() const { return present ? n_ghost : 0; }
  [[nodiscard]] double x(int i) const { return node[static_cast<std::size_t>(i + ghosts())]; }
  [[nodiscard]] double h(int i) const { return jacobian[static_cast<std::size_t>(i + ghosts())]; }
};

/// Nodes [lo, hi) of a part of the grid.
struct NodeBox {
  int lo[3], hi[3];
};

[[nodiscard]] constexpr bool holds(const NodeBox& box, int i, int j, int k) noexcept {
  return i >= box.lo[0] && i < box.hi[0] && j >= box.lo[1] && j < box.hi[1] && k >= box.lo[2] &&
         k < box.hi[2];
}

/// What x means. Else than Cartesian it is the distance r from a point or an axis, and cells are
/// whole shells or rings; axisymmetric grids have y along the axis.
enum class Geometry { cartesian, cylindrical, spherical, axisymmetric };

/// Non-uniform grid in one to three directions.
struct Grid {
  std::array<Axis, 3> axis;
  Geometry geometry = Geometry::cartesian;
  /// Power m of r in the volume of a shell; 0: Cartesian.
  [[nodiscard]] int radial_power() const {
    return geometry == Geometry::cartesian ? 0 : (geometry == Geometry::spherical ? 2 : 1);
  }
  /// What multiplies the product of the jacobians in the volume of cells at index i: 4 pi r^2, 2 pi
  /// r, 1.
  [[nodiscard]] double radial_weight(int i) const {
    if (geometry == Geometry::cartesian) return 1.0;
    const double r = axis[0].x(i), two_pi = 2.0 * std::numbers::pi;
    return geometry == Geometry::spherical ? 2.0 * two_pi * r * r : two_pi * r;
  }
  [[nodiscard]] std::size_t n_cells() const {
    return static_cast<std::size_t>(axis[0].n) * static_cast<std::size_t>(axis[1].n) *
           static_cast<std::size_t>(axis[2].n);
  }
};

}  // namespace ocublast::flow
