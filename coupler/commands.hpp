#pragma once

#include <filesystem>

#include "coupler/link/participant.hpp"
#include "coupler/session.hpp"

namespace ocublast::coupler {

/// Parses the command line and does what it says; returns the exit code. Throws like its commands.
[[nodiscard]] int run_command_line(int argc, char** argv);

/// `coupler check`: the coupler's own sections and, through --check, those of the solvers; prints
/// what would run. Throws CaseError with all faults together.
void check_case(const RunOptions& options);

/// `coupler dump`: one line per message. Throws LinkError where the recording is damaged, after
/// printing what could be read.
void dump_traffic(const std::filesystem::path& file);

/// `coupler diff`: compares two recordings message by message; prints the first difference with
/// window, field, vertex and both values. Wall-clock values are ignored. True when they agree.
[[nodiscard]] bool diff_traffic(const std::filesystem::path& a, const std::filesystem::path& b,
                                double tolerance);

/// `coupler replay`: plays the recorded orders of a run to the participant that is not `played`
/// (of several solids `live`; the first for an empty name) and compares its answers byte for byte,
/// or within `tolerance` relative to the largest value of the field. Throws LinkError at the first
/// difference.
void replay_traffic(const std::filesystem::path& file, link::Role played, const std::string& live,
                    const RunOptions& options, double tolerance);

}  // namespace ocublast::coupler
