#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "solid_solver/mesh/solid_mesh.hpp"

namespace ocublast::solid {

/// A surface as it goes over the interface. Vertices are the set's nodes in ascending node order;
/// vertex v is node `nodes[v]`. A quad (a, b, c, d) is cut into the triangles (a, b, c), (a, c, d);
/// quads come before triangles.
struct WetSurface {
  std::string name;
  std::vector<std::int32_t> nodes;      ///< [n_vertices] node of a vertex
  std::vector<std::int32_t> triangles;  ///< [n_triangles, 3] vertices, outward
  std::size_t n_quads = 0;              ///< the first 2 n_quads triangles are theirs
  std::vector<double> vertices;         ///< [n_vertices, 3] reference positions, m
};
[[nodiscard]] WetSurface make_wet_surface(const SolidMesh& mesh, const std::string& face_set);

}  // namespace ocublast::solid
