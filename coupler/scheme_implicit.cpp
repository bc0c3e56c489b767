#include "coupler/scheme_implicit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "coupler/base/errors.hpp"
#include "coupler/relaxation.hpp"

namespace ocublast::coupler {

namespace {

double norm(std::span<const double> values) {
  double sum = 0.0;
  for (const double v : values) sum += v * v;
  return std::sqrt(sum);
}

double distance(std::span<const double> a, std::span<const double> b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
  return std::sqrt(sum);
}

/// Positions are rounded to this share of themselves; displacements in a window cannot agree
/// better.
constexpr double position_rounding = 4.0 * std::numeric_limits<double>::epsilon();

/// a / b, 0 where both are 0.
double relative(double a, double b) {
  return a == 0.0 ? 0.0 : b > 0.0 ? a / b : std::numeric_limits<double>::infinity();
}

/// The wall at the end of a window as the unknown of an iteration: displacement in the window and
/// window x velocity, [6 n] m, so that both have the same size.
class Motion {
 public:
  Motion(const CouplingState& state, double width)
      : start_(state.position.values.begin(), state.position.values.end()),
        width_(width),
        rounding_(position_rounding * norm(start_)) {}

  /// Difference between what was sent and what was answered, relative; what rounding explains
  /// counts as none.
  [[nodiscard]] double change(std::span<const double> sent,
                              std::span<const double> answered) const {
    const double apart = distance(sent, answered);
    return apart <= rounding_ ? 0.0 : relative(apart, norm(answered));
  }

  [[nodiscard]] std::size_t size() const { return 2 * start_.size(); }
  void from_wall(std::span<const double> position, std::span<const double> velocity,
                 std::span<double> z) const {
    for (std::size_t i = 0; i < start_.size(); ++i) {
      z[i] = position[i] - start_[i];
      z[start_.size() + i] = width_ * velocity[i];
    }
  }
  void to_wall(std::span<const double> z, std::span<double> values) const {
    for (std::size_t i = 0; i < start_.size(); ++i) {
      values[i] = start_[i] + z[i];
      values[start_.size() + i] = z[start_.size() + i] / width_;
    }
  }
  /// What the solid answered; a solid at rest stands where the window began.
  void from_answer(const Answer& solid, std::span<double> z) const {
    if (solid.header().idle) {
      std::fill(z.begin(), z.end(), 0.0);
      return;
    }
    const auto view = solid.values();
    from_wall(view.position, view.velocity, z);
  }

 private:
  std::vector<double> start_;  ///< a copy: answers of later iterations overwrite shared memory
  double width_;
  double rounding_;  ///< m
};

/// The state's own copies of what lies in the solid's memory: iterations would overwrite it.
void detach(CouplingState& state) {
  for (SharedValues* values : {&state.position, &state.velocity, &state.velocity_before})
    if (!values->values.empty())
      *values =
          SharedValues::from(std::vector<double>(values->values.begin(), values->values.end()));
}

class Implicit : public Scheme {
 public:
  Implicit(Exchange& exchange, const Settings& settings)
      : exchange_(exchange),
        settings_(settings),
        relaxation_(make_relaxation(settings.relaxation, settings.relaxation_factor)) {}

  [[nodiscard]] TimeWindow next(const CouplingState& state) const override {
    return next_window(window_choice(settings_), state.window, state.time, state.stable_flow,
                       state.stable_solid);
  }

