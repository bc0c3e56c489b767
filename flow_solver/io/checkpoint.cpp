#include "flow_solver/io/checkpoint.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string>

#include "coupler/base/errors.hpp"
#include "coupler/base/hdf5_file.hpp"
#include "flow_solver/ranks/gather.hpp"

namespace ocublast::flow::inline OCU_PRECISION {
namespace {

constexpr std::int64_t checkpoint_version = 3;

/// The fields of the state: primitives with the artificial pressure that the walls read, then the
/// conserved ones (rounding keeps one from being computed from the other bit for bit).
struct StateField {
  std::string name;
  int field;
  bool conserved;
};
std::vector<StateField> state_fields(const Flow& flow) {
  const int n = flow.primitives().artificial_pressure ? artificial_pressure_field + 1 : n_primitive;
  std::vector<StateField> fields;
  for (int f = 0; f < n; ++f) fields.push_back({fmt::format("state/primitive_{}", f), f, false});
  for (int f = 0; f < n_primitive; ++f)
    fields.push_back({fmt::format("state/conserved_{}", f), f, true});
  return fields;
}

std::vector<double> read_of_size(const Hdf5File& file, const std::string& name, std::size_t size,
                                 const std::filesystem::path& path) {
  auto values = file.read<double>(name);
  if (values.size() != size)
    throw CaseError(
        fmt::format("{}: {} holds {} numbers, this case needs {}; was the grid changed?",
                    path.string(), name, values.size(), size));
  return values;
}

}  // namespace

void write_checkpoint(const Ranks& ranks, const std::filesystem::path& directory, const Flow& flow,
                      const ImmersedBoundary* bodies, const Probes& probes, const RunClock& clock) {
  const auto path = directory / "flow.h5";
  auto aside = path;
  aside += ".part";
  const NodeBox own = flow.owned();
  // One field at a time: the root needs room for no more.
  const auto gather = [&](const StateField& f) {
    const auto view = f.conserved ? flow.conserved() : flow.primitives();
    return gather_nodes<double>(ranks, flow.grid(), own,
                                [&](int i, int j, int k) { return view(f.field, i, j, k); });
  };
  const auto marks = gather_nodes<std::uint8_t>(
      ranks, flow.grid(), own, [&](int i, int j, int k) { return flow.mark(i, j, k); });
  const auto history = bodies != nullptr ? bodies->whole_history() : std::vector<std::uint8_t>();
  if (!ranks.root()) {
    for (const StateField& f : state_fields(flow)) static_cast<void>(gather(f));
    ranks.wait_for_all();
    return;
  }
  auto file = Hdf5File::create(aside);
  file.write_attribute("format", std::string("ocublast-flow-checkpoint"));
  file.write_attribute("version", checkpoint_version);
  file.write_attribute("precision", std::string(precision_name));
  file.write_attribute("step", clock.step);
  file.write_attribute("window", clock.window);
  file.write("clock", std::vector<double>{clock.time, clock.next_output, clock.next_interface}, {3},
             "s");
  file.write("field_times", clock.field_times, {clock.field_times.size()}, "s");
  file.write("interface_times", clock.interface_times, {clock.interface_times.size()}, "s");
  file.write("surface_probes/times", clock.surface_times, {clock.surface_times.size()}, "s");
  file.write("surface_probes/overpressure", clock.surface_history, {clock.surface_history.size()},
             "Pa");
  file.write("bodies/motions", clock.bodies, {clock.bodies.size()}, "SI");
  file.write("sums", clock.sums, {clock.sums.size()}, "mixed");
  const auto& axis = flow.grid().axis;
  const std::vector<std::size_t> shape{static_cast<std::size_t>(axis[2].n),
                                       static_cast<std::size_t>(axis[1].n),
                                       static_cast<std::size_t>(axis[0].n)};
  for (const StateField& f : state_fields(flow)) file.write(f.name, gather(f), shape, "SI");
  file.write("state/marks", marks, shape, "steps");
  const auto box = flow.active_box();
  file.write("state/active_box", std::vector<std::int32_t>(box.begin(), box.end()), {box.size()},
             "1");
  if (bodies != nullptr)
    file.write("walls", history, {history.size()}, "bytes of this program version");
  if (bodies != nullptr)
    for (std::size_t b = 0; b < bodies->n_bodies(); ++b) {
      if (!bodies->body(b).moves) continue;
      const std::string group = "bodies/" + bodies->body(b).name;
      file.write(group + "/position", bodies->position(b), {bodies->position(b).size()}, "m");
      file.write(group + "/velocity", bodies->velocity(b), {bodies->velocity(b).size()}, "m/s");
      file.write(group + "/acceleration", bodies->acceleration(b), {bodies->acceleration(b).size()},
                 "m/s^2");
    }
  file.write("probes/times", probes.times(), {probes.times().size()}, "s");
  file.write("probes/overpressure", probes.history(), {probes.history().size()}, "Pa");
  file.close();
  std::filesystem::rename(aside, path);
  ranks.wait_for_all();  // who goes on knows that the file is there
}

RunClock read_checkpoint(const std::filesystem::path& directory, Flow& flow,
                         ImmersedBoundary* bodies, Probes& probes) try {
  const auto path = directory / "flow.h5";
  const auto file = Hdf5File::open(path);
  if (file.text_attribute("format") != "ocublast-flow-checkpoint" ||
      file.integer_attribute("version") != checkpoint_version)
    throw CaseError(
        fmt::format("{}: not a flow checkpoint of version {}", path.string(), checkpoint_version));
  if (const auto precision = file.text_attribute("precision"); precision != precision_name)
    throw CaseError(
        fmt::format("{}: written in {} precision, this run is in {}; resume it with "
                    "flow.numerics.precision = \"{}\", or start anew",
                    path.string(), precision, precision_name, precision));
  RunClock clock;
  clock.step = file.integer_attribute("step");
  clock.window = file.integer_attribute("window");
  const auto times = read_of_size(file, "clock", 3, path);
  clock.time = times[0];
  clock.next_output = times[1];
  clock.next_interface = times[2];
  clock.field_times = file.read<double>("field_times");
  clock.interface_times = file.read<double>("interface_times");
  clock.surface_times = file.read<double>("surface_probes/times");
  clock.surface_history = file.read<double>("surface_probes/overpressure");
  clock.bodies = file.read<double>("bodies/motions");
  clock.sums = file.read<double>("sums");
  // Every rank reads the file and takes its own nodes.
  const NodeBox own = flow.owned();
  const Grid& grid = flow.grid();
  for (const StateField& f : state_fields(flow)) {
    const auto values = read_of_size(file, f.name, grid.n_cells(), path);
    const auto view = f.conserved ? flow.conserved() : flow.primitives();
    for_nodes(own, [&](int i, int j, int k) {
      view(f.field, i, j, k) = static_cast<Real>(values[place_of(grid, i, j, k)]);
    });
  }
  const auto marks = file.read<std::uint8_t>("state/marks");
  for_nodes(
      own, [&](int i, int j, int k) { flow.set_mark(i, j, k, marks.at(place_of(grid, i, j, k))); });
  const auto box = file.read<std::int32_t>("state/active_box");
  std::array<int, 6> active{};
  for (std::size_t b = 0; b < active.size(); ++b) active[b] = box.at(b);
  flow.restored_nodes(active);
  if (bodies != nullptr)
    for (std::size_t b = 0; b < bodies->n_bodies(); ++b) {
      if (!bodies->body(b).moves) continue;
      const std::string group = "bodies/" + bodies->body(b).name;
      const std::size_t size = bodies->position(b).size();
      const auto x = read_of_size(file, group + "/position", size, path);
      const auto v = read_of_size(file, group + "/velocity", size, path);
      const auto a = read_of_size(file, group + "/acceleration", size, path);
      bodies->restore_wall(b, x, v, a);
    }
  if (bodies != nullptr) clock.walls = file.read<std::uint8_t>("walls");
  probes.restore(file.read<double>("probes/times"), file.read<double>("probes/overpressure"));
  return clock;
} catch (const LinkError& error) {
  throw CaseError(error.what());
}

}  // namespace ocublast::flow
