#include "solid_solver/step.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "coupler/base/errors.hpp"
#include "solid_solver/integrators/stable_step.hpp"

namespace ocublast::solid {
namespace {

std::size_t index(std::int32_t n) {
  return static_cast<std::size_t>(n);
}

/// Damping ratio of the highest mode by linear bulk viscosity, over the coefficient: xi = omega c1
/// L / (2 c); measured limits of the meshes here give omega L / (2 c) of 0.85 to 1.25 (1/0.8 for
/// cubes).
constexpr double damping_of_highest_mode = 1.25;

}  // namespace

SolidRun::SolidRun(SolidSetup setup)
    : setup_(std::move(setup)),
      assembly_(std::make_unique<Assembly>(
          *setup_.mesh, setup_.materials, setup_.material_of_tissue, setup_.assembly, setup_.part)),
      state_(setup_.mesh->n_nodes()),
      residual_(4 * setup_.mesh->n_nodes()) {
  build_constraints();
  build_inverse_mass();
  build_loads();
  build_forces();
  for (const auto& p : setup_.prescribed) prescribed_residual_.emplace_back(p.nodes.size(), 0.0);
  build_interface_inertia();
  renew_stable_step();
}

/// Of all ranks; the cell is one of this rank's.
StepBound SolidRun::element_step() const {
  const auto own = assembly_->element_step(state_.displacement);
  if (team().alone()) return own;
  const double step = team().least(own.step);
  const auto number = static_cast<double>(team().cell_number(own.cell));
  const bool mine = team().least(own.step == step ? number : 1e300) == number && own.step == step;
  std::array<double, 2> from{mine ? own.transit : 0.0, mine ? own.length : 0.0};
  team().sum(from);
  return {.transit = from[0], .step = step, .length = from[1], .cell = own.cell};
}

SolidRun::SmallestElement SolidRun::smallest_element() const {
  const auto own = assembly_->element_step(state_.displacement);
  const auto bound = element_step();
  const bool mine = own.step == bound.step && own.transit == bound.transit;
  return {.step = bound.step,
          .transit = bound.transit,
          .place = team().text_of(mine, describe_cell(mesh(), own.cell))};
}

double SolidRun::find_damping_ratio() const {
  double damping = damping_of_highest_mode * setup_.assembly.viscosity.linear +
                   team().most(assembly_->viscous_damping_ratio(omega_));
  for (const auto& force : forces_) damping += team().most(force->damping_ratio(omega_, mass_));
  return damping;
}

void SolidRun::renew_stable_step() {
  const auto bound = element_step();
  element_step_ = bound.step;
  steps_since_renewal_ = 0;
  if (setup_.control.rule == StepControl::Rule::element) {
    stable_step_ = setup_.control.element_factor * element_step_;
    return;
  }
  AlignedVector<double> moved(state_.displacement.size());
  AlignedVector<double> force(moved.size());
  // Product by a central difference of the forces: a tenth of a thousandth of the smallest length
  // leaves an error of 1e-8 by curvature and 1e-11 by rounding.
  const auto product = [&](std::span<const double> x, const TakePart& take) {
    const auto take_force = [&](double s) {
      for (const auto& c : constraints_) c->reduce(force);
      take(force, s);
    };
    double largest = 0.0;
    for (const double value : x) largest = std::max(largest, std::abs(value));
    const double eps = 1e-4 * bound.length / team().most(largest);
    for (const double s : {eps, -eps}) {
      for (std::size_t i = 0; i < moved.size(); ++i) moved[i] = state_.displacement[i] + s * x[i];
      expand(moved);
      assembly_->compute_force(moved, force, 0.0);
      take_force(0.5 / s);
    }
    if (forces_.empty()) return;
    std::copy(x.begin(), x.end(), moved.begin());
    expand(moved);
    std::fill(force.begin(), force.end(), 0.0);
    for (const auto& f : forces_) f->add_stiffness(moved, force);
    take_force(1.0);
  };
  const auto frequency =
      largest_frequency(inverse_mass_, product, setup_.control.lanczos_products, team());
  omega_ = frequency.omega;
  if (!(omega_ > 0.0) || !std::isfinite(omega_))
    throw NumericsError(
        fmt::format("no largest frequency found at t = {:.6g} s (omega = {}): are all "
                    "nodes fixed, or is the state lost?",
                    state_.time, omega_));
  stable_step_ = setup_.control.safety * critical_step(omega_, find_damping_ratio());
}

void SolidRun::look_at_configuration() {
  steps_since_look_ = 0;
  const double now = element_step().step;
  if (std::abs(now / element_step_ - 1.0) > setup_.control.shrink_limit ||
      steps_since_renewal_ >= setup_.control.renew_every)
    renew_stable_step();
}

void SolidRun::set_velocity(std::int32_t node, const std::array<double, 3>& velocity) {
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t at = 4 * index(node) + i;
    if (inverse_mass_[at] == 0.0) continue;
    const double counted = team().counts(index(node)) ? 0.5 : 0.0;
    sums_.initial += counted *
                     (velocity[i] * velocity[i] - state_.velocity[at] * state_.velocity[at]) /
                     inverse_mass_[at];
    state_.velocity[at] = velocity[i];
    awake_ = awake_ || velocity[i] != 0.0;
  }
}

