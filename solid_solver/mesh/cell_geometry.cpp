#include "solid_solver/mesh/cell_geometry.hpp"

#include <algorithm>

#include "solid_solver/elements/hex8_geometry.hpp"
#include "solid_solver/elements/isoparametric_geometry.hpp"
#include "solid_solver/elements/tet4_geometry.hpp"

namespace ocublast::solid {

CellPositions cell_positions(const SolidMesh& mesh, std::span<const std::int32_t> nodes,
                             const double* displacement) {
  CellPositions positions;
  positions.n = nodes.size();
  for (std::size_t a = 0; a < nodes.size(); ++a)
    for (std::size_t i = 0; i < 3; ++i) {
      const auto n = static_cast<std::size_t>(nodes[a]);
      positions.x[a][i] = mesh.nodes[3 * n + i];
      if (displacement != nullptr) positions.x[a][i] += displacement[4 * n + i];
    }
  return positions;
}

CellVolume compute_cell_volume(Shape shape, std::span<const std::array<double, 3>> x) {
  if (shape == Shape::hex8) {
    const auto g = compute_hex_geometry(x);
    return {.volume = g.volume, .smallest_jacobian = 8.0 * g.smallest_jacobian};
  }
  if (shape == Shape::tet4) {
    const double volume = compute_tet_geometry(x).volume;
    return {.volume = volume, .smallest_jacobian = volume};
  }
  CellVolume result{.smallest_jacobian = 1e300};
  const auto points = compute_point_geometry(shape, x);
  for (const auto& point : points) {
    result.volume += point.weight;
    result.smallest_jacobian =
        std::min(result.smallest_jacobian, point.weight * static_cast<double>(points.size()));
  }
  return result;
}

double cell_volume(const SolidMesh& mesh, std::size_t cell) {
  const auto c = mesh.cell(cell);
  return compute_cell_volume(c.shape, cell_positions(mesh, c.nodes).nodes()).volume;
}

std::array<double, 3> cell_centre(const SolidMesh& mesh, std::size_t cell,
                                  const double* displacement) {
  std::array<double, 3> centre{};
  const auto positions = cell_positions(mesh, mesh.cell(cell).nodes, displacement);
  for (const auto& x : positions.nodes())
    for (std::size_t i = 0; i < 3; ++i) centre[i] += x[i] / static_cast<double>(positions.n);
  return centre;
}

}  // namespace ocublast::solid