 protected:
  /// Sums of the whole window, and what is left at its end.
  WindowReports finish(CouplingState& state, const TimeWindow& window, const Answer& flow,
                       const Answer& solid, WindowReports reports) const {
    state.zero_loads = exchange_.zero_loads();
    accept_motion(state, solid, window.width());
    detach(state);
    accept_window(state, window, flow.header(), solid.header());
    const double flow_seconds = reports.flow.compute_seconds + flow.header().compute_seconds;
    const double solid_seconds = reports.solid.compute_seconds + solid.header().compute_seconds;
    reports.flow = flow.header();
    reports.solid = solid.header();
    reports.flow_balance.assign(flow.values().balance.begin(), flow.values().balance.end());
    reports.solids = solid.each;
    reports.flow.compute_seconds = flow_seconds;
    reports.solid.compute_seconds = solid_seconds;
    return reports;
  }
  static void count(WindowReports& reports, const Answer& flow, const Answer& solid) {
    reports.flow.compute_seconds += flow.header().compute_seconds;
    reports.solid.compute_seconds += solid.header().compute_seconds;
  }
  [[nodiscard]] bool converged(double motion, double load) const {
    return motion <= settings_.convergence_motion &&
           (settings_.convergence_load == 0.0 || load <= settings_.convergence_load);
  }
  [[noreturn]] void give_up(const TimeWindow& window, double motion, double load) const {
    throw NumericsError(fmt::format(
        "window {}, t = {:.6g} s: implicit coupling has not converged in {} iterations: motion "
        "{:.3g} (accepted "
        "{:.3g}), load {:.3g} (accepted {}); allow more coupling.max_iterations, take another "
        "coupling.relaxation, or shorter windows",
        window.number, window.t_begin, settings_.max_iterations, motion,
        settings_.convergence_motion, load,
        settings_.convergence_load > 0.0 ? fmt::format("{:.3g}", settings_.convergence_load)
                                         : "any"));
  }

  Exchange& exchange_;
  const Settings& settings_;
  std::unique_ptr<Relaxation> relaxation_;
};

class SerialImplicit : public Implicit {
 public:
  using Implicit::Implicit;
  [[nodiscard]] WindowReports advance(CouplingState& state, const TimeWindow& window,
                                      int order) override;
};

WindowReports SerialImplicit::advance(CouplingState& state, const TimeWindow& window, int order) {
  detach(state);
  const Motion motion(state, window.width());
  std::vector<double> wall(motion.size()), z(motion.size()), answered(motion.size()),
      residual(motion.size());
  predict_motion(state, window.t_end, order, wall);
  motion.from_wall(std::span(wall).first(wall.size() / 2), std::span(wall).last(wall.size() / 2),
                   z);
  relaxation_->begin_window();
  WindowReports reports;
  std::vector<double> load_before;
  double load_change = 1.0;
  for (std::uint32_t k = 1; k <= static_cast<std::uint32_t>(settings_.max_iterations); ++k) {
    const Exchange::Ask ask{.window = window, .iteration = k, .zero_before = state.zero_loads};
    if (k == 1) {
      post_predicted(exchange_, state, ask, order);
    } else {
      motion.to_wall(z, exchange_.motion_room());
      exchange_.post_motion(ask);
      state.wall_current = false;
    }
    const Answer flow = exchange_.collect_flow();
    post_answered_load(exchange_, settings_, state, ask, flow);
    const Answer solid = exchange_.collect_solids(state);
    motion.from_answer(solid, answered);
    for (std::size_t i = 0; i < z.size(); ++i) residual[i] = answered[i] - z[i];
    reports.iterations = static_cast<int>(k);
    reports.residual = motion.change(z, answered);
    const auto load = Exchange::load_of(flow);
    if (!load_before.empty() || load.empty())
      load_change = load.empty() ? 0.0 : relative(distance(load, load_before), norm(load));
    load_before.assign(load.begin(), load.end());
    if (converged(reports.residual, load_change))
      return finish(state, window, flow, solid, reports);
    count(reports, flow, solid);
    relaxation_->advance(z, residual);
  }
  give_up(window, reports.residual, load_change);
}

class ParallelImplicit : public Implicit {
 public:
  using Implicit::Implicit;
  [[nodiscard]] WindowReports advance(CouplingState& state, const TimeWindow& window,
                                      int order) override;

