#include "solid_solver/io/history.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "solid_solver/elements/cell_stress.hpp"
#include "solid_solver/mesh/cell_geometry.hpp"

namespace ocublast::solid {
namespace {

enum Global {
  time_column,
  kinetic,
  internal,
  hourglass,
  viscous,
  relaxation,
  spring,
  damping,
  external,
  initial,
  error,
  momentum_x,
  momentum_y,
  momentum_z,
  angular_x,
  angular_y,
  angular_z,
  mean_x,
  mean_y,
  mean_z,
  largest_displacement,
  largest_speed,
  stable_step,
  n_globals
};

const std::vector<std::string> global_columns{"time_s",
                                              "kinetic_J",
                                              "internal_J",
                                              "hourglass_J",
                                              "viscous_J",
                                              "relaxation_J",
                                              "spring_J",
                                              "damping_J",
                                              "external_work_J",
                                              "initial_J",
                                              "energy_error_1",
                                              "momentum_x_N_s",
                                              "momentum_y_N_s",
                                              "momentum_z_N_s",
                                              "angular_momentum_x_N_m_s",
                                              "angular_momentum_y_N_m_s",
                                              "angular_momentum_z_N_m_s",
                                              "displacement_mean_x_m",
                                              "displacement_mean_y_m",
                                              "displacement_mean_z_m",
                                              "displacement_largest_m",
                                              "speed_largest_m_s",
                                              "stable_step_s"};

const std::vector<std::string> tissue_columns{
    "pressure_min_Pa",  "pressure_mean_Pa",        "pressure_max_Pa",       "von_mises_mean_Pa",
    "von_mises_max_Pa", "principal_stress_max_Pa", "principal_strain_max_1"};
const std::vector<std::string> place_columns{"pressure_Pa", "von_mises_Pa", "principal_stress_Pa",
                                             "principal_strain_1"};
const std::vector<std::string> node_columns{
    "displacement_x_m", "displacement_y_m", "displacement_z_m", "velocity_x_m_s",
    "velocity_y_m_s",   "velocity_z_m_s",   "displacement_m"};

const std::vector<std::string>& columns_of(const HistoryKeys& keys) {
  return !keys.tissue.empty()     ? tissue_columns
         : !keys.position.empty() ? place_columns
                                  : node_columns;
}

/// The cell nearest to a place, alone in a list on the rank that has it; elsewhere none.
std::vector<std::size_t> nearest_cell(const SolidMesh& mesh, const Team& team,
                                      const std::vector<double>& x) {
  std::size_t found = 0;
  double least = 1e300;
  for (std::size_t c = 0; c < mesh.n_cells(); ++c) {
    const auto centre = cell_centre(mesh, c);
    const double d = std::hypot(centre[0] - x[0], centre[1] - x[1], centre[2] - x[2]);
    if (d >= least) continue;
    least = d;
    found = c;
  }
  const bool near = team.least(least) == least;
  const auto number = static_cast<double>(team.cell_number(found));
  if (team.least(near ? number : 1e300) != number) return {};
  return {found};
}

}  // namespace

std::vector<History::Item> History::make_items(const SolidRun& run, const SolidCase& from) {
  std::vector<Item> items;
  const auto& mesh = run.mesh();
  for (const auto& keys : from.histories) {
    Item item{.keys = keys};
    if (!keys.tissue.empty()) {
      for (std::size_t c = 0; c < mesh.n_cells(); ++c)
        if (mesh.tissues[static_cast<std::size_t>(mesh.tissue_of(c))] == keys.tissue)
          item.cells.push_back(c);
    } else if (!keys.position.empty()) {
      item.cells = nearest_cell(mesh, run.team(), keys.position);
    } else {
      for (const auto n : mesh.node_sets.at(keys.nodes))
        if (run.team().counts(static_cast<std::size_t>(n))) item.nodes.push_back(n);
      item.n_nodes = run.team().sum(static_cast<double>(item.nodes.size()));
    }
    for (const auto c : item.cells) item.volumes.push_back(cell_volume(mesh, c));
    items.push_back(std::move(item));
  }
  return items;
}

std::vector<std::string> History::probe_columns(std::vector<Item>& items) {
  std::vector<std::string> columns{"time_s"};
  for (auto& item : items) {
    item.column = columns.size();
    for (const auto& c : columns_of(item.keys)) columns.push_back(item.keys.name + "_" + c);
  }
  return columns;
}

History::History(const SolidRun& run, const SolidCase& from)
    : running_mean_(from.output.running_mean),
      items_(make_items(run, from)),
      globals_(global_columns),
      probes_(probe_columns(items_)) {}

void History::sample(SolidRun& run, const CellResults& cells) {
  const auto e = run.compute_energies(cells);
  const auto p = run.momenta();
  const auto& state = run.state();
  const auto& team = run.team();
  std::array<double, 3> mean{};
  std::array<double, 2> largest{};  // squares of displacement and speed
  const auto n_nodes = static_cast<double>(team.n_nodes(state.n_nodes()));
  for (std::size_t n = 0; n < state.n_nodes(); ++n) {
    if (!team.counts(n)) continue;
    const double* d = &state.displacement[4 * n];
    const double* v = &state.velocity[4 * n];
    for (std::size_t i = 0; i < 3; ++i) mean[i] += d[i] / n_nodes;
    largest[0] = std::max(largest[0], d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    largest[1] = std::max(largest[1], v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
  }
  team.sum(mean);
  team.most(largest);
  globals_.add({state.time,
                e.kinetic,
                e.internal,
                e.hourglass,
                e.viscous,
                e.relaxation,
                e.spring,
                e.damping,
                e.external,
                e.initial,
                e.error,
                p[0],
                p[1],
                p[2],
                p[3],
                p[4],
                p[5],
                mean[0],
                mean[1],
                mean[2],
                std::sqrt(largest[0]),
                std::sqrt(largest[1]),
                run.stable_step()});
  std::vector<double> row{state.time};
  for (const auto& item : items_)
    if (item.keys.nodes.empty())
      sample_cells(item, team, cells, row);
    else
      sample_nodes(item, run, row);
  probes_.add(row);
}

void History::sample_cells(const Item& item, const Team& team, const CellResults& cells,
                           std::vector<double>& row) const {
  enum { least_pressure, pressure, von_mises, principal_stress, principal_strain };
  std::array<double, principal_strain + 1> most{};  // of the least pressure its negative
  most.fill(-1e300);
  std::array<double, 3> sum{};  // pressure, von Mises, volume
  for (std::size_t k = 0; k < item.cells.size(); ++k) {
    const auto s = cell_scalars(&cells[item.cells[k] * n_evaluated]);
    most[least_pressure] = std::max(most[least_pressure], -s.pressure);
    most[pressure] = std::max(most[pressure], s.pressure);
    most[von_mises] = std::max(most[von_mises], s.von_mises);
    most[principal_stress] = std::max(most[principal_stress], s.principal_stress);
    most[principal_strain] = std::max(most[principal_strain], s.principal_strain);
    sum[0] += item.volumes[k] * s.pressure;
    sum[1] += item.volumes[k] * s.von_mises;
    sum[2] += item.volumes[k];
  }
  team.most(most);
  team.sum(sum);
  if (item.keys.tissue.empty())
    row.insert(row.end(),
               {most[pressure], most[von_mises], most[principal_stress], most[principal_strain]});
  else
    row.insert(row.end(), {-most[least_pressure], sum[0] / sum[2], most[pressure], sum[1] / sum[2],
                           most[von_mises], most[principal_stress], most[principal_strain]});
}

void History::sample_nodes(const Item& item, const SolidRun& run, std::vector<double>& row) const {
  std::array<double, 6> mean{};
  for (const auto n : item.nodes)
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t at = 4 * static_cast<std::size_t>(n) + i;
      mean[i] += run.state().displacement[at] / item.n_nodes;
      mean[3 + i] += run.state().velocity[at] / item.n_nodes;
    }
  run.team().sum(mean);
  row.insert(row.end(), mean.begin(), mean.end());
  row.push_back(std::hypot(mean[0], mean[1], mean[2]));
}

void History::write(const std::filesystem::path& out) {
  globals_.append_to(out / "solid_globals.csv");
  if (!items_.empty()) probes_.append_to(out / "solid_probes.csv");
}

void History::add_quantities(const Item& item, std::vector<Quantity>& list) const {
  const auto& name = item.keys.name;
  const auto c = item.column;
  const auto mean_name = fmt::format("{:g}us", 1e6 * running_mean_);
  if (!item.keys.tissue.empty()) {
    list.push_back({name + "_pressure_mean_peak", probes_.largest(c + 1), "Pa"});
    list.push_back({name + "_pressure_mean_peak_" + mean_name,
                    probes_.largest_running_mean(c + 1, running_mean_), "Pa"});
    list.push_back({name + "_pressure_max_peak", probes_.largest(c + 2), "Pa"});
    list.push_back({name + "_von_mises_peak", probes_.largest(c + 4), "Pa"});
    list.push_back({name + "_principal_stress_peak", probes_.largest(c + 5), "Pa"});
    list.push_back({name + "_principal_strain_peak", probes_.largest(c + 6), "1"});
  } else if (!item.keys.position.empty()) {
    list.push_back({name + "_pressure_peak", probes_.largest(c), "Pa"});
    list.push_back({name + "_pressure_peak_" + mean_name,
                    probes_.largest_running_mean(c, running_mean_), "Pa"});
    list.push_back({name + "_von_mises_peak", probes_.largest(c + 1), "Pa"});
  } else {
    list.push_back({name + "_displacement_peak", probes_.largest(c + 6), "m"});
    for (std::size_t i = 0; i < 3; ++i)
      list.push_back(
          {fmt::format("{}_displacement_{}_extreme", name, "xyz"[i]), probes_.extreme(c + i), "m"});
  }
}

std::vector<Quantity> History::quantities() const {
  std::vector<Quantity> list;
  for (const auto& item : items_) add_quantities(item, list);
  const std::size_t last = globals_.n_rows() - 1;
  list.push_back({"solid_displacement_largest", globals_.largest(largest_displacement), "m"});
  for (std::size_t i = 0; i < 3; ++i)
    list.push_back({fmt::format("solid_displacement_mean_{}_extreme", "xyz"[i]),
                    globals_.extreme(mean_x + i), "m"});
  list.push_back({"solid_speed_largest", globals_.largest(largest_speed), "m/s"});
  list.push_back({"solid_kinetic_energy_peak", globals_.largest(kinetic), "J"});
  list.push_back({"solid_internal_energy_peak", globals_.largest(internal), "J"});
  list.push_back({"solid_external_work", globals_.at(last, external), "J"});
  list.push_back({"solid_viscous_dissipation", globals_.at(last, viscous), "J"});
  list.push_back({"solid_energy_error_extreme", globals_.extreme(error), "1"});
  return list;
}

}  // namespace ocublast::solid
