#pragma once

#include <cstdint>

#include "coupler/settings.hpp"

namespace ocublast::coupler {

/// One coupling window. Both participants end it at exactly `t_end`.
struct TimeWindow {
  std::uint64_t number = 0;  ///< 1, 2, ...
  double t_begin = 0.0;      ///< s
  double t_end = 0.0;        ///< s
  std::uint32_t steps_flow = 1;
  std::uint32_t steps_solid = 1;

  [[nodiscard]] double width() const { return t_end - t_begin; }
  bool operator==(const TimeWindow&) const = default;
};

/// How the next window is chosen.
struct WindowChoice {
  WindowRule rule = WindowRule::subcycle;
  double fixed_width = 0.0;  ///< s
  int max_flow_steps = 1;
  int max_solid_steps = 10;
  double end_time = 0.0;  ///< s
};

/// The window after window `finished`, which ended at `t` [s], from both stable steps [s]. The time
/// that remains is divided evenly, so that the last window ends exactly at `end_time` and is no
/// shorter than the others. Throws NumericsError when a window would be too short to advance `t`.
[[nodiscard]] TimeWindow next_window(const WindowChoice& choice, std::uint64_t finished, double t,
                                     double stable_flow, double stable_solid);

}  // namespace ocublast::coupler
