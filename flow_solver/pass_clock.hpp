#pragma once

#include <omp.h>
#include <time.h>

#include <array>
#include <cstddef>

namespace ocublast::flow {

/// Parts of a step whose processor time can be taken.
/// `waiting` for other ranks is counted in the part where it happens as well.
enum class Pass : int {
  ghosts,
  sensors,
  stress,
  bulk,
  sweep_x,
  sweep_y,
  sweep_z,
  filter,
  other,
  waiting
};
inline constexpr std::size_t n_passes = 10;
inline constexpr std::array<const char*, n_passes> pass_names{
    "ghosts",  "sensors", "stress", "bulk",  "x sweep",
    "y sweep", "z sweep", "filter", "other", "waiting"};

/// Processor seconds of the first thread by pass. Off unless asked for: reading the clock is a call
/// into the kernel.
struct PassClock {
  bool on = false;
  std::array<double, n_passes> seconds{};

  [[nodiscard]] static double now() {
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
  }
};

/// Books the time since it was made, or since the last booking, under a pass.
class Lap {
 public:
  explicit Lap(PassClock& clock)
      : clock_(clock.on && omp_get_thread_num() == 0 ? &clock : nullptr) {
    if (clock_ != nullptr) last_ = PassClock::now();
  }
  void book(Pass pass) {
    if (clock_ == nullptr) return;
    const double t = PassClock::now();
    clock_->seconds[static_cast<std::size_t>(pass)] += t - last_;
    last_ = t;
  }

 private:
  PassClock* clock_;
  double last_ = 0.0;
};

}  // namespace ocublast::flow
