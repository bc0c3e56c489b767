#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "coupler/base/errors.hpp"
#include "solid_solver/step.hpp"

// Dynamic relaxation by kinetic damping: the body swings freely under its loads; whenever its
// kinetic energy has passed a peak it stands near an equilibrium of its fastest swing and is
// stopped. No damping constant has to be guessed.

namespace ocublast::solid {

SolidRun::Relaxed SolidRun::relax(double tolerance, std::size_t most_steps) {
  Relaxed result;
  // An endless step lets rate-dependent stress relax fully and leaves no viscous stress.
  constexpr double endless = 1e-300;
  // A body that gives way quickly shrinks the stable step between two looks at it.
  constexpr double slower = 0.85;
  constexpr std::size_t look_every = 50;
  const auto sums = sums_;
  const Window window{.t_begin = state_.time, .t_end = state_.time};
  double last_kinetic = 0.0;
  while (result.steps < most_steps) {
    ++result.steps;
    const double dt = slower * stable_step_;  // renewed as the body deforms
    const StepTimes times{.t_old = state_.time, .t_new = state_.time, .dt = dt};
    predict(times);
    impose_prescribed(times);
    check_inverted(assembly_->compute_force(state_.displacement, residual_, endless).bad,
                   state_.time);
    enum { internal, kinetic, left };
    std::array<double, left + 1> sum{};
    // With the reactions of supports, which bear prescribed motions.
    for (std::size_t i = 0; i < residual_.size(); ++i)
      if (team().counts(i / 4)) sum[internal] += residual_[i] * residual_[i];
    WindowResult unused;
    add_partial([&](std::span<double> residual) { apply_loads(window, times, unused, residual); });
    apply_forces({.t_old = state_.time, .t_new = state_.time, .dt = 0.0});
    reduce_residual();
    correct(dt);
    finish_prescribed(times);
    for (std::size_t i = 0; i < residual_.size(); ++i) {
      if (inverse_mass_[i] == 0.0 || !team().counts(i / 4)) continue;
      sum[kinetic] += state_.velocity[i] * state_.velocity[i] / inverse_mass_[i];
      sum[left] += residual_[i] * residual_[i];
    }
    team().sum(sum);
    result.residual =
        sum[internal] > 0.0 ? std::sqrt(sum[left] / sum[internal]) : (sum[left] > 0.0 ? 1.0 : 0.0);
    if (result.residual <= tolerance) break;
    if (sum[kinetic] < last_kinetic) {
      std::fill(state_.velocity.begin(), state_.velocity.end(), 0.0);
      sum[kinetic] = 0.0;
    }
    last_kinetic = sum[kinetic];
    steps_since_renewal_ += 1;
    if (result.steps % look_every == 0) look_at_configuration();
  }
  if (result.residual > tolerance)
    throw NumericsError(fmt::format(
        "no equilibrium after {} steps of relaxation: residual {:.3g} of the loads, accepted "
        "{:.3g}; is the body held? Otherwise allow more steps (solid.initial.steps)",
        result.steps, result.residual, tolerance));
  std::fill(state_.velocity.begin(), state_.velocity.end(), 0.0);
  refresh_acceleration();
  const double stored = sums_.stored;
  started_ = true;
  awake_ = true;
  CellResults cells;
  assembly_->evaluate(state_.displacement, cells);
  sums_ = sums;
  sums_.stored = stored;
  for (std::size_t cell = 0; cell < mesh().n_cells(); ++cell)
    sums_.initial +=
        cells[cell * n_evaluated + strain_energy] + cells[cell * n_evaluated + hourglass_energy];
  sums_.initial += stored;
  renew_stable_step();
  return result;
}

}  // namespace ocublast::solid
