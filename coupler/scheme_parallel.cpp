#include "coupler/scheme_parallel.hpp"

#include <vector>

namespace ocublast::coupler {

namespace {

class ParallelExplicit : public Scheme {
 public:
  ParallelExplicit(Exchange& exchange, const Settings& settings)
      : exchange_(exchange), settings_(settings) {}

  [[nodiscard]] TimeWindow next(const CouplingState& state) const override {
    return state.ahead ? state.ahead->window : after(state, state.window, state.time);
  }
  [[nodiscard]] WindowReports advance(CouplingState& state, const TimeWindow& window,
                                      int order) override;

 private:
  [[nodiscard]] TimeWindow after(const CouplingState& state, std::uint64_t number, double t) const {
    return next_window(window_choice(settings_), number, t, state.stable_flow, state.stable_solid);
  }
  void keep(CouplingState& state, const TimeWindow& window, const Answer& flow);
  void post_kept_load(const CouplingState& state, const FlowAhead& ahead);

  Exchange& exchange_;
  const Settings& settings_;
  std::optional<Answer> answer_;  ///< of the window ahead; nothing right after a resume
};

/// The flow has finished a window that the solid has still to do.
void ParallelExplicit::keep(CouplingState& state, const TimeWindow& window, const Answer& flow) {
  const auto& h = flow.header();
  FlowAhead ahead{.window = window,
                  .idle = h.idle,
                  .steps = h.steps,
                  .work = h.work,
                  .impulse = h.impulse,
                  .impedance = h.impedance,
                  .stable_step = h.stable_step,
                  .load = {},
                  .balance = {}};
  if (!h.idle) {
    ahead.load = {flow.owner, Exchange::load_of(flow)};
    ahead.balance = {flow.owner, flow.values().balance};
  }
  state.stable_flow = h.stable_step;
  state.ahead = std::move(ahead);
  answer_ = flow;
}

void ParallelExplicit::post_kept_load(const CouplingState& state, const FlowAhead& ahead) {
  const Exchange::Ask ask{.window = ahead.window, .zero_before = state.zero_loads};
  if (answer_) {
    post_answered_load(exchange_, settings_, state, ask, *answer_);
    return;
  }
  const double factor = load_factor(settings_, ahead.window.t_end);
  std::vector<double> load(exchange_.n_loads(), 0.0);
  for (std::size_t i = 0; i < ahead.load.values.size(); ++i)
    load[i] = factor < 1.0 ? factor * ahead.load.values[i] : ahead.load.values[i];
  if (ahead.idle && state.zero_loads == ~std::uint64_t{0})
    exchange_.post_no_load(ask);
  else
    exchange_.post_load(ask, load);
}

WindowReports ParallelExplicit::advance(CouplingState& state, const TimeWindow& window, int order) {
  if (!state.ahead) {  // at the start the flow goes first, alone
    post_on_path(exchange_, state, settings_, {.window = window}, order);
    keep(state, window, exchange_.collect_flow());
  }
  const FlowAhead done = *state.ahead;
  post_kept_load(state, done);
  std::optional<TimeWindow> further;
  if (window.t_end < settings_.common.end_time) {
    further = after(state, window.number, window.t_end);
    post_on_path(exchange_, state, settings_, {.window = *further}, order);
  }
  const Answer solid = exchange_.collect_solids(state);
  link::Header flow;
  flow.steps = done.steps;
  flow.work = done.work;
  flow.impulse = done.impulse;
  flow.impedance = done.impedance;
  flow.stable_step = done.stable_step;
  state.zero_loads = exchange_.zero_loads();
  state.ahead.reset();
  answer_.reset();
  double seconds = 0.0;
  if (further) {
    const Answer ahead = exchange_.collect_flow();
    seconds = ahead.header().compute_seconds;
    flow.status = ahead.header().status;
    flow.stable_step = ahead.header().stable_step;
    keep(state, *further, ahead);
  }
  flow.compute_seconds = seconds;
  accept_motion(state, solid, window.width());
  accept_window(state, window, flow, solid.header());
  return {.flow = flow,
          .solid = solid.header(),
          .flow_balance = {done.balance.values.begin(), done.balance.values.end()},
          .solids = solid.each};
}

}  // namespace

std::unique_ptr<Scheme> make_parallel_explicit(Exchange& exchange, const Settings& settings) {
  return std::make_unique<ParallelExplicit>(exchange, settings);
}

}  // namespace ocublast::coupler