/// Largest pressure on the interface at the window's end, Pa; forces over the area of their node.
/// Infinite where one of them is no number: that must not pass for silence.
double SolidRun::largest_interface_load(const Window& window) const {
  double largest = 0.0;
  const auto note = [&](double p) {
    largest = std::isnan(p) ? std::numeric_limits<double>::infinity() : std::max(largest, p);
  };
  for (const double p : window.overpressure) note(std::abs(p));
  if (window.force.empty()) return largest;
  const auto areas = loads_.back().surface.nodal_areas();
  for (std::size_t v = 0; v < areas.size(); ++v)
    note(std::hypot(window.force[3 * v], window.force[3 * v + 1], window.force[3 * v + 2]) /
         areas[v]);
  return largest;
}

bool SolidRun::quiet(const Load& load, const Window& window) const {
  if (load.by_facet) return load.by_facet->quiet(window.t_begin, window.t_end);
  return load.schedule.zero_in(window.t_begin, window.t_end);
}

bool SolidRun::disturbed(const Window& window) const {
  if (!setup_.control.sleep) return true;
  if (largest_interface_load(window) > setup_.control.quiet_overpressure) return true;
  for (const auto& load : loads_)
    if (!load.coupled && !quiet(load, window)) return true;
  for (const auto& p : setup_.prescribed)
    if (!p.schedule.zero_in(window.t_begin, window.t_end)) return true;
  return std::any_of(forces_.begin(), forces_.end(), [&](const auto& force) {
    return !force->quiet(window.t_begin, window.t_end);
  });
}

std::uint32_t SolidRun::choose_steps(const Window& window) const {
  const double length = window.t_end - window.t_begin;
  // A window of n stable steps up to rounding takes n steps.
  const double needed = std::max(1.0, std::ceil(length / stable_step_ * (1.0 - 1e-9)));
  return std::max(window.steps, static_cast<std::uint32_t>(needed));
}

