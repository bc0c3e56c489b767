#include "coupler/base/command_line.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>

#include "coupler/base/errors.hpp"
#include "coupler/base/version.hpp"

namespace ocublast {

std::optional<CommandLine> parse_command_line(int argc, char** argv, const std::string& program,
                                              const std::string& about) {
  CommandLine line;
  CLI::App app{about, program};
  app.set_version_flag("--version", fmt::format("{} {}", program, version_text));
  app.add_option("case", line.source.case_file, "case file (case.toml)");
  app.add_option("--set", line.source.overrides, "dotted.key=value, may be repeated")
      ->expected(1)
      ->take_all();
  app.add_option("--mesh-dir", line.source.mesh_directory, "where the case's meshes lie");
  app.add_option("--name", line.source.solid, "which of several [[solid]] tables this is");
  app.add_option("--out", line.out, "where results go");
  app.add_option("--resume", line.resume, "run directory whose last checkpoint is continued");
  app.add_option("--threads", line.threads, "threads, 0: all")->check(CLI::Range(0, 1024));
  app.add_flag("--check", line.check_only, "validate the case, print what would run, end");
  app.add_flag("--effective", line.effective_only, "print the case with all defaults, end");
  app.add_flag("--list-keys", line.list_keys, "every key with unit, range, default, end");
  app.add_flag("--quiet", line.quiet, "no progress lines");
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& asked) {
    static_cast<void>(app.exit(asked));
    return std::nullopt;
  } catch (const CLI::ParseError& error) {
    throw CaseError(fmt::format("command line: {}; see {} --help", error.what(), program));
  }
  if (line.source.case_file.empty() && !line.list_keys)
    throw CaseError(fmt::format("command line: no case file; see {} --help", program));
  return line;
}

}  // namespace ocublast
