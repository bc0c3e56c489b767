#pragma once

#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "coupler/party.hpp"

namespace ocublast::coupler {

/// How a process ended.
struct ProcessEnd {
  int exit_code = 0;  ///< as given to exit; -1 when a signal ended it
  int signal = 0;
  [[nodiscard]] std::string text() const;  ///< "exit code 2 (case)", "killed by signal 9 (Killed)"
};

/// A solver started by the coupler, in a process group of its own so that a Ctrl-C at the terminal
/// reaches the coupler alone. It gets SIGTERM when the coupler dies. Ended by the destructor. A
/// guarded one is the child of a guard (rank_guard.hpp), which then is the process meant here.
class Child {
 public:
  struct Start {
    Party party = Party::flow;
    std::string word;  ///< how messages call it
    std::vector<std::string> command;
    std::vector<std::pair<std::string, std::string>> environment;  ///< added to ours
    bool guarded = false;       ///< the command launches processes that may outlive it (mpirun)
    std::filesystem::path log;  ///< standard output and error, appended
  };
  /// Throws LinkError when the program cannot be started.
  explicit Child(const Start& start);
  ~Child();
  Child(Child&& other) noexcept;
  Child& operator=(Child&& other) noexcept;

  [[nodiscard]] Party party() const { return party_; }
  [[nodiscard]] int pidfd() const { return pidfd_; }  ///< readable once the process has ended
  [[nodiscard]] const std::filesystem::path& log() const { return log_; }
  /// How it ended; nothing while it runs.
  [[nodiscard]] std::optional<ProcessEnd> ended();
  /// The same, waiting up to `limit` [s].
  [[nodiscard]] std::optional<ProcessEnd> wait(double limit);
  /// For a process whose connection is closed, and that is about to end as a rule: waits a moment,
  /// longer for one that the system takes down already and for a launcher, which has its ranks to
  /// end.
  [[nodiscard]] std::optional<ProcessEnd> wait_after_close();
  /// Waits up to `patience` [s], then SIGTERM, half a second later SIGKILL, to the whole group; a
  /// guard does the same with all that descend from it.
  void end(double patience) noexcept;

 private:
  [[nodiscard]] bool being_taken_down() const;

  Party party_ = Party::flow;
  bool guarded_ = false;
  pid_t pid_ = -1;
  int pidfd_ = -1;
  std::filesystem::path log_;
  std::optional<ProcessEnd> end_;
};

/// Splits a command line at blanks; single and double quotes keep words together.
[[nodiscard]] std::vector<std::string> split_command(const std::string& command);

/// Last `lines` lines of a text file, for messages.
[[nodiscard]] std::string tail_of(const std::filesystem::path& file, int lines);

}  // namespace ocublast::coupler
