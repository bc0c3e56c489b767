#include "flow_solver/io/checkpoint.hpp"

#include <algorithm>
#include <string>

#include <fmt/format.h>

#include "coupler/base/errors.hpp"
#include "coupler/base/hdf5_file.hpp"

namespace ocublast::flow {
namespace {

constexpr std::int64_t checkpoint_version = 1;

std::vector<double> read_of_size(const Hdf5File& file, const std::string& name, std::size_t size,
                                 const std::filesystem::path& path) {
  auto values = file.read<double>(name);
  if (values.size() != size)
    throw CaseError(fmt::format("{}: {} holds {} numbers, this case needs {}; was the grid changed?",
                                path.string(), name, values.size(), size));
  return values;
}

}  // namespace

void write_checkpoint(const std::filesystem::path& directory, Flow& flow,
                      const ImmersedBoundary* bodies, const Probes& probes, const RunClock& clock) {
  const auto path = directory / "flow.h5";
  auto aside = path;
  aside += ".part";
  auto file = Hdf5File::create(aside);
  file.write_attribute("format", std::string("ocublast-flow-checkpoint"));
  file.write_attribute("version", checkpoint_version);
  file.write_attribute("step", clock.step);
  file.write_attribute("window", clock.window);
  file.write("clock", std::vector<double>{clock.time, clock.next_output, clock.next_interface}, {3}, "s");
  file.write("field_times", clock.field_times, {clock.field_times.size()}, "s");
  file.write("interface_times", clock.interface_times, {clock.interface_times.size()}, "s");
  file.write("surface_probes/times", clock.surface_times, {clock.surface_times.size()}, "s");
  file.write("surface_probes/overpressure", clock.surface_history, {clock.surface_history.size()}, "Pa");
  file.write("bodies/motions", clock.bodies, {clock.bodies.size()}, "SI");
  file.write("sums", clock.sums, {clock.sums.size()}, "mixed");
  for (const auto& part : flow.checkpoint())
    file.write("state/" + std::string(part.name), std::span<const double>(part.values),
               {part.values.size()}, "SI");
  if (bodies != nullptr) {
    const auto history = bodies->history();
    file.write("walls", history, {history.size()}, "bytes of this program version");
  }
  if (bodies != nullptr)
    for (std::size_t b = 0; b < bodies->n_bodies(); ++b) {
      if (!bodies->body(b).moves) continue;
      const std::string group = "bodies/" + bodies->body(b).name;
      file.write(group + "/position", bodies->position(b), {bodies->position(b).size()}, "m");
      file.write(group + "/velocity", bodies->velocity(b), {bodies->velocity(b).size()}, "m/s");
      file.write(group + "/acceleration", bodies->acceleration(b),
                 {bodies->acceleration(b).size()}, "m/s^2");
    }
  file.write("probes/times", probes.times(), {probes.times().size()}, "s");
  file.write("probes/overpressure", probes.history(), {probes.history().size()}, "Pa");
  file.close();
  std::filesystem::rename(aside, path);
}

RunClock read_checkpoint(const std::filesystem::path& directory, Flow& flow,
                         ImmersedBoundary* bodies, Probes& probes) try {
  const auto path = directory / "flow.h5";
  const auto file = Hdf5File::open(path);
  if (file.text_attribute("format") != "ocublast-flow-checkpoint" ||
      file.integer_attribute("version") != checkpoint_version)
    throw CaseError(fmt::format("{}: not a flow checkpoint of version {}", path.string(),
                                checkpoint_version));
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
  for (const auto& part : flow.checkpoint()) {
    const auto values = read_of_size(file, "state/" + std::string(part.name), part.values.size(), path);
    std::copy(values.begin(), values.end(), part.values.begin());
  }
  flow.restored();
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
