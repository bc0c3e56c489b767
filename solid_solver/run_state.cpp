#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "coupler/base/errors.hpp"
#include "solid_solver/step.hpp"

namespace ocublast::solid {
namespace {

std::size_t index(std::int32_t n) {
  return static_cast<std::size_t>(n);
}

}  // namespace

const std::vector<std::int32_t>& SolidRun::interface_nodes() const {
  OCU_ASSERT(!loads_.empty() && loads_.back().coupled);  // the interface is the last load
  return loads_.back().surface.nodes();
}

void SolidRun::build_interface_inertia() {
  if (loads_.empty() || !loads_.back().coupled) return;
  const auto& mass = mass_;
  std::vector<double> impedance(mass.size(), 1e300);  // smallest rho c of the cells at a node
  for (std::size_t number = 0; number < mesh().n_cells(); ++number) {
    const auto& material = assembly_->material_of_cell(number);
    for (const auto n : mesh().cell(number).nodes)
      impedance[index(n)] =
          std::min(impedance[index(n)], material.density * material.sound_speed());
  }
  const auto areas = loads_.back().surface.nodal_areas();
  double area = 0.0;
  double total = 0.0;
  for (const double m : mass) total += m;
  for (std::size_t v = 0; v < areas.size(); ++v) {
    const auto n = index(loads_.back().surface.nodes()[v]);
    interface_inertia_.push_back({mass[n] / areas[v], impedance[n]});
    area += areas[v];
  }
  body_mass_per_area_ = total / area;
}

double SolidRun::mass_per_area(double window) const {
  double smallest = body_mass_per_area_;
  for (const auto& [layer, impedance] : interface_inertia_)
    smallest = std::min(smallest, layer + impedance * window);
  return smallest;
}

EnergyTable SolidRun::compute_energies(const CellResults& cells) {
  EnergyTable e;
  const auto& mass = mass_;
  double square = 0.0;
  for (std::size_t n = 0; n < mass.size(); ++n)
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t at = 4 * n + i;
      e.kinetic += 0.5 * mass[n] * state_.velocity[at] * state_.velocity[at];
      square += mass[n] * state_.acceleration[at] * state_.acceleration[at];
    }
  e.kinetic_scheme =
      e.kinetic - sums_.last_step * sums_.last_step / 8.0 * square + sums_.scheme_jumps;
  for (std::size_t cell = 0; cell < mesh().n_cells(); ++cell)
    e.internal += cells[cell * n_evaluated + strain_energy];
  for (std::size_t cell = 0; cell < mesh().n_cells(); ++cell)
    e.hourglass += cells[cell * n_evaluated + hourglass_energy];
  e.spring = sums_.stored;
  e.viscous = sums_.viscous;
  e.relaxation = sums_.relaxation;
  e.damping = sums_.damping;
  e.external = sums_.external;
  e.initial = sums_.initial;
  sums_.peak_energy = std::max({sums_.peak_energy, e.kinetic + e.internal + e.hourglass + e.spring,
                                std::abs(e.external), e.initial});
  const double left = e.kinetic_scheme + e.internal + e.hourglass + e.viscous + e.relaxation +
                      e.spring + e.damping - e.external - e.initial;
  e.error = sums_.peak_energy > 0.0 ? left / sums_.peak_energy : 0.0;
  if (!std::isfinite(e.error) || std::abs(e.error) > setup_.control.energy_error_limit)
    throw NumericsError(fmt::format(
        "energy balance lost at t = {:.9g} s: kinetic {:.6g}, internal {:.6g}, "
        "hourglass {:.6g}, viscous {:.6g}, relaxation {:.6g}, spring {:.6g}, damping "
        "{:.6g}, external {:.6g}, initial {:.6g} J; error {:.3g} of the peak, accepted "
        "{:.3g}; lower solid.integrator.safety",
        state_.time, e.kinetic, e.internal, e.hourglass, e.viscous, e.relaxation, e.spring,
        e.damping, e.external, e.initial, e.error, setup_.control.energy_error_limit));
  return e;
}

std::array<double, 6> SolidRun::momenta() const {
  std::array<double, 6> sum{};
  const auto& mass = mass_;
  for (std::size_t n = 0; n < mass.size(); ++n) {
    double x[3];
    double p[3];
    for (std::size_t i = 0; i < 3; ++i) {
      x[i] = mesh().nodes[3 * n + i] + state_.displacement[4 * n + i];
      p[i] = mass[n] * state_.velocity[4 * n + i];
      sum[i] += p[i];
    }
    sum[3] += x[1] * p[2] - x[2] * p[1];
    sum[4] += x[2] * p[0] - x[0] * p[2];
    sum[5] += x[0] * p[1] - x[1] * p[0];
  }
  return sum;
}

std::vector<SolidRun::NamedArray> SolidRun::checkpoint_arrays() {
  flags_ = {state_.time,
            awake_ ? 1.0 : 0.0,
            static_cast<double>(steps_since_look_),
            stable_step_,
            element_step_,
            omega_,
            static_cast<double>(steps_since_renewal_),
            started_ ? 1.0 : 0.0};
  static_assert(sizeof(RunningSums) % sizeof(double) == 0);
  std::vector<NamedArray> arrays{
      {"flags", flags_, "1"},
      {"sums", {reinterpret_cast<double*>(&sums_), sizeof(RunningSums) / sizeof(double)}, "1"},
      {"displacement", state_.displacement, "m"},
      {"velocity", state_.velocity, "m/s"},
      {"acceleration", state_.acceleration, "m/s^2"},
      {"residual", residual_, "N"}};
  std::size_t b = 0;
  for (auto& block : assembly_->blocks()) {
    arrays.push_back({fmt::format("bulk_viscosity/{}", b), block.memory(), "1"});
    if (!block.overlay_state().empty())
      arrays.push_back({fmt::format("overlay/{}", b), block.overlay_state(), "1"});
    ++b;
  }
  for (std::size_t k = 0; k < loads_.size(); ++k) {
    arrays.push_back({fmt::format("loads/{}/pressure", k), loads_[k].pressure, "Pa"});
    arrays.push_back({fmt::format("loads/{}/forces", k), loads_[k].forces, "N"});
    arrays.push_back({fmt::format("loads/{}/last_end", k), loads_[k].last_end, "Pa"});
  }
  for (std::size_t k = 0; k < forces_.size(); ++k)
    if (!forces_[k]->state().empty())
      arrays.push_back({fmt::format("forces/{}", k), forces_[k]->state(), "1"});
  for (std::size_t s = 0; s < prescribed_residual_.size(); ++s)
    arrays.push_back({fmt::format("prescribed/{}", s), prescribed_residual_[s], "N"});
  return arrays;
}

void SolidRun::restored() {
  state_.time = flags_[0];
  awake_ = flags_[1] != 0.0;
  steps_since_look_ = static_cast<int>(flags_[2]);
  stable_step_ = flags_[3];
  element_step_ = flags_[4];
  omega_ = flags_[5];
  steps_since_renewal_ = static_cast<int>(flags_[6]);
  started_ = flags_[7] != 0.0;
  assembly_->wake_all();
}

}  // namespace ocublast::solid
