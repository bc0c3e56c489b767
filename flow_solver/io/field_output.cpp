#include "flow_solver/io/field_output.hpp"

#include <fmt/format.h>

#include <array>
#include <memory>

#include "coupler/base/hdf5_file.hpp"
#include "flow_solver/ranks/gather.hpp"

namespace ocublast::flow::inline OCU_PRECISION {
namespace {

/// Domain faces of an axis, m: sums of the node spacings, ends exact.
std::vector<double> faces(const Axis& axis) {
  std::vector<double> x{axis.min};
  for (int i = 0; i < axis.n; ++i)
    x.push_back(i + 1 == axis.n ? axis.max
                                : x.back() + (axis.present ? axis.h(i) : axis.max - axis.min));
  return x;
}

std::string data_item(std::string_view shape, std::string_view file, std::string_view dataset,
                      std::string_view type = "Float\" Precision=\"4") {
  return fmt::format(
      "<DataItem Format=\"HDF\" NumberType=\"{}\" Dimensions=\"{}\">{}:/{}</DataItem>", type, shape,
      file, dataset);
}

std::string attribute(std::string_view name, std::string_view kind, std::string_view center,
                      const std::string& item) {
  return fmt::format("<Attribute Name=\"{}\" AttributeType=\"{}\" Center=\"{}\">{}</Attribute>\n",
                     name, kind, center, item);
}

const char* const xdmf_head =
    "<?xml version=\"1.0\"?>\n<Xdmf Version=\"3.0\"><Domain>\n"
    "<Grid Name=\"series\" GridType=\"Collection\" CollectionType=\"Temporal\">\n";
const char* const xdmf_tail = "</Grid></Domain></Xdmf>\n";

}  // namespace

/// All that a file and the index need, so that neither reads what the run has changed since.
struct FieldOutput::Frame {
  struct Scalar {
    const char *name, *units;
    std::vector<float> values;  ///< [n_k, n_j, n_i]
  };
  std::array<Scalar, 3> scalars;
  std::array<std::vector<float>, 3> velocity;
  std::vector<std::uint8_t> tags;  ///< empty without bodies
  std::vector<double> times;       ///< s, up to this frame
};

FieldOutput::FieldOutput(const Grid& grid, const Gas& gas, Options options,
                         BackgroundWriter& writer)
    : grid_(&grid), gas_(gas), options_(std::move(options)), writer_(&writer) {}

void FieldOutput::write(const Ranks& ranks, const NodeBox& own, FieldsView<const Real> W,
                        std::span<const std::uint8_t> tags, double t) {
  const auto gather = [&](auto&& value) { return gather_nodes<float>(ranks, *grid_, own, value); };
  times_.push_back(t);
  auto frame = std::make_shared<Frame>(Frame{
      {{{"overpressure", "Pa", gather([&](int i, int j, int k) {
           return pressure(gas_, W(prim_rho, i, j, k), W(prim_T, i, j, k)) -
                  options_.ambient_pressure;
         })},
        {"density", "kg/m^3", gather([&](int i, int j, int k) { return W(prim_rho, i, j, k); })},
        {"temperature", "K", gather([&](int i, int j, int k) { return W(prim_T, i, j, k); })}}},
      {},
      {tags.begin(), tags.end()},
      times_});
  for (int a = 0; a < 3; ++a)
    frame->velocity[static_cast<std::size_t>(a)] =
        gather([&](int i, int j, int k) { return W(prim_u + a, i, j, k); });
  if (!ranks.root()) return;
  // Six numbers a node, and the velocities once more side by side.
  const std::size_t bytes = grid_->n_cells() * (9 * sizeof(float) + 1);
  writer_->post(bytes, [this, frame = std::move(frame)] {
    write_file(*frame);
    write_index(*frame);
  });
}

void FieldOutput::write_file(const Frame& frame) const {
  const Grid& grid = *grid_;
  const std::vector<std::size_t> shape{static_cast<std::size_t>(grid.axis[2].n),
                                       static_cast<std::size_t>(grid.axis[1].n),
                                       static_cast<std::size_t>(grid.axis[0].n)};
  auto file = Hdf5File::create(options_.directory / "flow" /
                               fmt::format("{:04}.h5", frame.times.size() - 1));
  for (std::size_t a = 0; a < 3; ++a) {
    const auto x = faces(grid.axis[a]);
    file.write(fmt::format("faces_{}", "xyz"[a]), x, {x.size()}, "m");
  }
  for (const Frame::Scalar& s : frame.scalars) file.write(s.name, s.values, shape, s.units);
  std::vector<float> velocity;
  velocity.reserve(3 * grid.n_cells());
  for (std::size_t c = 0; c < grid.n_cells(); ++c)
    for (const auto& component : frame.velocity) velocity.push_back(component[c]);
  file.write("velocity", velocity, {shape[0], shape[1], shape[2], 3}, "m/s");
  // 0: gas; elsewhere the other fields hold what the walls' stencils left there.
  if (!frame.tags.empty()) file.write("tag", frame.tags, shape, "1");
  file.write("time", std::vector<double>{frame.times.back()}, {1}, "s");
  file.close();
}

void FieldOutput::write_index(const Frame& frame) const {
  const Grid& grid = *grid_;
  const std::string cells = fmt::format("{} {} {}", grid.axis[2].n, grid.axis[1].n, grid.axis[0].n);
  std::string text = xdmf_head;
  for (std::size_t f = 0; f < frame.times.size(); ++f) {
    const std::string file = fmt::format("flow/{:04}.h5", f);
    text += fmt::format(
        "<Grid Name=\"flow\" GridType=\"Uniform\"><Time Value=\"{:.12g}\"/>\n"
        "<Topology TopologyType=\"3DRectMesh\" Dimensions=\"{} {} {}\"/>\n"
        "<Geometry GeometryType=\"VXVYVZ\">",
        frame.times[f], grid.axis[2].n + 1, grid.axis[1].n + 1, grid.axis[0].n + 1);
    for (std::size_t a = 0; a < 3; ++a)
      text += data_item(std::to_string(grid.axis[a].n + 1), file, fmt::format("faces_{}", "xyz"[a]),
                        "Float\" Precision=\"8");
    text += "</Geometry>\n";
    for (const char* name : {"overpressure", "density", "temperature"})
      text += attribute(name, "Scalar", "Cell", data_item(cells, file, name));
    if (!frame.tags.empty())
      text += attribute("tag", "Scalar", "Cell",
                        data_item(cells, file, "tag", "UChar\" Precision=\"1"));
    text += attribute("velocity", "Vector", "Cell", data_item(cells + " 3", file, "velocity"));
    text += "</Grid>\n";
  }
  replace_file(options_.directory / "flow.xmf", text + xdmf_tail);
}

struct InterfaceOutput::Frame {
  struct Body {
    std::string name;
    std::vector<std::int32_t> triangles;     ///< [n_t, 3]
    std::vector<double> position, velocity;  ///< [n_v, 3], m and m/s
    std::vector<double> overpressure;        ///< [n_v], Pa
  };
  std::vector<Body> bodies;
  std::vector<double> times;  ///< s, up to this frame
};

void InterfaceOutput::write(const Ranks& ranks, const ImmersedBoundary& bodies,
                            FieldsView<const Real> W, double ambient_pressure, double t) {
  times_.push_back(t);
  auto frame = std::make_shared<Frame>();
  frame->times = times_;
  std::size_t bytes = 0;
  for (std::size_t b = 0; b < bodies.n_bodies(); ++b) {
    const auto x = bodies.position(b);
    const auto v = bodies.velocity(b);
    std::vector<double> p(x.size() / 3);
    bodies.read_overpressure(W, b, ambient_pressure, p);
    const auto& triangles = bodies.body(b).surface.triangles;
    bytes += triangles.size() * sizeof(std::int32_t) + 7 * p.size() * sizeof(double);
    frame->bodies.push_back({bodies.body(b).name,
                             {triangles.begin(), triangles.end()},
                             {x.begin(), x.end()},
                             {v.begin(), v.end()},
                             std::move(p)});
  }
  if (!ranks.root()) return;
  writer_->post(bytes, [this, frame = std::move(frame)] {
    write_file(*frame);
    write_index(*frame);
  });
}

void InterfaceOutput::write_file(const Frame& frame) const {
  auto file =
      Hdf5File::create(directory_ / "interface" / fmt::format("{:04}.h5", frame.times.size() - 1));
  for (const Frame::Body& body : frame.bodies) {
    const std::string group = body.name + "/";
    const std::size_t n_v = body.overpressure.size();
    file.write(group + "position", body.position, {n_v, 3}, "m");
    file.write(group + "velocity", body.velocity, {n_v, 3}, "m/s");
    file.write(group + "overpressure", body.overpressure, {n_v}, "Pa");
    file.write(group + "triangles", body.triangles, {body.triangles.size() / 3, 3}, "1");
  }
  file.write("time", std::vector<double>{frame.times.back()}, {1}, "s");
  file.close();
}

void InterfaceOutput::write_index(const Frame& frame) const {
  std::string text = xdmf_head;
  for (std::size_t f = 0; f < frame.times.size(); ++f) {
    const std::string file = fmt::format("interface/{:04}.h5", f);
    text += fmt::format(
        "<Grid Name=\"bodies\" GridType=\"Collection\" CollectionType=\"Spatial\">"
        "<Time Value=\"{:.12g}\"/>\n",
        frame.times[f]);
    for (const Frame::Body& body : frame.bodies) {
      const std::size_t n_v = body.overpressure.size();
      const std::size_t n_t = body.triangles.size() / 3;
      const std::string vectors = fmt::format("{} 3", n_v);
      text += fmt::format(
          "<Grid Name=\"{}\" GridType=\"Uniform\">\n"
          "<Topology TopologyType=\"Triangle\" NumberOfElements=\"{}\">{}</Topology>\n"
          "<Geometry GeometryType=\"XYZ\">{}</Geometry>\n",
          body.name, n_t,
          data_item(fmt::format("{} 3", n_t), file, body.name + "/triangles",
                    "Int\" Precision=\"4"),
          data_item(vectors, file, body.name + "/position", "Float\" Precision=\"8"));
      text += attribute("overpressure", "Scalar", "Node",
                        data_item(std::to_string(n_v), file, body.name + "/overpressure",
                                  "Float\" Precision=\"8"));
      text += attribute("velocity", "Vector", "Node",
                        data_item(vectors, file, body.name + "/velocity", "Float\" Precision=\"8"));
      text += "</Grid>\n";
    }
    text += "</Grid>\n";
  }
  replace_file(directory_ / "interface.xmf", text + xdmf_tail);
}

}  // namespace ocublast::flow
