#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

namespace ocublast::link {

/// One complete checkpoint of a coupled run: RUN/checkpoint/WINDOW (eight digits) with the files
/// flow.*, solid.* and coupler.*; of several solids each has a directory of its name in it, which
/// it finds by the variable OCUBLAST_NAME. All sides write into a directory whose name ends in
/// ".part"; the coupler renames it when everybody has finished, so a directory without that ending
/// is complete.
struct CheckpointPlace {
  std::filesystem::path directory;
  std::uint64_t window = 0;
};

/// Where the checkpoint of a window lies in a run directory.
[[nodiscard]] std::filesystem::path checkpoint_directory(const std::filesystem::path& run,
                                                         std::uint64_t window);

/// Last complete checkpoint of a run directory (what --resume names); a complete checkpoint
/// directory itself is accepted too. Nothing where there is none.
[[nodiscard]] std::optional<CheckpointPlace> find_checkpoint(const std::filesystem::path& run);

/// As above, but throws CaseError that says what was looked for.
[[nodiscard]] CheckpointPlace require_checkpoint(const std::filesystem::path& run);

}  // namespace ocublast::link