WindowResult SolidRun::advance(const Window& window) {
  WindowResult result;
  if (!team().any(awake_ || disturbed(window))) {
    state_.time = window.t_end;
    sums_.steps_slept += choose_steps(window);
    const double ignored = largest_interface_load(window);
    sums_.ignored_pressure = std::max(sums_.ignored_pressure, ignored);
    sums_.ignored_impulse += ignored * (window.t_end - window.t_begin);
    result.idle = true;
    return result;
  }
  awake_ = true;
  result.steps = choose_steps(window);
  const double dt = (window.t_end - window.t_begin) / result.steps;
  note_step_change(dt);
  if (!started_) start(window);
  begin_window(window);
  for (std::uint32_t k = 1; k <= result.steps; ++k) {
    const StepTimes times{.t_old = state_.time,
                          .t_new = k == result.steps ? window.t_end : window.t_begin + k * dt,
                          .dt = dt};
    predict(times);
    impose_prescribed(times);
    const auto report = assembly_->compute_force(state_.displacement, residual_, 1.0 / dt, [&] {
      apply_loads(window, times, result, residual_);
    });
    sums_.viscous += report.viscous_work;
    sums_.relaxation += report.overlay_work;
    check_inverted(report.bad, times.t_new);
    apply_forces(times);
    reduce_residual();
    correct(dt);
    finish_prescribed(times);
    state_.time = times.t_new;
  }
  sums_.steps += result.steps;
  steps_since_look_ += static_cast<int>(result.steps);
  steps_since_renewal_ += static_cast<int>(result.steps);
  for (auto& load : loads_)
    if (load.coupled) {
      if (window.overpressure.empty())
        std::fill(load.last_end.begin(), load.last_end.end(), 0.0);
      else
        load.last_end.assign(window.overpressure.begin(), window.overpressure.end());
    }
  if (coupled_) {
    result.interface_work = team().sum(result.interface_work);
    team().sum(result.interface_impulse);
  }
  if (steps_since_look_ >= setup_.control.check_every) look_at_configuration();
  return result;
}

/// Loads that jump at the beginning of a window change the acceleration there.
void SolidRun::begin_window(const Window& window) {
  struct Change {
    const Load* load;
    std::vector<double> old_forces;
  };
  std::vector<Change> changes;
  for (auto& load : loads_) {
    auto old_forces = load.forces;
    if (load.coupled && !window.force.empty()) {
      load.force_begin = load.forces;
      set_forces(load, window, window.t_begin);
      if (load.forces == old_forces) continue;
    } else if (load.by_facet) {
      load.by_facet->compute_forces(state_.displacement, window.t_begin, load.forces);
      if (load.forces == old_forces) continue;
    } else {
      const auto before = load.pressure;
      set_pressure(load, window, window.t_begin);
      if (load.pressure == before) continue;
      load.surface.compute_forces(state_.displacement, load.pressure, load.forces);
    }
    changes.push_back({&load, std::move(old_forces)});
  }
  if (!team().any(!changes.empty())) return;
  const double square = residual_square();
  add_partial([&](std::span<double> residual) {
    for (const auto& [load, old_forces] : changes)
      for (std::size_t v = 0; v < load->surface.nodes().size(); ++v)
        for (std::size_t i = 0; i < 3; ++i)
          residual[4 * index(load->surface.nodes()[v]) + i] +=
              old_forces[3 * v + i] - load->forces[3 * v + i];
  });
  reduce_residual();
  sums_.scheme_jumps += sums_.last_step * sums_.last_step / 8.0 * (residual_square() - square);
  refresh_acceleration();
}

/// Adds to the residual what this rank's facets give to its nodes, with the other ranks' part.
void SolidRun::add_partial(const std::function<void(std::span<double>)>& add) {
  if (team().alone()) {
    add(residual_);
    return;
  }
  AlignedVector<double> more(residual_.size());
  add(more);
  assembly_->team().forces()->add(more);
  for (std::size_t i = 0; i < residual_.size(); ++i) residual_[i] += more[i];
}

void SolidRun::refresh_acceleration() {
  for (std::size_t i = 0; i < residual_.size(); ++i)
    state_.acceleration[i] = -residual_[i] * inverse_mass_[i];
  expand(state_.acceleration);
}

