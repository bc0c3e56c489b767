#include "coupler/time_window.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "coupler/base/errors.hpp"

namespace ocublast::coupler {
namespace {

/// A quotient this little above a whole number is that number: the remaining time is a difference
/// of two rounded doubles.
constexpr double whole_number_slack = 1e-9;
/// More steps in one window than this mean that a stable step has collapsed.
constexpr double most_steps = 1e6;

double count_up(double quotient) {
  return std::max(1.0, std::ceil(quotient * (1.0 - whole_number_slack)));
}

double widest(const WindowChoice& choice, double stable_flow, double stable_solid) {
  switch (choice.rule) {
    case WindowRule::subcycle:
      return std::min(choice.max_flow_steps * stable_flow, choice.max_solid_steps * stable_solid);
    case WindowRule::lockstep:
      return std::min(stable_flow, stable_solid);
    case WindowRule::fixed:
      return choice.fixed_width;
  }
  return choice.fixed_width;
}

std::uint32_t steps_in(double width, double stable_step, const char* who, double t) {
  const double steps = count_up(width / stable_step);
  if (steps > most_steps)
    throw NumericsError(
        fmt::format("at t = {:.9g} s the stable step of the {} is {:.3g} s: {:.0f} "
                    "steps for one window of {:.3g} s",
                    t, who, stable_step, steps, width));
  return static_cast<std::uint32_t>(steps);
}

}  // namespace

TimeWindow next_window(const WindowChoice& choice, std::uint64_t finished, double t,
                       double stable_flow, double stable_solid) {
  const double remaining = choice.end_time - t;
  const double windows = count_up(remaining / widest(choice, stable_flow, stable_solid));
  TimeWindow window;
  window.number = finished + 1;
  window.t_begin = t;
  window.t_end = windows == 1.0 ? choice.end_time : t + remaining / windows;
  if (!(window.t_end > t))
    throw NumericsError(
        fmt::format("at t = {:.9g} s the stable steps are {:.3g} s (flow) and {:.3g} s "
                    "(solid): too short to advance the time",
                    t, stable_flow, stable_solid));
  if (choice.rule == WindowRule::lockstep) return window;
  window.steps_flow = steps_in(window.width(), stable_flow, "flow", t);
  window.steps_solid = steps_in(window.width(), stable_solid, "solid", t);
  return window;
}

}  // namespace ocublast::coupler
