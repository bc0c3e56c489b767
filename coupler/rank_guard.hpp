#pragma once

#include <sys/types.h>

namespace ocublast::coupler {

/// What a new process needs to become a solver; all memory belongs to the process it was forked
/// from.
struct Launch {
  char* const* argv;
  char* const* envp;
  int log_fd;     ///< becomes standard output and error
  int report_fd;  ///< gets errno where the program cannot be executed; closed when it can
  pid_t parent;   ///< whose death ends the new process
};

/// Makes the calling process, just forked, the solver, in a process group of its own. Only
/// async-signal-safe calls, here and in `stand_guard`.
[[noreturn]] void become(const Launch& launch) noexcept;

/// Makes the calling process, just forked, the guard of a launcher such as mpirun, which it starts.
/// A launcher's ranks are in groups and sessions of their own: a signal to the launcher's group
/// does not reach them, and a launcher that hangs, or is killed, leaves them behind. Whatever
/// descends from the guard and loses its parent becomes the guard's own child
/// (PR_SET_CHILD_SUBREAPER), so it can end them all: when the launcher ends, when the coupler dies,
/// and when told to by SIGTERM. Then it ends as the launcher did, by the same exit code or signal.
[[noreturn]] void stand_guard(const Launch& launch) noexcept;

}  // namespace ocublast::coupler