void SolidRun::set_pressure(Load& load, const Window& window, double t) {
  if (!load.coupled) {
    std::fill(load.pressure.begin(), load.pressure.end(), load.schedule.value(t));
    return;
  }
  const double length = window.t_end - window.t_begin;
  const double s = window.shape == InterfaceLoad::linear && t != window.t_end
                       ? (t - window.t_begin) / length
                       : 1.0;
  for (std::size_t v = 0; v < load.pressure.size(); ++v) {
    const double end = window.overpressure.empty() ? 0.0 : window.overpressure[v];
    load.pressure[v] = s == 1.0 ? end : load.last_end[v] + s * (end - load.last_end[v]);
  }
}

/// Forces that were given at the nodes, where the flow has an interface mesh of its own.
void SolidRun::set_forces(Load& load, const Window& window, double t) {
  const double s = window.shape == InterfaceLoad::linear && t != window.t_end
                       ? (t - window.t_begin) / (window.t_end - window.t_begin)
                       : 1.0;
  for (std::size_t i = 0; i < load.forces.size(); ++i)
    load.forces[i] = s == 1.0 ? window.force[i]
                              : load.force_begin[i] + s * (window.force[i] - load.force_begin[i]);
}

void SolidRun::predict(const StepTimes& times) {
  const double dt = times.dt;
  const double half = 0.5 * dt;
  double* d = state_.displacement.data();
  double* v = state_.velocity.data();
  const double* a = state_.acceleration.data();
  const std::size_t n = state_.displacement.size();
#pragma omp parallel for schedule(static) num_threads(setup_.assembly.threads)
  for (std::size_t i = 0; i < n; ++i) {
    v[i] += half * a[i];
    d[i] += dt * v[i];
  }
  expand(state_.velocity);
  expand(state_.displacement);
}

void SolidRun::impose_prescribed(const StepTimes& times) {
  for (const auto& p : setup_.prescribed) {
    const double target = p.displacement(times.t_new);
    for (const auto n : p.nodes) {
      const std::size_t at = 4 * index(n) + p.direction;
      const double before = p.displacement(times.t_old);
      state_.velocity[at] = (target - before) / times.dt;
      state_.displacement[at] = target;
    }
  }
}

void SolidRun::apply_loads(const Window& window, const StepTimes& times, WindowResult& result,
                           std::span<double> residual) {
  for (auto& load : loads_) {
    const auto old = load.forces;
    if (load.coupled && !window.force.empty()) {
      set_forces(load, window, times.t_new);
    } else if (load.by_facet) {
      load.by_facet->compute_forces(state_.displacement, times.t_new, load.forces);
    } else {
      set_pressure(load, window, times.t_new);
      const bool loaded = std::any_of(load.pressure.begin(), load.pressure.end(),
                                      [](double p) { return p != 0.0; });
      if (loaded)
        load.surface.compute_forces(state_.displacement, load.pressure, load.forces);
      else
        std::fill(load.forces.begin(), load.forces.end(), 0.0);
    }
    double work = 0.0;
    for (std::size_t v = 0; v < load.surface.nodes().size(); ++v)
      for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t at = 4 * index(load.surface.nodes()[v]) + i;
        residual[at] -= load.forces[3 * v + i];
        const double mean = 0.5 * (old[3 * v + i] + load.forces[3 * v + i]);
        work += mean * state_.velocity[at] * times.dt;
        if (load.coupled) result.interface_impulse[i] += mean * times.dt;
      }
    sums_.external += work;
    if (!load.coupled) continue;
    result.interface_work += work;
    sums_.coupling += work;
  }
}

void SolidRun::apply_forces(const StepTimes& times) {
  const StepMotion motion{.displacement = state_.displacement,
                          .velocity = state_.velocity,
                          .t_old = times.t_old,
                          .t_new = times.t_new,
                          .dt = times.dt,
                          .counted = team().counted()};
  sums_.stored = 0.0;
  for (const auto& force : forces_) {
    const auto work = force->apply(motion, residual_);
    sums_.stored += work.stored;
    sums_.damping += work.dissipated;
    sums_.external += work.external;
  }
}

void SolidRun::reduce_residual() {
  for (const auto& c : constraints_) c->reduce(residual_);
}

