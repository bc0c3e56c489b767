#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "coupler/base/case_reader.hpp"

namespace ocublast {

/// What the command line of a solver says (the same for both; `coupler` adds sub-commands).
struct CommandLine {
  CaseReader::Source source;     ///< case file, --set, --mesh-dir
  std::filesystem::path out;     ///< --out: where results go
  std::filesystem::path resume;  ///< --resume: run directory with a checkpoint; empty: fresh start
  int threads = 0;               ///< --threads; 0: all the machine grants
  bool check_only = false;       ///< --check: validate the case, print what would run, end
  bool effective_only = false;   ///< --effective: print the sections read, defaults filled in, end
  bool list_keys = false;        ///< --list-keys
  bool quiet = false;            ///< --quiet: no progress lines
};

/// Parses argv. Prints help or version and returns nullopt when that was asked for.
/// Throws CaseError for a wrong option.
[[nodiscard]] std::optional<CommandLine> parse_command_line(int argc, char** argv,
                                                            const std::string& program,
                                                            const std::string& about);

}  // namespace ocublast
