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
  if (!coupled_) return;
  const auto& mass = mass_;
  std::vector<double> impedance(mass.size(), 1e300);  // smallest rho c of the cells at a node
  for (std::size_t number = 0; number < mesh().n_cells(); ++number) {
    const auto& material = assembly_->material_of_cell(number);
    for (const auto n : mesh().cell(number).nodes)
      impedance[index(n)] =
          std::min(impedance[index(n)], material.density * material.sound_speed());
  }
  auto& team = assembly_->team();
  team.take_least_nodal(impedance);
  const auto& nodes = loads_.back().surface.nodes();
  const auto own_areas = loads_.back().surface.nodal_areas();
  std::vector<double> areas(mass.size(), 0.0);
  double area = 0.0;
  for (std::size_t v = 0; v < nodes.size(); ++v) {
    areas[index(nodes[v])] = own_areas[v];
    area += own_areas[v];
  }
  team.add_nodal(areas);
  double total = 0.0;
  for (std::size_t n = 0; n < mass.size(); ++n)
    if (team.counts(n)) total += mass[n];
  for (const auto n : nodes)
    interface_inertia_.push_back({mass[index(n)] / areas[index(n)], impedance[index(n)]});
  body_mass_per_area_ = team.sum(total) / team.sum(area);
}

double SolidRun::mass_per_area(double window) const {
  double smallest = body_mass_per_area_;
  for (const auto& [layer, impedance] : interface_inertia_)
    smallest = std::min(smallest, layer + impedance * window);
  return team().least(smallest);
}

EnergyTable SolidRun::compute_energies(const CellResults& cells) {
  enum {
    kinetic,
    square,
    internal,
    hourglass,
    stored,
    viscous,
    relaxation,
    damping,
    external,
    coupling
  };
  std::array<double, coupling + 2> part{};
  for (std::size_t n = 0; n < mass_.size(); ++n)
    for (std::size_t i = 0; team().counts(n) && i < 3; ++i) {
      const std::size_t at = 4 * n + i;
      part[kinetic] += 0.5 * mass_[n] * state_.velocity[at] * state_.velocity[at];
      part[square] += mass_[n] * state_.acceleration[at] * state_.acceleration[at];
    }
  for (std::size_t cell = 0; cell < mesh().n_cells(); ++cell) {
    part[internal] += cells[cell * n_evaluated + strain_energy];
    part[hourglass] += cells[cell * n_evaluated + hourglass_energy];
  }
  part[stored] = sums_.stored;
  part[viscous] = sums_.viscous;
  part[relaxation] = sums_.relaxation;
  part[damping] = sums_.damping;
  part[external] = sums_.external;
  part[coupling] = sums_.coupling;
  part[coupling + 1] = sums_.initial;
  team().sum(part);
  EnergyTable e{.kinetic = part[kinetic],
                .kinetic_scheme = part[kinetic] -
                                  sums_.last_step * sums_.last_step / 8.0 * part[square] +
                                  sums_.scheme_jumps,
                .internal = part[internal],
                .hourglass = part[hourglass],
                .relaxation = part[relaxation],
                .viscous = part[viscous],
                .spring = part[stored],
                .damping = part[damping],
                .external = part[external],
                .coupling = part[coupling],
                .initial = part[coupling + 1]};
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
    if (!team().counts(n)) continue;
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
  team().sum(sum);
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
