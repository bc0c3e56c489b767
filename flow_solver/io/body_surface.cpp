#include "flow_solver/io/body_surface.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "coupler/base/errors.hpp"
#include "coupler/base/hdf5_file.hpp"

namespace ocublast::flow::inline OCU_PRECISION {
namespace {

/// Quads [n, 4] (a fourth node of -1 marks a triangle) as triangles of the nodes they use.
BodySurface surface_of_faces(const std::vector<double>& nodes,
                             const std::vector<std::int32_t>& faces) {
  BodySurface surface;
  std::vector<std::int32_t> number(nodes.size() / 3, -1);
  const auto vertex = [&](std::int32_t node) {
    auto& n = number[static_cast<std::size_t>(node)];
    if (n < 0) {
      n = static_cast<std::int32_t>(surface.vertices.size() / 3);
      const auto* x = nodes.data() + 3 * static_cast<std::size_t>(node);
      surface.vertices.insert(surface.vertices.end(), x, x + 3);
    }
    return n;
  };
  for (std::size_t f = 0; f + 3 < faces.size(); f += 4) {
    const std::int32_t* q = faces.data() + f;
    surface.triangles.insert(surface.triangles.end(), {vertex(q[0]), vertex(q[1]), vertex(q[2])});
    if (q[3] >= 0)
      surface.triangles.insert(surface.triangles.end(), {vertex(q[0]), vertex(q[2]), vertex(q[3])});
  }
  return surface;
}

}  // namespace

BodySurface read_body_surface(const std::filesystem::path& file) try {
  const auto mesh = Hdf5File::open(file);
  if (mesh.text_attribute("format") != "ocublast-mesh" || mesh.integer_attribute("version") != 1)
    throw CaseError(
        fmt::format("{}: expected format ocublast-mesh, version 1; cases/mesh convert "
                    "makes it",
                    file.string()));
  const auto nodes = mesh.read<double>("nodes");
  const bool triangles = mesh.has("cells/tri3");
  if (!triangles && !mesh.has("face_sets/wet"))
    throw CaseError(fmt::format("{}: holds neither cells/tri3 nor face_sets/wet", file.string()));
  auto cells = mesh.read<std::int32_t>(triangles ? "cells/tri3" : "face_sets/wet");
  const auto n_nodes = static_cast<std::int32_t>(nodes.size() / 3);
  for (const auto node : cells)
    if (node >= n_nodes || node < (triangles ? 0 : -1))
      throw CaseError(
          fmt::format("{}: a facet names node {}, the mesh has {}", file.string(), node, n_nodes));
  if (triangles) return {.vertices = nodes, .triangles = std::move(cells)};
  return surface_of_faces(nodes, cells);
} catch (const LinkError& error) {
  throw CaseError(error.what());  // a damaged input file is the user's to mend
}

}  // namespace ocublast::flow
