#pragma once

#include <string>
#include <vector>

#include "solid_solver/mesh/solid_mesh.hpp"

namespace ocublast::solid {

/// Every fault of a mesh, in words with ids, places (m) and tissues: index ranges, cells with a
/// non-positive Jacobian, duplicate and unused nodes, sets out of range. At most `limit` ids are
/// listed per kind, the rest counted.
[[nodiscard]] std::vector<std::string> check_mesh(const SolidMesh& mesh, std::size_t limit = 5);

/// Whether all ids are in range and all positions are numbers: the mesh can be looked into, even if
/// check_mesh finds cells of bad shape.
[[nodiscard]] bool numbers_in_range(const SolidMesh& mesh);

/// Faults of a wet surface: facets that repeat an edge in the same direction (orientation), edges
/// in one facet only (not closed), a negative enclosed volume (turned inside out).
[[nodiscard]] std::vector<std::string> check_closed_surface(const SolidMesh& mesh,
                                                            const std::string& face_set,
                                                            std::size_t limit = 5);

}  // namespace ocublast::solid
