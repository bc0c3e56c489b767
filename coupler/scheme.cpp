#include "coupler/scheme.hpp"

#include <algorithm>
#include <optional>
#include <vector>

#include "coupler/base/errors.hpp"
#include "coupler/scheme_implicit.hpp"
#include "coupler/scheme_parallel.hpp"

namespace ocublast::coupler {

WindowChoice window_choice(const Settings& settings) {
  return {.rule = settings.window,
          .fixed_width = settings.window_width,
          .max_flow_steps = settings.max_flow_steps,
          .max_solid_steps = settings.max_solid_steps,
          .end_time = settings.common.end_time};
}

int allowed_order(const Settings& settings, const CouplingState& state, double width) {
  const bool implicit = settings.scheme == SchemeKind::serial_implicit ||
                        settings.scheme == SchemeKind::parallel_implicit;
  if (implicit || state.impedance <= 0.0 || state.mass_per_area <= 0.0)
    return settings.predictor_order;
  const double theta = state.impedance * width / state.mass_per_area;
  return theta > settings.theta_warn ? std::min(settings.predictor_order, 1)
                                     : settings.predictor_order;
}

bool predict_motion(const CouplingState& state, double t_end, int order, std::span<double> values,
                    const PathBegin& path) {
  const bool known_before = !state.velocity_before.values.empty();
  const WallHistory history{.position = state.position.values,
                            .velocity = state.velocity.values,
                            .velocity_before = state.velocity_before.values,
                            .width_before = known_before ? state.width_before : 0.0,
                            .acceleration = state.acceleration.values};
  const std::size_t n = values.size() / 2;
  // A wall that rests is sent as it is, once.
  return predict_wall(history, state.solid_at_rest ? 0 : order, t_end - state.time, values.first(n),
                      values.last(n), path);
}

void post_predicted(Exchange& exchange, CouplingState& state, const Exchange::Ask& ask, int order) {
  if (state.solid_at_rest && state.wall_current) {
    exchange.post_rest(ask);
  } else {
    predict_motion(state, ask.window.t_end, order, exchange.motion_room());
    exchange.post_motion(ask);
  }
  state.wall_current = state.solid_at_rest;
}

namespace {

/// Whether a window is so much shorter than the flow's own step that its wall keeps to a path.
bool follows_path(const CouplingState& state, const Settings& settings, double width, int order) {
  // Windows that share out what remains of a run are somewhat shorter than a flow step, too.
  constexpr double short_window = 0.75;
  return order >= 1 && settings.wall_path == link::WallPath::cubic &&
         state.acceleration.values.empty() && !state.solid_at_rest &&
         width < short_window * state.stable_flow;
}

}  // namespace

bool predict_on_path(const CouplingState& state, const Settings& settings, const TimeWindow& window,
                     int order, std::span<double> motion) {
  const double width = window.width();
  PathBegin path;
  if (follows_path(state, settings, width, order))
    path = {state.path_end.values, width, width / state.stable_flow};
  return predict_motion(state, window.t_end, order, motion, path);
}

void post_on_path(Exchange& exchange, CouplingState& state, const Settings& settings,
                  const Exchange::Ask& ask, int order, bool made) {
  if (!follows_path(state, settings, ask.window.width(), order)) {
    state.path_end = {};
    if (!made) {
      post_predicted(exchange, state, ask, order);
      return;
    }
  } else {
    const auto motion = exchange.motion_room();
    if (!made) predict_on_path(state, settings, ask.window, order, motion);
    auto& path = state.path_end;
    if (exchange.keeps_motion())
      path = {nullptr, motion};
    else if (path.values.size() != motion.size())
      path = SharedValues::from({motion.begin(), motion.end()});
    else
      std::copy(motion.begin(), motion.end(), path.own().begin());
  }
  exchange.post_motion(ask);
  state.wall_current = false;
}

double load_factor(const Settings& settings, double t) {
  return settings.load_ramp > 0.0 ? std::min(1.0, t / settings.load_ramp) : 1.0;
}

void post_answered_load(Exchange& exchange, const Settings& settings, const CouplingState& state,
                        const Exchange::Ask& ask, const Answer& flow) {
  const bool zero = flow.header().idle;
  const double factor = load_factor(settings, ask.window.t_end);
  if (zero && state.zero_loads == ~std::uint64_t{0}) {
    exchange.post_no_load(ask);
  } else if (zero) {  // the load falls to zero within this window: say so in full
    exchange.post_load(ask, std::vector<double>(exchange.n_loads(), 0.0));
  } else if (factor < 1.0) {
    const auto load = Exchange::load_of(flow);
    std::vector<double> scaled(load.begin(), load.end());
    for (double& p : scaled) p *= factor;
    exchange.post_load(ask, scaled);
  } else {
    exchange.post_load(ask, flow);
  }
}

void accept_motion(CouplingState& state, const Answer& solid, double width) {
  state.velocity_before = state.velocity;
  state.width_before = width;
  state.solid_at_rest = solid.header().idle;
  const std::size_t n = state.velocity.values.size();
  if (!solid.header().idle) {
    const auto view = solid.values();
    state.position = {solid.owner, view.position};
    state.velocity = {solid.owner, view.velocity};
    state.acceleration = {solid.owner, view.acceleration};
    return;
  }
  state.acceleration = {};
  if (std::any_of(state.velocity.values.begin(), state.velocity.values.end(),
                  [](double v) { return v != 0.0; }))
    state.velocity = SharedValues::from(std::vector<double>(n, 0.0));
}

void accept_window(CouplingState& state, const TimeWindow& window, const link::Header& flow,
                   const link::Header& solid) {
  state.window = window.number;
  state.time = window.t_end;
  state.stable_flow = flow.stable_step;
  state.stable_solid = solid.stable_step;
  state.impedance = flow.impedance;
  state.mass_per_area = solid.mass_per_area;
  state.balance.add(flow.work, solid.work, flow.impulse, solid.impulse);
}

namespace {

/// Flow first under the predicted wall, then the solid under the load the flow answered. Large
/// meshes are limited by memory, so values are read as rarely as can be: a load is looked at while
/// the solid works, and one pass over the solid's motion both checks it and predicts the wall of
/// the window that follows.
class SerialExplicit : public Scheme {
 public:
  SerialExplicit(Exchange& exchange, const Settings& settings)
      : exchange_(exchange), settings_(settings) {
    exchange_.check_later();
  }

