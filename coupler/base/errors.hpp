#pragma once

#include <stdexcept>
#include <string>

namespace ocublast {

/// Exit codes of all three programs.
enum class ExitCode : int { done = 0, other = 1, bad_case = 2, link = 3, numerics = 4 };

/// The user's input is at fault. The text holds every fault found, one per line.
struct CaseError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A peer, socket or file is at fault. Names the peer, what was awaited and how long.
struct LinkError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The computation failed: not-a-number, negative density, inverted element. Names place and time.
struct NumericsError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Exit code that belongs to the exception in flight; prints its text to standard error as one
/// message that starts with the program's name. Called from a catch-all in `main` only.
[[nodiscard]] int report_current_exception(const std::string& program) noexcept;

}  // namespace ocublast

#ifdef OCU_ASSERTIONS
#include <cstdio>
#include <cstdlib>
/// Precondition of our own code; never for input, never with side effects.
#define OCU_ASSERT(condition)                                                                \
  do {                                                                                       \
    if (!(condition)) {                                                                      \
      std::fprintf(stderr, "%s:%d: assertion failed: %s\n", __FILE__, __LINE__, #condition); \
      std::abort();                                                                          \
    }                                                                                        \
  } while (false)
#else
#define OCU_ASSERT(condition) static_cast<void>(0)
#endif
