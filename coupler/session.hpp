#pragma once

#include <spdlog/logger.h>

#include <filesystem>
#include <memory>
#include <string>

#include "coupler/base/case_reader.hpp"
#include "coupler/settings.hpp"

namespace ocublast::coupler {

/// What the command line of a coupled run says.
struct RunOptions {
  CaseReader::Source source;
  std::filesystem::path out;
  std::filesystem::path resume;
  std::string flow_command;  ///< empty: flow_solver beside the coupler
  /// Of the solids, NAME=COMMAND for one of several; empty: solid_solver beside the coupler.
  std::vector<std::string> solid_commands;
  int ranks_flow = 1;  ///< processes under mpirun
  int ranks_solid = 1;
  int threads_flow = 0;  ///< 0: all
  int threads_solid = 0;
  std::string endpoint;        ///< empty: that of the case
  std::filesystem::path keys;  ///< where key files go (tcp); empty: OUT/keys
  bool await = false;          ///< wait for the solvers instead of starting them
  bool quiet = false;
};

/// Command line of a solver as the coupler starts it, without --check and the like.
[[nodiscard]] std::vector<std::string> solver_command(Party party, const Roster& roster,
                                                      const RunOptions& options);

/// Runs a coupled case from start to end and writes its results to options.out. Throws CaseError,
/// LinkError or NumericsError (the kind of fault of whoever failed) after all participants ended.
/// Returns false when it was stopped by a signal after a checkpoint.
[[nodiscard]] bool run_coupled(const RunOptions& options, const Settings& settings,
                               const std::shared_ptr<spdlog::logger>& log);

}  // namespace ocublast::coupler
