#pragma once

#include <cstdint>
#include <filesystem>

#include "solid_solver/io/field_output.hpp"
#include "solid_solver/io/history.hpp"
#include "solid_solver/step.hpp"

namespace ocublast::solid {

/// What a run carries besides its state.
struct RunProgress {
  std::uint64_t window = 0;
  double next_field = 0.0;       ///< s, when fields are due
  double next_history = 0.0;     ///< s
  double next_checkpoint = 0.0;  ///< s, runs alone
};

/// Everything a checkpoint holds.
struct RunParts {
  SolidRun& run;
  History& history;
  FieldOutput& fields;
  RunProgress& progress;
  std::uint64_t case_hash = 0;
};

/// Writes DIRECTORY/solid.h5 aside and renames it: there is a whole file or none.
void write_checkpoint(const std::filesystem::path& directory, const RunParts& parts);

/// Restores the same bits. Throws CaseError for a checkpoint of another case, mesh or version.
void read_checkpoint(const std::filesystem::path& directory, const RunParts& parts);

}  // namespace ocublast::solid
