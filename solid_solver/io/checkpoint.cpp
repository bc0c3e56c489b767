#include "solid_solver/io/checkpoint.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>

#include "coupler/base/errors.hpp"
#include "coupler/base/hdf5_file.hpp"

namespace ocublast::solid {
namespace {

constexpr std::int64_t checkpoint_version = 2;
constexpr const char* checkpoint_format = "ocublast-solid-checkpoint";

/// The arrays of one rank's state.
struct RankArrays {
  struct Entry {
    std::string name;
    std::string units;
    std::size_t size = 0;
  };
  std::vector<Entry> entries;
  std::vector<double> values;  ///< one after another; empty when only the entries are asked for
};

std::string describe_entries(const std::vector<SolidRun::NamedArray>& arrays) {
  std::string text;
  for (const auto& a : arrays)
    text += fmt::format("{}\t{}\t{}\n", a.name, a.units, a.values.size());
  return text;
}

std::vector<RankArrays::Entry> parse_entries(std::string_view text) {
  std::vector<RankArrays::Entry> entries;
  std::istringstream lines{std::string(text)};
  for (std::string line; std::getline(lines, line);) {
    const auto first = line.find('\t');
    const auto second = line.find('\t', first + 1);
    entries.push_back({line.substr(0, first), line.substr(first + 1, second - first - 1),
                       std::stoul(line.substr(second + 1))});
  }
  return entries;
}

/// On the root what every rank's state is made of.
std::vector<RankArrays> gather_entries(const Team& team,
                                       const std::vector<SolidRun::NamedArray>& arrays) {
  const auto text = describe_entries(arrays);
  if (team.alone()) return {{.entries = parse_entries(text), .values = {}}};
  std::vector<RankArrays> all;
  for (const auto& t : team.part()->ranks->gather(std::span<const char>(text)))
    all.push_back({.entries = parse_entries({t.data(), t.size()}), .values = {}});
  return all;
}

/// On the root the values too.
std::vector<RankArrays> gather_arrays(const Team& team,
                                      const std::vector<SolidRun::NamedArray>& arrays) {
  auto all = gather_entries(team, arrays);
  std::vector<double> mine;
  for (const auto& a : arrays) mine.insert(mine.end(), a.values.begin(), a.values.end());
  if (team.alone()) {
    all[0].values = std::move(mine);
    return all;
  }
  auto values = team.part()->ranks->gather(std::span<const double>(mine));
  for (std::size_t r = 0; r < all.size(); ++r) all[r].values = std::move(values[r]);
  return all;
}

void scatter_arrays(const Team& team, const std::vector<RankArrays>& all,
                    std::vector<SolidRun::NamedArray> arrays) {
  std::size_t size = 0;
  for (const auto& a : arrays) size += a.values.size();
  std::vector<double> mine(size);
  if (team.alone()) {
    mine = all[0].values;
  } else {
    std::vector<std::vector<double>> parts;
    for (const auto& rank : all) parts.push_back(rank.values);
    team.part()->ranks->scatter(parts, std::span<double>(mine));
  }
  auto from = mine.begin();
  for (auto& a : arrays) {
    std::copy(from, from + static_cast<long>(a.values.size()), a.values.begin());
    from += static_cast<long>(a.values.size());
  }
}

std::string group_of(std::size_t rank) {
  return rank == 0 ? "run" : fmt::format("rank{}", rank);
}

/// Of the cells of each rank, in their order (FNV-1a); another cut of the mesh gives another.
std::vector<std::int64_t> gather_part_marks(const Team& team) {
  if (team.alone()) return {0};
  std::uint64_t hash = 0xcbf29ce484222325u;
  for (const auto c : team.part()->cell)
    hash = (hash ^ static_cast<std::uint64_t>(c)) * 0x100000001b3u;
  const auto mark = static_cast<std::int64_t>(hash);
  std::vector<std::int64_t> marks;
  for (const auto& m : team.part()->ranks->gather(std::span<const std::int64_t>(&mark, 1)))
    marks.insert(marks.end(), m.begin(), m.end());
  return marks;
}

void write_array(Hdf5File& file, const std::string& name, std::span<const double> values,
                 const std::string& units) {
  file.write(name, values, {values.size()}, units);
}

void write_file(const std::filesystem::path& path, const RunParts& parts,
                const std::vector<RankArrays>& all, const std::vector<std::int64_t>& marks) {
  auto file = Hdf5File::create(path);
  file.write_attribute("format", std::string(checkpoint_format));
  file.write_attribute("version", checkpoint_version);
  file.write_attribute("case_hash", static_cast<std::int64_t>(parts.case_hash));
  file.write_attribute("window", static_cast<std::int64_t>(parts.progress.window));
  file.write("part_marks", marks, {marks.size()}, "1");
  for (std::size_t r = 0; r < all.size(); ++r) {
    std::size_t at = 0;
    for (const auto& entry : all[r].entries) {
      write_array(file, group_of(r) + "/" + entry.name,
                  std::span<const double>(all[r].values).subspan(at, entry.size), entry.units);
      at += entry.size;
    }
  }
  write_array(file, "history/globals", parts.history.globals().values(), "1");
  write_array(file, "history/probes", parts.history.probes().values(), "1");
  write_array(file, "fields/times", parts.fields.times(), "s");
  const std::vector<double> due{parts.progress.next_field, parts.progress.next_history,
                                parts.progress.next_checkpoint};
  write_array(file, "due", due, "s");
  file.close();
}

/// What every rank takes from the file alike.
struct Common {
  std::vector<double> globals;
  std::vector<double> probes;
  std::vector<double> times;
  std::vector<double> due;  ///< with the window behind it
};

/// Fills the values of all ranks.
Common read_file(const std::filesystem::path& path, const RunParts& parts,
                 std::vector<RankArrays>& all, const std::vector<std::int64_t>& marks) {
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
  const auto written = file.read<std::int64_t>("part_marks");
  if (written.size() != marks.size())
    refuse(fmt::format("written by {} ranks of the solid, resumed with {}", written.size(),
                       marks.size()));
  if (written != marks) refuse("the mesh was cut among the ranks in another way");
  for (std::size_t r = 0; r < all.size(); ++r)
    for (const auto& entry : all[r].entries) {
      const auto values = file.read<double>(group_of(r) + "/" + entry.name);
      if (values.size() != entry.size)
        refuse(fmt::format("{} has {} values, the mesh needs {}", entry.name, values.size(),
                           entry.size));
      all[r].values.insert(all[r].values.end(), values.begin(), values.end());
    }
  Common common{.globals = file.read<double>("history/globals"),
                .probes = file.read<double>("history/probes"),
                .times = file.read<double>("fields/times"),
                .due = file.read<double>("due")};
  common.due.push_back(static_cast<double>(file.integer_attribute("window")));
  return common;
}

}  // namespace

void write_checkpoint(const std::filesystem::path& directory, const RunParts& parts) {
  const auto& team = parts.run.team();
  const auto all = gather_arrays(team, parts.run.checkpoint_arrays());
  const auto marks = gather_part_marks(team);
  team.together([&] {
    if (!team.root()) return;
    const auto aside = directory / "solid.h5.part";
    write_file(aside, parts, all, marks);
    std::filesystem::rename(aside, directory / "solid.h5");
  });
}

void read_checkpoint(const std::filesystem::path& directory, const RunParts& parts) {
  const auto& team = parts.run.team();
  const auto arrays = parts.run.checkpoint_arrays();
  auto all = gather_entries(team, arrays);
  const auto marks = gather_part_marks(team);
  Common common;
  team.together([&] {
    if (team.root()) common = read_file(directory / "solid.h5", parts, all, marks);
  });
  scatter_arrays(team, all, arrays);
  for (auto* list : {&common.globals, &common.probes, &common.times, &common.due})
    team.broadcast(*list);
  parts.run.restored();
  parts.history.globals().restore(std::move(common.globals));
  parts.history.probes().restore(std::move(common.probes));
  parts.fields.restore(std::move(common.times));
  parts.progress = {.window = static_cast<std::uint64_t>(common.due.at(3)),
                    .next_field = common.due.at(0),
                    .next_history = common.due.at(1),
                    .next_checkpoint = common.due.at(2)};
}

}  // namespace ocublast::solid