 private:
  struct Guess {
    std::vector<double> motion;  ///< [6 n] m
    std::vector<double> load;    ///< [n] Pa
  };
  void post_both(CouplingState& state, const Exchange::Ask& ask, int order, const Motion& motion,
                 const Guess& guess);
};

void ParallelImplicit::post_both(CouplingState& state, const Exchange::Ask& ask, int order,
                                 const Motion& motion, const Guess& guess) {
  if (ask.iteration == 1) {
    post_predicted(exchange_, state, ask, order);
  } else {
    motion.to_wall(guess.motion, exchange_.motion_room());
    exchange_.post_motion(ask);
    state.wall_current = false;
  }
  const bool zero =
      std::all_of(guess.load.begin(), guess.load.end(), [](double p) { return p == 0.0; });
  if (zero && state.zero_loads == ~std::uint64_t{0})
    exchange_.post_no_load(ask);
  else
    exchange_.post_load(ask, guess.load);
}

WindowReports ParallelImplicit::advance(CouplingState& state, const TimeWindow& window, int order) {
  detach(state);
  const Motion motion(state, window.width());
  const std::size_t m = motion.size(), n = exchange_.n_loads();
  Guess guess{.motion = std::vector<double>(m), .load = std::vector<double>(n, 0.0)};
  std::vector<double> wall(m), answered(m), x(m + n), residual(m + n);
  predict_motion(state, window.t_end, order, wall);
  motion.from_wall(std::span(wall).first(m / 2), std::span(wall).last(m / 2), guess.motion);
  std::copy(state.load.values.begin(), state.load.values.end(), guess.load.begin());
  relaxation_->begin_window();
  WindowReports reports;
  double motion_scale = 0.0, load_scale = 0.0, load_change = 0.0;
  const double factor = load_factor(settings_, window.t_end);
  for (std::uint32_t k = 1; k <= static_cast<std::uint32_t>(settings_.max_iterations); ++k) {
    post_both(state, {.window = window, .iteration = k, .zero_before = state.zero_loads}, order,
              motion, guess);
    const Answer flow = exchange_.collect_flow();
    const Answer solid = exchange_.collect_solids(state);
    motion.from_answer(solid, answered);
    std::vector<double> load(n, 0.0);
    const auto given = Exchange::load_of(flow);
    for (std::size_t i = 0; i < given.size(); ++i) load[i] = factor * given[i];
    reports.iterations = static_cast<int>(k);
    reports.residual = motion.change(guess.motion, answered);
    load_change = relative(distance(load, guess.load), norm(load));
    if (converged(reports.residual, load_change)) {
      state.load = SharedValues::from(std::move(load));
      return finish(state, window, flow, solid, reports);
    }
    count(reports, flow, solid);
    motion_scale = motion_scale > 0.0 ? motion_scale : norm(answered);
    load_scale = load_scale > 0.0 ? load_scale : norm(load);
    const double by_motion = motion_scale > 0.0 ? 1.0 / motion_scale : 1.0;
    const double by_load = load_scale > 0.0 ? 1.0 / load_scale : 1.0;
    for (std::size_t i = 0; i < m; ++i) {
      x[i] = by_motion * guess.motion[i];
      residual[i] = by_motion * (answered[i] - guess.motion[i]);
    }
    for (std::size_t i = 0; i < n; ++i) {
      x[m + i] = by_load * guess.load[i];
      residual[m + i] = by_load * (load[i] - guess.load[i]);
    }
    relaxation_->advance(x, residual);
    for (std::size_t i = 0; i < m; ++i) guess.motion[i] = x[i] / by_motion;
    for (std::size_t i = 0; i < n; ++i) guess.load[i] = x[m + i] / by_load;
  }
  give_up(window, reports.residual, load_change);
}

}  // namespace

std::unique_ptr<Scheme> make_serial_implicit(Exchange& exchange, const Settings& settings) {
  return std::make_unique<SerialImplicit>(exchange, settings);
}

std::unique_ptr<Scheme> make_parallel_implicit(Exchange& exchange, const Settings& settings) {
  return std::make_unique<ParallelImplicit>(exchange, settings);
}

}  // namespace ocublast::coupler
