#include "solid_solver/io/checkpoint.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "coupler/base/errors.hpp"
#include "coupler/base/hdf5_file.hpp"

namespace ocublast::solid {
namespace {

constexpr std::int64_t checkpoint_version = 1;
constexpr const char* checkpoint_format = "ocublast-solid-checkpoint";

void write_array(Hdf5File& file, const std::string& name, std::span<const double> values,
                 const char* units) {
  file.write(name, values, {values.size()}, units);
}

}  // namespace

void write_checkpoint(const std::filesystem::path& directory, const RunParts& parts) {
  const auto aside = directory / "solid.h5.part";
  auto file = Hdf5File::create(aside);
  file.write_attribute("format", std::string(checkpoint_format));
  file.write_attribute("version", checkpoint_version);
  file.write_attribute("case_hash", static_cast<std::int64_t>(parts.case_hash));
  file.write_attribute("window", static_cast<std::int64_t>(parts.progress.window));
  for (const auto& array : parts.run.checkpoint_arrays())
    write_array(file, "run/" + array.name, array.values, array.units);
  write_array(file, "history/globals", parts.history.globals().values(), "1");
  write_array(file, "history/probes", parts.history.probes().values(), "1");
  write_array(file, "fields/times", parts.fields.times(), "s");
  const std::vector<double> due{parts.progress.next_field, parts.progress.next_history,
                                parts.progress.next_checkpoint};
  write_array(file, "due", due, "s");
  file.close();
  std::filesystem::rename(aside, directory / "solid.h5");
}

void read_checkpoint(const std::filesystem::path& directory, const RunParts& parts) {
  const auto path = directory / "solid.h5";
  const auto file = Hdf5File::open(path);
  const auto refuse = [&](const std::string& why) {
    throw CaseError(fmt::format("--resume: {}: {}; resume with the case and mesh that wrote it",
                                path.string(), why));
  };
  if (file.text_attribute("format") != checkpoint_format ||
      file.integer_attribute("version") != checkpoint_version)
    refuse("not a checkpoint of this version");
  if (file.integer_attribute("case_hash") != static_cast<std::int64_t>(parts.case_hash))
    refuse("written by another case");
  for (auto& array : parts.run.checkpoint_arrays()) {
    const auto values = file.read<double>("run/" + array.name);
    if (values.size() != array.values.size())
      refuse(fmt::format("{} has {} values, the mesh needs {}", array.name, values.size(),
                         array.values.size()));
    std::copy(values.begin(), values.end(), array.values.begin());
  }
  parts.run.restored();
  parts.history.globals().restore(file.read<double>("history/globals"));
  parts.history.probes().restore(file.read<double>("history/probes"));
  parts.fields.restore(file.read<double>("fields/times"));
  const auto due = file.read<double>("due");
  parts.progress = {.window = static_cast<std::uint64_t>(file.integer_attribute("window")),
                    .next_field = due.at(0),
                    .next_history = due.at(1),
                    .next_checkpoint = due.at(2)};
}

}  // namespace ocublast::solid
