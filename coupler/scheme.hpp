#pragma once

#include <memory>

#include "coupler/coupling_state.hpp"
#include "coupler/exchange.hpp"
#include "coupler/predictor.hpp"
#include "coupler/settings.hpp"
#include "coupler/time_window.hpp"

namespace ocublast::coupler {

/// What both sides reported of a window.
struct WindowReports {
  link::Header flow;
  link::Header solid;
  std::vector<double>
      flow_balance;  ///< several interfaces: [n, 4] J, N s; empty where not reported
  std::vector<link::Header> solids;  ///< several: of each
  int iterations = 1;
  double residual = 0.0;  ///< of the motion at the last iteration, relative (implicit)
};

/// How flow and solid advance together over one window.
class Scheme {
 public:
  virtual ~Scheme() = default;
  /// The window that the solid does next.
  [[nodiscard]] virtual TimeWindow next(const CouplingState& state) const = 0;
  /// Advances `state` over that window. `order` of the predictor may be lower than the settings'.
  [[nodiscard]] virtual WindowReports advance(CouplingState& state, const TimeWindow& window,
                                              int order) = 0;
};

[[nodiscard]] std::unique_ptr<Scheme> make_scheme(Exchange& exchange, const Settings& settings);

/// How windows are chosen by these settings.
[[nodiscard]] WindowChoice window_choice(const Settings& settings);

// What the schemes have in common.

/// Order of the predictor in a window of this width [s]: lower where theta = Z w / M is above its
/// limit.
[[nodiscard]] int allowed_order(const Settings& settings, const CouplingState& state, double width);
/// Predicts the wall at `t_end` [s] from the state into `values`: position and velocity [6 n]. See
/// predict_wall for what it returns.
bool predict_motion(const CouplingState& state, double t_end, int order, std::span<double> values,
                    const PathBegin& path = {});
/// Sends the predicted wall to the flow, or that it rests.
void post_predicted(Exchange& exchange, CouplingState& state, const Exchange::Ask& ask, int order);
/// The same for explicit schemes, which go on from where they sent the wall: in windows shorter
/// than the flow's own step it keeps to its path (PathBegin), and what is missing is made up for
/// within about a flow step. `made`: predict_on_path has put it into the exchange's motion_room
/// already.
void post_on_path(Exchange& exchange, CouplingState& state, const Settings& settings,
                  const Exchange::Ask& ask, int order, bool made = false);
/// The wall that post_on_path sends for a window; see predict_wall for what it returns.
bool predict_on_path(const CouplingState& state, const Settings& settings, const TimeWindow& window,
                     int order, std::span<double> motion);
/// Sends the flow's load to the solid: as it came, scaled by the start-up ramp, or that it is zero.
void post_answered_load(Exchange& exchange, const Settings& settings, const CouplingState& state,
                        const Exchange::Ask& ask, const Answer& flow);
/// Factor of the start-up ramp at time t [s].
[[nodiscard]] double load_factor(const Settings& settings, double t);
/// The solid has finished a window of this width [s].
void accept_motion(CouplingState& state, const Answer& solid, double width);
/// Both have finished a window: time, stable steps, balance.
void accept_window(CouplingState& state, const TimeWindow& window, const link::Header& flow,
                   const link::Header& solid);

}  // namespace ocublast::coupler
