#pragma once

#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <string>

namespace ocublast::test {

/// What a command printed (both streams) and its exit code.
struct Outcome {
  int code = -1;
  std::string output;
};

inline Outcome run_command(const std::string& command) {
  Outcome outcome;
  FILE* pipe = popen((command + " 2>&1").c_str(), "r");
  if (pipe == nullptr) return outcome;
  std::array<char, 4096> part{};
  while (std::fgets(part.data(), static_cast<int>(part.size()), pipe) != nullptr)
    outcome.output += part.data();
  const int status = pclose(pipe);
  outcome.code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return outcome;
}

/// What Open MPI needs of the environment: it refuses to start as root and with more ranks than
/// processors, and binds each rank to one of them, unless told otherwise. Ranks that wait give way,
/// so that four of them run on two processors.
inline const std::string mpi_environment =
    "OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 "
    "OMPI_MCA_rmaps_base_oversubscribe=1 OMPI_MCA_hwloc_base_binding_policy=none "
    "OMPI_MCA_mpi_yield_when_idle=1 OMPI_MCA_btl=self,vader ";

inline Outcome run_ranks(int n, const std::string& command) {
  return run_command(mpi_environment + "mpirun -n " + std::to_string(n) + " " + command);
}

}  // namespace ocublast::test
