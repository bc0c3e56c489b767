#include "solid_solver/io/field_output.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "coupler/base/hdf5_file.hpp"
#include "solid_solver/elements/cell_stress.hpp"
#include "solid_solver/mesh/cell_geometry.hpp"

namespace ocublast::solid {
namespace {

struct CellField {
  const char* name;
  const char* units;
  std::size_t width;
};
constexpr CellField cell_fields[] = {
    {"pressure", "Pa", 1},         {"von_mises", "Pa", 1},         {"stress", "Pa", 6},
    {"principal_stress", "Pa", 1}, {"principal_strain", "1", 1},   {"deviatoric_norm", "Pa", 1},
    {"volume_ratio", "1", 1},      {"energy_density", "J/m^3", 1}, {"principal_stresses", "Pa", 3},
    {"principal_strains", "1", 3}};
struct NodeField {
  const char* name;
  const char* units;
};
constexpr NodeField node_fields[] = {
    {"displacement", "m"}, {"velocity", "m/s"}, {"acceleration", "m/s^2"}};

std::string step_name(std::size_t step) {
  return fmt::format("solid/{:04}.h5", step);
}

/// Values of one cell field for cells [begin, end), in single precision (files for the eye).
std::vector<float> gather(const CellField& field, const SolidMesh& mesh,
                          std::span<const double> cells, std::size_t begin, std::size_t end) {
  std::vector<float> values;
  values.reserve((end - begin) * field.width);
  const std::string_view name = field.name;
  constexpr std::size_t xdmf_order[] = {stress_xx, stress_xy, stress_zx,
                                        stress_yy, stress_yz, stress_zz};
  for (std::size_t c = begin; c < end; ++c) {
    const double* cell = &cells[c * n_evaluated];
    if (name == "stress") {
      for (const auto k : xdmf_order) values.push_back(static_cast<float>(cell[k]));
      continue;
    }
    const auto s = cell_scalars(cell);
    if (name == "energy_density") {
      values.push_back(static_cast<float>(cell[strain_energy] / cell_volume(mesh, c)));
      continue;
    }
    if (field.width == 3) {
      for (const double value :
           name == "principal_stresses" ? s.principal_stresses : s.principal_strains)
        values.push_back(static_cast<float>(value));
      continue;
    }
    values.push_back(static_cast<float>(name == "pressure"           ? s.pressure
                                        : name == "deviatoric_norm"  ? s.deviatoric_norm
                                        : name == "volume_ratio"     ? 1.0 + cell[dilatation_mean]
                                        : name == "von_mises"        ? s.von_mises
                                        : name == "principal_stress" ? s.principal_stress
                                                                     : s.principal_strain));
  }
  return values;
}

std::string data_item(const std::string& place, const std::string& dimensions, const char* number,
                      int precision) {
  return fmt::format(
      "<DataItem Format=\"HDF\" Dimensions=\"{}\" NumberType=\"{}\" Precision=\"{}\">{}</DataItem>",
      dimensions, number, precision, place);
}

}  // namespace

FieldOutput::FieldOutput(std::filesystem::path out, std::vector<std::string> fields)
    : out_(std::move(out)), fields_(std::move(fields)) {}

void FieldOutput::write_mesh_file(const SolidMesh& mesh) {
  auto file = Hdf5File::create(out_ / "solid" / "mesh.h5");
  for (const auto& shape : shapes) {
    const std::size_t n = mesh.count(shape.shape);
    if (n == 0) continue;
    const auto& cells = mesh.of(shape.shape);
    file.write(fmt::format("{}/cells", shape.name), cells.nodes, {n, shape.n_nodes}, "1");
    file.write(fmt::format("{}/tissue", shape.name), cells.tissue, {n}, "1");
  }
  file.write_text("tissues", mesh.tissues);
  file.close();
}

void FieldOutput::write_step(const std::filesystem::path& path, const StateView& state) const {
  const auto& mesh = *state.mesh;
  const std::size_t n = mesh.n_nodes();
  auto file = Hdf5File::create(path);
  std::vector<float> values(3 * n);
  const auto wanted = [&](const char* name) {
    return std::find(fields_.begin(), fields_.end(), name) != fields_.end();
  };
  for (std::size_t a = 0; a < n; ++a)
    for (std::size_t i = 0; i < 3; ++i)
      values[3 * a + i] = static_cast<float>(mesh.nodes[3 * a + i] + state.displacement[4 * a + i]);
  file.write("position", values, {n, 3}, "m");
  for (const auto& field : node_fields) {
    if (!wanted(field.name)) continue;
    const std::string_view name = field.name;
    const auto from = name == "velocity"       ? state.velocity
                      : name == "acceleration" ? state.acceleration
                                               : state.displacement;
    for (std::size_t a = 0; a < n; ++a)
      for (std::size_t i = 0; i < 3; ++i) values[3 * a + i] = static_cast<float>(from[4 * a + i]);
    file.write(field.name, values, {n, 3}, field.units);
  }
  for (const auto& field : cell_fields) {
    if (!wanted(field.name)) continue;
    const auto write = [&](const char* group, std::size_t begin, std::size_t end) {
      if (begin == end) return;
      const std::vector<std::size_t> shape =
          field.width == 1 ? std::vector<std::size_t>{end - begin}
                           : std::vector<std::size_t>{end - begin, field.width};
      file.write(fmt::format("{}/{}", group, field.name),
                 gather(field, mesh, state.cells, begin, end), shape, field.units);
    };
    for (const auto& shape : shapes) {
      const std::size_t begin = mesh.first_cell(shape.shape);
      write(shape.name, begin, begin + mesh.count(shape.shape));
    }
  }
  file.close();
}

void FieldOutput::write(const StateView& state) {
  if (times_.empty()) write_mesh_file(*state.mesh);
  write_step(out_ / step_name(times_.size()), state);
  times_.push_back(state.time);
  replace_file(out_ / "solid.xmf", document(*state.mesh));
}

std::string FieldOutput::grid(const SolidMesh& mesh, std::size_t step,
                              const ShapeInfo& shape) const {
  const char* group = shape.name;
  const std::size_t n = mesh.count(shape.shape);
  const std::string file = step_name(step) + ":/";
  const std::string node_shape = fmt::format("{} 3", mesh.n_nodes());
  std::string text = fmt::format(
      "<Grid Name=\"{}\" GridType=\"Uniform\">\n<Time Value=\"{:.12g}\"/>\n", group, times_[step]);
  text += fmt::format("<Topology TopologyType=\"{}\" NumberOfElements=\"{}\">{}</Topology>\n",
                      shape.xdmf, n,
                      data_item(fmt::format("solid/mesh.h5:/{}/cells", group),
                                fmt::format("{} {}", n, shape.n_nodes), "Int", 4));
  text += fmt::format("<Geometry GeometryType=\"XYZ\">{}</Geometry>\n",
                      data_item(file + "position", node_shape, "Float", 4));
  const auto attribute = [&](const char* name, const char* type, const char* centre,
                             const std::string& item) {
    text +=
        fmt::format("<Attribute Name=\"{}\" AttributeType=\"{}\" Center=\"{}\">{}</Attribute>\n",
                    name, type, centre, item);
  };
  attribute(
      "tissue", "Scalar", "Cell",
      data_item(fmt::format("solid/mesh.h5:/{}/tissue", group), fmt::format("{}", n), "Int", 4));
  const auto wanted = [&](const char* name) {
    return std::find(fields_.begin(), fields_.end(), name) != fields_.end();
  };
  for (const auto& field : node_fields)
    if (wanted(field.name))
      attribute(field.name, "Vector", "Node", data_item(file + field.name, node_shape, "Float", 4));
  for (const auto& field : cell_fields)
    if (wanted(field.name))
      attribute(
          field.name,
          field.width == 1   ? "Scalar"
          : field.width == 3 ? "Vector"
                             : "Tensor6",
          "Cell",
          data_item(fmt::format("{}{}/{}", file, group, field.name),
                    field.width == 1 ? fmt::format("{}", n) : fmt::format("{} {}", n, field.width),
                    "Float", 4));
  return text + "</Grid>\n";
}

std::string FieldOutput::document(const SolidMesh& mesh) const {
  std::string text =
      "<?xml version=\"1.0\"?>\n<Xdmf Version=\"3.0\">\n<Domain>\n"
      "<Grid Name=\"solid\" GridType=\"Collection\" CollectionType=\"Temporal\">\n";
  const auto present = [&](const ShapeInfo& shape) { return mesh.count(shape.shape) > 0; };
  const bool several = std::count_if(shapes.begin(), shapes.end(), present) > 1;
  for (std::size_t step = 0; step < times_.size(); ++step) {
    if (several)
      text += fmt::format(
          "<Grid Name=\"solid\" GridType=\"Collection\" CollectionType=\"Spatial\">\n<Time "
          "Value=\"{:.12g}\"/>\n",
          times_[step]);
    for (const auto& shape : shapes)
      if (present(shape)) text += grid(mesh, step, shape);
    if (several) text += "</Grid>\n";
  }
  return text + "</Grid>\n</Domain>\n</Xdmf>\n";
}

}  // namespace ocublast::solid
