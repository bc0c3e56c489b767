#include "flow_solver/sources/jwl_wave.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace ocublast::flow::inline OCU_PRECISION {
namespace {

constexpr double four_pi = 4.0 * std::numbers::pi;
// Artificial viscosity: quadratic and linear coefficients of the usual range (Wilkins 1980).
constexpr double q_quadratic = 1.5;
constexpr double q_linear = 0.3;
constexpr double cfl = 0.4;
// A cell burns while the detonation passes this many cells' thickness.
constexpr double burn_width = 3.0;

double shell_volume(double a, double b) {
  return four_pi / 3.0 * (b - a) * (a * a + a * b + b * b);
}

/// Area that a sphere growing from a to b sweeps per path: its volume change over b - a.
double swept_area(double a, double b) {
  return four_pi / 3.0 * (a * a + a * b + b * b);
}

}  // namespace

JwlWave::JwlWave(const Gas& gas, const State& ambient, const Jwl& jwl, double mass, double r_max,
                 const JwlResolution& resolution)
    : SteppedWave(gas, ambient), jwl_(jwl), n_charge_(resolution.charge_cells) {
  const double radius = std::cbrt(3.0 * mass / (four_pi * jwl.density));
  const double h = radius / n_charge_;
  for (int i = 0; i <= n_charge_; ++i) r_.push_back(i * h);
  while (r_.back() < r_max)
    r_.push_back(r_.back() + h + resolution.air_growth * (r_.back() - radius));
  u_.assign(r_.size(), 0.0);
  const double air_e = ambient.p / ((gas.heat_capacity_ratio - 1.0) * ambient.rho);
  for (std::size_t i = 0; i + 1 < r_.size(); ++i) {
    const bool charge = static_cast<int>(i) < n_charge_;
    const double rho = charge ? jwl.density : ambient.rho;
    cells_.push_back({.mass = rho * shell_volume(r_[i], r_[i + 1]),
                      .e = charge ? jwl.energy / jwl.density : air_e});
    light_time_.push_back(charge ? 0.5 * (r_[i] + r_[i + 1]) / jwl.detonation_speed : 0.0);
  }
  node_mass_.assign(r_.size(), 0.0);
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    node_mass_[i] += 0.5 * cells_[i].mass;
    node_mass_[i + 1] += 0.5 * cells_[i].mass;
  }
  const double volume = shell_volume(0.0, radius);
  charged_ = {.mass = (jwl.density - ambient.rho) * volume,
              .energy = (jwl.energy - ambient.p / (gas.heat_capacity_ratio - 1.0)) * volume};
  close(cells_, r_, u_, 0.0);
  record(0.0);
}

/// Pressure, sound speed and artificial viscosity of all cells from their energies.
void JwlWave::close(std::vector<Cell>& cells, const std::vector<double>& r,
                    const std::vector<double>& u, double t) const {
  const double gamma = gas().heat_capacity_ratio;
  const double h = r_[static_cast<std::size_t>(n_charge_)] / n_charge_;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    Cell& cell = cells[i];
    const double rho = cell.mass / shell_volume(r[i], r[i + 1]);
    if (static_cast<int>(i) < n_charge_) {
      const double V = jwl_.density / rho, E = cell.e * jwl_.density;
      const double burnt = std::clamp(
          (t - light_time_[i]) * jwl_.detonation_speed / (burn_width * h) + 0.5, 0.0, 1.0);
      const double a = jwl_.A * std::exp(-jwl_.R1 * V), b = jwl_.B * std::exp(-jwl_.R2 * V);
      const double cold =
          a * (1.0 - jwl_.omega / (jwl_.R1 * V)) + b * (1.0 - jwl_.omega / (jwl_.R2 * V));
      const double p = cold + jwl_.omega * E / V;
      // c^2 = dp/drho at constant entropy = V^2/rho0 (-dp/dV + p dp/dE).
      const double slope =
          a * (-jwl_.R1 * (1.0 - jwl_.omega / (jwl_.R1 * V)) + jwl_.omega / (jwl_.R1 * V * V)) +
          b * (-jwl_.R2 * (1.0 - jwl_.omega / (jwl_.R2 * V)) + jwl_.omega / (jwl_.R2 * V * V)) -
          jwl_.omega * E / (V * V);
      cell.p = burnt * std::max(p, 0.0);
      cell.c = std::sqrt(std::max(V * V / jwl_.density * (p * jwl_.omega / V - slope), 1.0));
      if (burnt <= 0.0) cell.p = ambient().p;  // solid at rest
    } else {
      cell.p = (gamma - 1.0) * rho * cell.e;
      cell.c = std::sqrt(gamma * cell.p / rho);
    }
    const double jump = u[i] - u[i + 1];
    cell.q = jump > 0.0 ? rho * jump * (q_quadratic * jump + q_linear * cell.c) : 0.0;
  }
}

