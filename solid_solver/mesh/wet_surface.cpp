#include "solid_solver/mesh/wet_surface.hpp"

#include <algorithm>

namespace ocublast::solid {

WetSurface make_wet_surface(const SolidMesh& mesh, const std::string& face_set) {
  WetSurface surface{.name = face_set};
  const auto& facets = mesh.face_sets.at(face_set);
  for (const auto& f : facets)
    for (const auto n : f)
      if (n >= 0) surface.nodes.push_back(n);
  std::sort(surface.nodes.begin(), surface.nodes.end());
  surface.nodes.erase(std::unique(surface.nodes.begin(), surface.nodes.end()), surface.nodes.end());
  std::vector<std::int32_t> vertex(mesh.n_nodes(), -1);
  for (std::size_t v = 0; v < surface.nodes.size(); ++v) {
    const auto n = static_cast<std::size_t>(surface.nodes[v]);
    vertex[n] = static_cast<std::int32_t>(v);
    for (std::size_t i = 0; i < 3; ++i) surface.vertices.push_back(mesh.nodes[3 * n + i]);
  }
  const auto add = [&](std::int32_t a, std::int32_t b, std::int32_t c) {
    for (const auto n : {a, b, c}) surface.triangles.push_back(vertex[static_cast<std::size_t>(n)]);
  };
  for (const auto& f : facets) {
    if (f[3] < 0) continue;
    add(f[0], f[1], f[2]);
    add(f[0], f[2], f[3]);
    ++surface.n_quads;
  }
  for (const auto& f : facets)
    if (f[3] < 0) add(f[0], f[1], f[2]);
  return surface;
}

}  // namespace ocublast::solid
