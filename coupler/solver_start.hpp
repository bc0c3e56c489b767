#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "coupler/child.hpp"
#include "coupler/link/keys.hpp"
#include "coupler/session.hpp"

namespace ocublast::coupler {

/// How solvers of one run are started, or told where to connect: token, keys, command, environment.
class SolverStart {
 public:
  /// `encrypted`: tcp; then key files are written to options.keys, or OCUBLAST_KEYS, or OUT/keys.
  SolverStart(const RunOptions& options, const Roster& roster, bool encrypted,
              std::uint64_t case_hash);

  [[nodiscard]] const std::string& token() const { return token_; }
  [[nodiscard]] const std::optional<link::CouplerKeys>& coupler_keys() const {
    return coupler_keys_;
  }
  [[nodiscard]] Child::Start child(Party party, const std::string& endpoint,
                                   double silence_limit) const;
  /// Writes OUT/connection.env (mode 0600) for solvers that are started by somebody else, and says
  /// on standard output what the coupler waits for.
  void announce(const std::vector<Party>& awaited, const std::string& endpoint,
                double silence_limit) const;

 private:
  RunOptions options_;
  Roster roster_;
  std::uint64_t case_hash_;
  std::string token_;
  std::filesystem::path keys_;  ///< empty for ipc
  std::optional<link::CouplerKeys> coupler_keys_;
};

}  // namespace ocublast::coupler
