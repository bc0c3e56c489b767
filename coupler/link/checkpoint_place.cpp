#include "coupler/link/checkpoint_place.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cstdlib>
#include <string>

#include "coupler/base/errors.hpp"

namespace ocublast::link {
namespace {

/// Window number that a checkpoint directory's name stands for.
std::optional<std::uint64_t> window_of(const std::filesystem::path& directory) {
  const std::string name = directory.filename().string();
  std::uint64_t window = 0;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), window);
  if (error != std::errc() || end != name.data() + name.size() || name.size() < 8) return {};
  return window;
}

}  // namespace

std::filesystem::path checkpoint_directory(const std::filesystem::path& run, std::uint64_t window) {
  return run / "checkpoint" / fmt::format("{:08}", window);
}

std::optional<CheckpointPlace> find_checkpoint(const std::filesystem::path& run) {
  std::error_code ignored;
  if (!std::filesystem::is_directory(run, ignored)) return {};
  const auto canonical = std::filesystem::canonical(run, ignored);
  if (const auto window = window_of(canonical);
      window && canonical.parent_path().filename() == "checkpoint")
    return CheckpointPlace{run, *window};
  std::optional<CheckpointPlace> last;
  for (const auto& entry : std::filesystem::directory_iterator(run / "checkpoint", ignored)) {
    const auto window = window_of(entry.path());
    if (!window || !entry.is_directory()) continue;
    if (!last || *window > last->window) last = CheckpointPlace{entry.path(), *window};
  }
  return last;
}

CheckpointPlace require_checkpoint(const std::filesystem::path& run) {
  auto place = find_checkpoint(run);
  if (!place)
    throw CaseError(
        fmt::format("--resume {}: no complete checkpoint there; expected a directory "
                    "{}/NNNNNNNN",
                    run.string(), (run / "checkpoint").string()));
  // One of several solids writes into a directory of its own.
  if (const char* name = std::getenv("OCUBLAST_NAME"); name != nullptr) place->directory /= name;
  return *place;
}

}  // namespace ocublast::link