  [[nodiscard]] TimeWindow next(const CouplingState& state) const override {
    return next_window(window_choice(settings_), state.window, state.time, state.stable_flow,
                       state.stable_solid);
  }
  [[nodiscard]] WindowReports advance(CouplingState& state, const TimeWindow& window,
                                      int order) override;

 private:
  struct Predicted {
    TimeWindow window;
    int order = 0;
    bool operator==(const Predicted&) const = default;
  };
  void look_ahead(const CouplingState& state, const Answer& solid);

  Exchange& exchange_;
  const Settings& settings_;
  std::optional<Predicted> predicted_;  ///< lies in the exchange's motion_room already
};

/// Predicts the wall of the next window where nothing else is to be done to it; checks the answer
/// in any case.
void SerialExplicit::look_ahead(const CouplingState& state, const Answer& solid) {
  predicted_.reset();
  if (!solid.checked && !state.solid_at_rest && state.time < settings_.common.end_time) {
    std::optional<Predicted> ahead;
    try {
      const TimeWindow window = next(state);
      ahead = {window, allowed_order(settings_, state, window.width())};
    } catch (const NumericsError&) {
      // No such window: said when it is due.
    }
    // A lower order does not read accelerations.
    if (ahead && (state.acceleration.values.empty() || ahead->order >= 2) &&
        predict_on_path(state, settings_, ahead->window, ahead->order, exchange_.motion_room())) {
      predicted_ = ahead;
      return;
    }
  }
  exchange_.check_finite(solid);
}

WindowReports SerialExplicit::advance(CouplingState& state, const TimeWindow& window, int order) {
  const Exchange::Ask ask{
      .window = window, .wants_acceleration = settings_.leap_frog, .zero_before = state.zero_loads};
  post_on_path(exchange_, state, settings_, ask, order, predicted_ == Predicted{window, order});
  const Answer flow = exchange_.collect_flow();
  post_answered_load(exchange_, settings_, state, ask, flow);
  exchange_.check_finite(flow);
  const Answer solid = exchange_.collect_solids(state);
  state.zero_loads = exchange_.zero_loads();
  accept_motion(state, solid, window.width());
  accept_window(state, window, flow.header(), solid.header());
  look_ahead(state, solid);
  return {.flow = flow.header(),
          .solid = solid.header(),
          .flow_balance = {flow.values().balance.begin(), flow.values().balance.end()},
          .solids = solid.each};
}

}  // namespace

std::unique_ptr<Scheme> make_scheme(Exchange& exchange, const Settings& settings) {
  switch (settings.scheme) {
    case SchemeKind::serial_explicit:
      return std::make_unique<SerialExplicit>(exchange, settings);
    case SchemeKind::parallel_explicit:
      return make_parallel_explicit(exchange, settings);
    case SchemeKind::serial_implicit:
      return make_serial_implicit(exchange, settings);
    case SchemeKind::parallel_implicit:
      return make_parallel_implicit(exchange, settings);
  }
  return nullptr;
}

}  // namespace ocublast::coupler
