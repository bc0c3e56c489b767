#include "solid_solver/io/mesh_file.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "coupler/base/errors.hpp"
#include "coupler/base/hdf5_file.hpp"

namespace ocublast::solid {
namespace {

constexpr std::int64_t format_version = 1;
constexpr const char* format_name = "ocublast-mesh";

/// A dataset [n, width] or [n] (width 0); empty where it is absent.
template <class T>
std::vector<T> read_table(const Hdf5File& file, const std::string& where, const std::string& name,
                          std::size_t width) {
  if (!file.has(name)) return {};
  std::vector<std::size_t> shape;
  auto values = file.read<T>(name, &shape);
  const bool fits = width == 0 ? shape.size() == 1 : shape.size() == 2 && shape[1] == width;
  if (!fits && !values.empty())
    throw CaseError(fmt::format("{}: {} has shape [{}], accepted [n{}]", where, name,
                                fmt::join(shape, ", "),
                                width == 0 ? "" : fmt::format(", {}", width)));
  return values;
}

void check_format(const Hdf5File& file, const std::string& where) {
  try {
    const auto format = file.text_attribute("format");
    const auto version = file.integer_attribute("version");
    if (format != format_name || version != format_version)
      throw CaseError(
          fmt::format("{}: format \"{}\" version {}, accepted \"{}\" version {}; make it with "
                      "cases/mesh",
                      where, format, version, format_name, format_version));
  } catch (const LinkError& error) {
    throw CaseError(fmt::format("{}: not a mesh file of this program ({}); make it with cases/mesh",
                                where, error.what()));
  }
}

/// Fibres of all cells where any shape has them; of the other shapes' cells zero.
void read_fibres(const Hdf5File& file, const std::string& where, SolidMesh& mesh) {
  for (const auto& shape : shapes) {
    const auto name = fmt::format("fibres/{}", shape.name);
    if (!file.has(name)) continue;
    const auto fibres = read_table<double>(file, where, name, 6);
    if (fibres.size() != 6 * mesh.count(shape.shape))
      throw CaseError(fmt::format("{}: {} has {} rows, cells/{} has {}", where, name,
                                  fibres.size() / 6, shape.name, mesh.count(shape.shape)));
    mesh.fibres.resize(6 * mesh.n_cells(), 0.0);
    std::copy(fibres.begin(), fibres.end(),
              mesh.fibres.begin() + static_cast<long>(6 * mesh.first_cell(shape.shape)));
  }
}

}  // namespace

SolidMesh read_mesh(const std::filesystem::path& path) try {
  const auto file = Hdf5File::open(path);
  const std::string where = path.string();
  check_format(file, where);
  SolidMesh mesh;
  mesh.nodes = read_table<double>(file, where, "nodes", 3);
  for (const auto& shape : shapes) {
    auto& cells = mesh.of(shape.shape);
    cells.nodes =
        read_table<std::int32_t>(file, where, fmt::format("cells/{}", shape.name), shape.n_nodes);
    cells.tissue = read_table<std::int32_t>(file, where, fmt::format("tissue/{}", shape.name), 0);
  }
  read_fibres(file, where, mesh);
  if (file.has("tissues")) mesh.tissues = file.read_text("tissues");
  for (const auto& name : file.list("node_sets"))
    mesh.node_sets[name] = read_table<std::int32_t>(file, where, "node_sets/" + name, 0);
  for (const auto& name : file.list("face_sets")) {
    const auto flat = read_table<std::int32_t>(file, where, "face_sets/" + name, 4);
    auto& facets = mesh.face_sets[name];
    for (std::size_t f = 0; f + 3 < flat.size(); f += 4)
      facets.push_back({flat[f], flat[f + 1], flat[f + 2], flat[f + 3]});
  }
  return mesh;
} catch (const LinkError& error) {
  throw CaseError(error.what());  // an unreadable mesh is the case's fault, not a partner's
}

void write_mesh(const std::filesystem::path& path, const SolidMesh& mesh) {
  auto file = Hdf5File::create(path);
  file.write_attribute("format", std::string(format_name));
  file.write_attribute("version", format_version);
  file.write("nodes", mesh.nodes, {mesh.n_nodes(), 3}, "m");
  for (const auto& shape : shapes) {
    const std::size_t n = mesh.count(shape.shape);
    if (n == 0) continue;
    const auto& cells = mesh.of(shape.shape);
    file.write(fmt::format("cells/{}", shape.name), cells.nodes, {n, shape.n_nodes}, "1");
    file.write(fmt::format("tissue/{}", shape.name), cells.tissue, {n}, "1");
    if (mesh.fibres.empty()) continue;
    const auto* first = mesh.fibres.data() + 6 * mesh.first_cell(shape.shape);
    file.write(fmt::format("fibres/{}", shape.name), std::vector<double>(first, first + 6 * n),
               {n, 6}, "1");
  }
  file.write_text("tissues", mesh.tissues);
  for (const auto& [name, nodes] : mesh.node_sets)
    file.write("node_sets/" + name, nodes, {nodes.size()}, "1");
  for (const auto& [name, facets] : mesh.face_sets) {
    std::vector<std::int32_t> flat;
    for (const auto& f : facets) flat.insert(flat.end(), f.begin(), f.end());
    file.write("face_sets/" + name, flat, {facets.size(), 4}, "1");
  }
  file.close();
}

}  // namespace ocublast::solid
