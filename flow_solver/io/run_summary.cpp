#include <array>
#include <nlohmann/json.hpp>

#include "coupler/base/hdf5_file.hpp"
#include "flow_solver/io/run.hpp"

namespace ocublast::flow::inline OCU_PRECISION {
namespace {

using Json = nlohmann::ordered_json;

Json quantity(const std::string& name, double value, const std::string& unit) {
  return {{"name", name}, {"value", value}, {"unit", unit}};
}

}  // namespace

/// The sums in the order in which checkpoints hold them.
void FlowRun::keep_sums() {
  const auto& s = sums_;
  clock_.sums = {s.cells, s.redone, s.marked, s.floored, s.active_sum};
  for (const auto& w : s.walls)
    clock_.sums.insert(clock_.sums.end(),
                       {w.peak, w.peak_time, w.power, w.force[0], w.force[1], w.force[2]});
}

void FlowRun::restore_sums() {
  auto& s = sums_;
  std::size_t i = 0;
  for (double* value : {&s.cells, &s.redone, &s.marked, &s.floored, &s.active_sum})
    *value = clock_.sums.at(i++);
  for (auto& w : s.walls)
    for (double* value : {&w.peak, &w.peak_time, &w.power, &w.force[0], &w.force[1], &w.force[2]})
      *value = clock_.sums.at(i++);
}

void FlowRun::write_summary() {
  writer_.finish();
  if (out_.empty()) return;
  const std::uint64_t fallbacks = bodies_ ? bodies_->n_fallbacks() : 0;
  if (!ranks_->root()) return;
  Json quantities = Json::array();
  for (const StartQuantity& q : start_quantities_)
    quantities.push_back(quantity(q.name, q.value, q.unit));
  const auto add_wave = [&](const std::string& name, const ProbeResult& result) {
    quantities.push_back(quantity(name + "_peak_overpressure", result.peak, "Pa"));
    if (result.arrival < 0.0) return;
    quantities.push_back(quantity(name + "_arrival", result.arrival, "s"));
    quantities.push_back(quantity(name + "_impulse", result.impulse, "Pa s"));
  };
  for (std::size_t b = 0; b < probes_.probes().size(); ++b)
    add_wave(probes_.probes()[b].name, probes_.result(b));
  for (std::size_t s = 0; s < surface_places_.size(); ++s)
    add_wave(case_.surface_probes[s].name,
             condense_history(surface_times_, surface_history_, s, surface_places_.size()));
  const auto index = [&](const std::string& name) {
    std::size_t b = 0;
    while (probes_.probes()[b].name != name) ++b;
    return b;
  };
  for (const auto& speed : case_.front_speeds) {
    const std::size_t a = index(speed.from);
    const std::size_t b = index(speed.to);
    const double t = probes_.result(b).arrival - probes_.result(a).arrival;
    if (probes_.result(b).arrival < 0.0 || t <= 0.0) continue;
    double distance = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
      const double d = probes_.probes()[b].position[i] - probes_.probes()[a].position[i];
      distance += d * d;
    }
    quantities.push_back(quantity(speed.name, std::sqrt(distance) / t, "m/s"));
  }
  if (balance_) {
    quantities.push_back(quantity("gas_leaked_through_walls", balance_->leaked_mass(), "kg"));
    quantities.push_back(
        quantity("gas_leaked_through_walls_largest", balance_->largest_leak(), "kg"));
    for (std::size_t b = 0; b < case_.bodies.size(); ++b)
      for (std::size_t a = 0; a < 3; ++a)
        quantities.push_back(quantity(case_.bodies[b].name + "_impulse_" + "xyz"[a],
                                      balance_ -> impulse(b)[a], "N s"));
  }
  for (std::size_t k = 0; k < coupled_bodies_.size(); ++k) {
    const auto& name = case_.bodies[coupled_bodies_[k].body].name;
    quantities.push_back(quantity(name + "_peak_wall_overpressure", sums_.walls[k].peak, "Pa"));
    quantities.push_back(
        quantity(name + "_peak_wall_overpressure_time", sums_.walls[k].peak_time, "s"));
    quantities.push_back(
        quantity(name + "_exposed_area", loads_[coupled_bodies_[k].body].exposed_area, "m^2"));
  }
  const double steps = static_cast<double>(std::max<std::int64_t>(clock_.step, 1));
  Json performance = {
      {"flow_nodes", flow_.grid().n_cells()},
      {"flow_fluid_nodes", fluid_nodes_},
      {"flow_steps", clock_.step},
      {"flow_compute_s", compute_seconds_},
      {"flow_output_s", output_seconds_},
      {"flow_setup_s", setup_seconds_},
      {"flow_cells_per_s", compute_seconds_ > 0.0 ? sums_.cells / compute_seconds_ : 0.0},
      {"flow_active_share", sums_.active_sum / steps},
      {"flow_instruction_set", flow_.instruction_set()},
      {"flow_threads", case_.options.threads},
      {"flow_ranks", ranks_->size()},
      {"flow_redone_steps", sums_.redone},
      {"flow_marked_nodes_per_step", sums_.marked / steps},
      {"flow_floored_nodes", sums_.floored},
      {"flow_ghost_fallbacks", fallbacks}};
  replace_file(out_ / "flow_summary.json",
               Json{{"quantities", quantities}, {"performance", performance}}.dump(1) + "\n");
}

}  // namespace ocublast::flow
