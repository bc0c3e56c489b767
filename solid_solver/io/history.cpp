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
  coupling,
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
                                              "coupling_work_J",
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

/// Numbers of a cell that tables hold: of a tissue the least, the volume mean and the largest.
enum CellColumn {
  pressure,
  von_mises,
  principal_stress,
  principal_strain,
  deviatoric_norm,
  volume_ratio,
  energy_density,
  n_cell_columns
};
struct ColumnName {
  const char* quantity;
  const char* unit;
};
constexpr ColumnName cell_columns[n_cell_columns] = {
    {"pressure", "Pa"},        {"von_mises", "Pa"},       {"principal_stress", "Pa"},
    {"principal_strain", "1"}, {"deviatoric_norm", "Pa"}, {"volume_ratio", "1"},
    {"energy_density", "J_m3"}};
enum Statistic { least, mean_value, most, n_statistics };
constexpr const char* statistics[n_statistics] = {"min", "mean", "max"};
/// Place of a statistic among the columns of a tissue.
constexpr std::size_t tissue_column(CellColumn quantity, Statistic statistic) {
  return n_statistics * static_cast<std::size_t>(quantity) + static_cast<std::size_t>(statistic);
}

const std::vector<std::string> node_columns{
    "displacement_x_m",    "displacement_y_m",   "displacement_z_m", "velocity_x_m_s",
    "velocity_y_m_s",      "velocity_z_m_s",     "displacement_m",   "acceleration_x_m_s2",
    "acceleration_y_m_s2", "acceleration_z_m_s2"};

std::array<double, n_cell_columns> cell_values(const double* cell, double volume) {
  const auto s = cell_scalars(cell);
  return {s.pressure,
          s.von_mises,
          s.principal_stress,
          s.principal_strain,
          s.deviatoric_norm,
          1.0 + cell[dilatation_mean],
          cell[strain_energy] / volume};
}

std::vector<std::string> columns_of(const HistoryKeys& keys) {
  std::vector<std::string> columns;
  if (!keys.tissue.empty()) {
    for (const auto& c : cell_columns)
      for (const char* statistic : statistics)
        columns.push_back(fmt::format("{}_{}_{}", c.quantity, statistic, c.unit));
  } else if (!keys.position.empty()) {
    for (const auto& c : cell_columns) columns.push_back(fmt::format("{}_{}", c.quantity, c.unit));
  } else {
    columns = node_columns;
  }
  return columns;
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
                e.coupling,
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
  std::array<double, 2 * n_cell_columns> extremes{};  // the largest, then the negative least
  extremes.fill(-1e300);
  std::array<double, n_cell_columns + 1> sum{};  // volume integrals, volume
  for (std::size_t k = 0; k < item.cells.size(); ++k) {
    const auto values = cell_values(&cells[item.cells[k] * n_evaluated], item.volumes[k]);
    for (std::size_t c = 0; c < n_cell_columns; ++c) {
      extremes[c] = std::max(extremes[c], values[c]);
      extremes[n_cell_columns + c] = std::max(extremes[n_cell_columns + c], -values[c]);
      sum[c] += item.volumes[k] * values[c];
    }
    sum[n_cell_columns] += item.volumes[k];
  }
  team.most(extremes);
  team.sum(sum);
  for (std::size_t c = 0; c < n_cell_columns; ++c) {
    if (!item.keys.tissue.empty()) {
      row.push_back(-extremes[n_cell_columns + c]);
      row.push_back(sum[c] / sum[n_cell_columns]);
    }
    row.push_back(extremes[c]);
  }
}

void History::sample_nodes(const Item& item, const SolidRun& run, std::vector<double>& row) const {
  std::array<double, 9> mean{};
  for (const auto n : item.nodes)
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t at = 4 * static_cast<std::size_t>(n) + i;
      mean[i] += run.state().displacement[at] / item.n_nodes;
      mean[3 + i] += run.state().velocity[at] / item.n_nodes;
      mean[6 + i] += run.state().acceleration[at] / item.n_nodes;
    }
  run.team().sum(mean);
  row.insert(row.end(), mean.begin(), mean.begin() + 6);
  row.push_back(std::hypot(mean[0], mean[1], mean[2]));
  row.insert(row.end(), mean.begin() + 6, mean.end());
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
    const auto pressure_mean = c + tissue_column(pressure, mean_value);
    list.push_back({name + "_pressure_mean_peak", probes_.largest(pressure_mean), "Pa"});
    list.push_back({name + "_pressure_mean_peak_" + mean_name,
                    probes_.largest_running_mean(pressure_mean, running_mean_), "Pa"});
    const auto add = [&](const char* quantity, CellColumn column, const char* unit) {
      list.push_back({name + quantity, probes_.largest(c + tissue_column(column, most)), unit});
    };
    add("_pressure_max_peak", pressure, "Pa");
    add("_von_mises_peak", von_mises, "Pa");
    add("_principal_stress_peak", principal_stress, "Pa");
    add("_principal_strain_peak", principal_strain, "1");
  } else if (!item.keys.position.empty()) {
    list.push_back({name + "_pressure_peak", probes_.largest(c + pressure), "Pa"});
    list.push_back({name + "_pressure_peak_" + mean_name,
                    probes_.largest_running_mean(c + pressure, running_mean_), "Pa"});
    list.push_back({name + "_von_mises_peak", probes_.largest(c + von_mises), "Pa"});
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