double JwlWave::stable_step() const {
  double dt = 1e300;
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    const double jump = std::abs(u_[i] - u_[i + 1]);
    dt = std::min(dt, (r_[i + 1] - r_[i]) / (cells_[i].c + 2.0 * q_quadratic * jump));
  }
  // Unburnt explosive is lit at this speed.
  if (time() < light_time_[static_cast<std::size_t>(n_charge_ - 1)] * 1.2)
    dt = std::min(dt, (r_[1] - r_[0]) / jwl_.detonation_speed);
  return cfl * dt;
}

void JwlWave::step() {
  const double dt = stable_step(), t = time() + dt, p0 = ambient().p;
  std::vector<double> r_new = r_, u_new = u_;
  std::vector<Cell> next = cells_;
  for (int pass = 0; pass < 2; ++pass) {
    // Forces from the pressures of the start (predictor), then from the mean of both ends
    // (corrector); the same force and the mean velocity give the work, so that energy is kept
    // exactly.
    std::vector<double> pressure(cells_.size()), area(r_.size());
    for (std::size_t i = 0; i < cells_.size(); ++i) {
      pressure[i] = pass == 0 ? cells_[i].p + cells_[i].q
                              : 0.5 * (cells_[i].p + cells_[i].q + next[i].p + next[i].q);
    }
    for (std::size_t i = 0; i < r_.size(); ++i) area[i] = swept_area(r_[i], r_new[i]);
    for (std::size_t i = 1; i < r_.size(); ++i) {
      const double outside = i < cells_.size() ? pressure[i] : p0;
      u_new[i] = u_[i] + dt * area[i] * (pressure[i - 1] - outside) / node_mass_[i];
    }
    u_new.back() = 0.0;
    for (std::size_t i = 0; i < r_.size(); ++i) r_new[i] = r_[i] + 0.5 * dt * (u_[i] + u_new[i]);
    for (std::size_t i = 0; i < cells_.size(); ++i) {
      const double work =
          area[i + 1] * 0.5 * (u_[i + 1] + u_new[i + 1]) - area[i] * 0.5 * (u_[i] + u_new[i]);
      next[i].e = cells_[i].e - dt * pressure[i] * work / cells_[i].mass;
    }
    close(next, r_new, u_new, t);
  }
  r_.swap(r_new);
  u_.swap(u_new);
  cells_.swap(next);
  record(t);
}

void JwlWave::record(double t) {
  Snapshot s{.t = t, .r = {}, .state = {}};
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    const double rho = cells_[i].mass / shell_volume(r_[i], r_[i + 1]);
    s.r.push_back(0.5 * (r_[i] + r_[i + 1]));
    s.state.push_back({rho, 0.5 * (u_[i] + u_[i + 1]), cells_[i].p, rho * cells_[i].e});
  }
  keep(std::move(s));
}

RadialTotals JwlWave::totals() const {
  double mass = 0.0, energy = 0.0;
  for (const Cell& c : cells_) {
    mass += c.mass;
    energy += c.mass * c.e;
  }
  for (std::size_t i = 0; i < r_.size(); ++i) energy += 0.5 * node_mass_[i] * u_[i] * u_[i];
  const double volume = shell_volume(0.0, r_.back());
  return {mass - ambient().rho * volume,
          energy - ambient().p / (gas().heat_capacity_ratio - 1.0) * volume};
}

}  // namespace ocublast::flow
