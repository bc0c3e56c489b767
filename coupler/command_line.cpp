#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>

#include "coupler/base/errors.hpp"
#include "coupler/base/log.hpp"
#include "coupler/base/version.hpp"
#include "coupler/commands.hpp"
#include "coupler/event_log.hpp"
#include "coupler/link/keys.hpp"
#include "coupler/link/payload.hpp"

namespace ocublast::coupler {
namespace {

struct Line {
  RunOptions run;
  std::filesystem::path traffic_a, traffic_b;
  std::string play;
  double tolerance = 0.0;
  std::string live;
  std::vector<std::string> solids;
  bool list_keys = false;
  bool effective_only = false;
};

void add_run_options(CLI::App& app, Line& line) {
  auto& run = line.run;
  app.add_option("case", run.source.case_file, "case file (case.toml)");
  app.add_option("--set", run.source.overrides, "dotted.key=value, may be repeated")
      ->expected(1)
      ->take_all();
  app.add_option("--mesh-dir", run.source.mesh_directory, "where the case's meshes lie");
  app.add_option("--out", run.out, "where results go; default results/NAME");
  app.add_option("--resume", run.resume, "run directory whose last checkpoint is continued");
  app.add_option("--flow", run.flow_command, "command of the flow side; default flow_solver");
  app.add_option("--solid", run.solid_commands,
                 "command of the solid side, of several NAME=COMMAND; default solid_solver")
      ->expected(1)
      ->take_all();
  app.add_option("--ranks-flow", run.ranks_flow, "processes of the flow side, under mpirun")
      ->check(CLI::Range(1, 4096));
  app.add_option("--ranks-solid", run.ranks_solid, "processes of each solid, under mpirun")
      ->check(CLI::Range(1, 4096));
  app.add_option("--threads-flow", run.threads_flow, "threads of the flow side, 0: all")
      ->check(CLI::Range(0, 1024));
  app.add_option("--threads-solid", run.threads_solid, "threads of the solid side, 0: all")
      ->check(CLI::Range(0, 1024));
  app.add_option("--endpoint", run.endpoint, "ipc:///PATH or tcp://ADDRESS:PORT");
  app.add_option("--keys", run.keys, "directory for the key files of a tcp endpoint");
  app.add_flag("--await", run.await, "wait for the solvers instead of starting them");
  app.add_flag("--quiet", run.quiet, "no progress lines");
}

int run_case(Line& line) {
  if (line.list_keys) {
    CaseReader listing = CaseReader::make_listing();
    static_cast<void>(read_settings(listing));
    std::printf("%s", listing.key_list().c_str());
    return 0;
  }
  if (line.run.source.case_file.empty())
    throw CaseError("command line: no case file; see coupler --help");
  CaseReader reader(line.run.source);
  const Settings settings = read_settings(reader);
  reader.finish();
  if (line.effective_only) {
    std::printf("%s", reader.effective().c_str());
    return 0;
  }
  for (const char* side : {"flow", "solid"})
    if (!reader.has(side))
      throw CaseError(fmt::format("{}: no [{}] section: nothing to couple; run {}_solver alone",
                                  line.run.source.case_file.string(), side,
                                  std::string(side) == "flow" ? "solid" : "flow"));
  if (line.run.out.empty()) line.run.out = std::filesystem::path("results") / settings.common.name;
  std::filesystem::create_directories(line.run.out);
  const auto log = make_logger("coupler", line.run.out / "log" / "coupler.log");
  return run_coupled(line.run, settings, log) ? 0 : 1;
}

}  // namespace

int run_command_line(int argc, char** argv) {
  link::keep_freed_memory();
  Line line;
  CLI::App app{
      "Couples a flow and a solid solver: starts both, hands out time windows, exchanges "
      "motion and load, records the traffic.",
      "coupler"};
  app.set_version_flag("--version", fmt::format("coupler {}", version_text));
  app.require_subcommand(0, 1);
  add_run_options(app, line);
  app.add_flag("--list-keys", line.list_keys, "every key with unit, range, default, end");
  app.add_flag("--effective", line.effective_only, "print the case with all defaults, end");

  auto* check = app.add_subcommand("check", "validate the whole case, print what would run");
  add_run_options(*check, line);
  auto* status = app.add_subcommand("status", "how far a run is, and whether it still lives");
  status->add_option("directory", line.run.out, "its results")->required();
  auto* keygen =
      app.add_subcommand("keygen", "make the keys of tcp runs: coupler.key, flow.key, solid.key");
  keygen
      ->add_option("directory", line.run.keys, "where they go; give each machine its own key alone")
      ->required();
  keygen->add_option("--solids", line.solids, "names of several solids");
  auto* dump = app.add_subcommand("dump", "print a recording");
  dump->add_option("traffic", line.traffic_a, "traffic.ocu")->required();
  auto* diff = app.add_subcommand("diff", "compare two recordings");
  diff->add_option("a", line.traffic_a, "traffic.ocu")->required();
  diff->add_option("b", line.traffic_b, "traffic.ocu")->required();
  diff->add_option("--tolerance", line.tolerance, "relative to the largest value of a field");
  auto* replay = app.add_subcommand("replay", "stand in for one side, check the other's answers");
  replay->add_option("traffic", line.traffic_a, "traffic.ocu")->required();
  replay->add_option("--as", line.play, "which side is played")
      ->required()
      ->check(CLI::IsMember({"flow", "solid"}));
  replay->add_option("--tolerance", line.tolerance,
                     "relative to the largest value of a field; 0: bytes");
  replay->add_option("--live", line.live,
                     "which of several solids is live when the flow is played; default the first");
  add_run_options(*replay, line);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& asked) {
    static_cast<void>(app.exit(asked));
    return 0;
  } catch (const CLI::ParseError& error) {
    throw CaseError(fmt::format("command line: {}; see coupler --help", error.what()));
  }
  if (check->parsed()) {
    check_case(line.run);
    return 0;
  }
  if (status->parsed()) {
    print_status(line.run.out);
    return 0;
  }
  if (keygen->parsed()) {
    std::vector<std::string> files{"flow"};
    if (line.solids.empty()) files.emplace_back("solid");
    files.insert(files.end(), line.solids.begin(), line.solids.end());
    link::write_key_set(line.run.keys, link::make_token(), files);
    std::printf(
        "%s: coupler.key and a key for the flow and each solid, mode 0600. Give --keys (or "
        "OCUBLAST_KEYS) this "
        "folder; on another machine a folder with the one key of its participant is enough.\n",
        line.run.keys.c_str());
    return 0;
  }
  if (dump->parsed()) {
    dump_traffic(line.traffic_a);
    return 0;
  }
  if (diff->parsed()) return diff_traffic(line.traffic_a, line.traffic_b, line.tolerance) ? 0 : 1;
  if (replay->parsed()) {
    replay_traffic(line.traffic_a, line.play == "flow" ? link::Role::flow : link::Role::solid,
                   line.live, line.run, line.tolerance);
    return 0;
  }
  return run_case(line);
}

}  // namespace ocublast::coupler
