#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "solid_solver/mesh/solid_mesh.hpp"

namespace ocublast::solid {

/// Positions of a cell's nodes, m.
struct CellPositions {
  std::array<std::array<double, 3>, most_nodes> x{};
  std::size_t n = 0;
  [[nodiscard]] std::span<const std::array<double, 3>> nodes() const { return {x.data(), n}; }
};
/// `displacement` ([n, 4], m, may be null) is added.
[[nodiscard]] CellPositions cell_positions(const SolidMesh& mesh,
                                           std::span<const std::int32_t> nodes,
                                           const double* displacement = nullptr);

/// Volume of a cell, m^3 (area of a quad4, m^2), and the smallest Jacobian determinant at its
/// points times the volume of the reference cell: not positive when inverted.
struct CellVolume {
  double volume = 0.0;
  double smallest_jacobian = 0.0;
};
[[nodiscard]] CellVolume compute_cell_volume(Shape shape, std::span<const std::array<double, 3>> x);
/// Reference volume of a cell, m^3.
[[nodiscard]] double cell_volume(const SolidMesh& mesh, std::size_t cell);
/// Mean of a cell's node positions, m; of the current ones with a displacement.
[[nodiscard]] std::array<double, 3> cell_centre(const SolidMesh& mesh, std::size_t cell,
                                                const double* displacement = nullptr);

}  // namespace ocublast::solid