void SolidRun::expand(AlignedVector<double>& field) const {
  for (const auto& c : constraints_) c->expand(field);
}

/// Motions that begin at once give their nodes kinetic energy; loads that are there from the
/// beginning accelerate from the beginning.
void SolidRun::start(const Window& window) {
  started_ = true;
  for (const auto& p : setup_.prescribed) {
    const double now = p.velocity(window.t_begin);
    for (const auto n : p.nodes) {
      double& v = state_.velocity[4 * index(n) + p.direction];
      if (team().counts(index(n))) sums_.external += 0.5 * mass_[index(n)] * (now * now - v * v);
      v = now;
    }
  }
  if (forces_.empty()) return;
  const double square = residual_square();
  apply_forces({.t_old = window.t_begin, .t_new = window.t_begin, .dt = 0.0});
  reduce_residual();
  sums_.scheme_jumps += sums_.last_step * sums_.last_step / 8.0 * (residual_square() - square);
  refresh_acceleration();
}

void SolidRun::correct(double dt) {
  const double half = 0.5 * dt;
  double* v = state_.velocity.data();
  double* a = state_.acceleration.data();
  const double* r = residual_.data();
  const double* m = inverse_mass_.data();
  const std::size_t n = residual_.size();
#pragma omp parallel for schedule(static) num_threads(setup_.assembly.threads)
  for (std::size_t i = 0; i < n; ++i) {
    a[i] = -r[i] * m[i];
    v[i] += half * a[i];
  }
  expand(state_.acceleration);
  expand(state_.velocity);
}

void SolidRun::finish_prescribed(const StepTimes& times) {
  for (std::size_t s = 0; s < setup_.prescribed.size(); ++s) {
    const auto& p = setup_.prescribed[s];
    const double before = p.velocity(times.t_old);
    const double after = p.velocity(times.t_new);
    for (std::size_t k = 0; k < p.nodes.size(); ++k) {
      const std::size_t at = 4 * index(p.nodes[k]) + p.direction;
      const double step = state_.velocity[at] * times.dt;
      double& old = prescribed_residual_[s][k];
      // What the support does: works against the residual and gives the node its kinetic energy.
      if (team().counts(index(p.nodes[k])))
        sums_.external += 0.5 * (old + residual_[at]) * step +
                          0.5 * mass_[index(p.nodes[k])] * (after * after - before * before);
      old = residual_[at];
      state_.velocity[at] = after;
    }
  }
}

void SolidRun::note_step_change(double dt) {
  const double old = sums_.last_step > 0.0 ? sums_.last_step : dt;
  sums_.last_step = dt;
  if (dt == old) return;
  sums_.scheme_jumps += (dt * dt - old * old) / 8.0 * residual_square();
}

/// a.M a, N m/s^2, over the free directions.
double SolidRun::residual_square() const {
  double square = 0.0;
  for (std::size_t i = 0; i < residual_.size(); ++i)
    if (team().counts(i / 4)) square += residual_[i] * residual_[i] * inverse_mass_[i];
  return team().sum(square);
}

/// Throws on all ranks when an element of any is inverted.
void SolidRun::check_inverted(bool bad, double time) const {
  if (!team().any(bad)) return;
  team().together([&] {
    if (bad) report_inverted(time);
  });
}

void SolidRun::report_inverted(double time) const {
  const auto place = assembly_->find_worst(state_.displacement);
  const auto cell = mesh().cell(place.cell);
  throw NumericsError(fmt::format(
      "{} {} of tissue {} inverted or lost at t = {:.9g} s: smallest J = {:.4g}, "
      "centre ({:.6g}, {:.6g}, {:.6g}) m, step {:.3g} s (critical {:.3g} s); refine "
      "there, soften the load, or lower solid.integrator.safety",
      info(cell.shape).name, cell.index, place.tissue, time, place.jacobian, place.position[0],
      place.position[1], place.position[2], sums_.last_step, stable_step_));
}

}  // namespace ocublast::solid
