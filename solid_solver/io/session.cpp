#include "solid_solver/io/session.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "coupler/base/hdf5_file.hpp"
#include "solid_solver/mesh/wet_surface.hpp"

namespace ocublast::solid {
namespace {

constexpr const char* isa_names[] = {"baseline", "avx2", "avx512"};

}  // namespace

bool is_due(double t, double due) {
  return t >= due * (1.0 - 1e-9);
}

double next_due(double t, double every) {
  // A time within rounding of a multiple counts as that multiple.
  return every * (std::floor(t / every * (1.0 + 1e-12) + 1e-9) + 1.0);
}

Session::Session(SolidCase from, Options options, std::shared_ptr<spdlog::logger> log)
    : case_(std::move(from)),
      options_(std::move(options)),
      log_(std::move(log)),
      run_(case_.setup),
      whole_(case_.whole_mesh, run_),
      history_(run_, case_),
      fields_(options_.out, case_.output.fields) {
  find_equilibrium();
  set_initial_velocities();
  progress_.next_checkpoint = case_.output.checkpoint_every;
}

void Session::find_equilibrium() {
  const auto& keys = case_.equilibrium;
  if (!keys.wanted || !options_.equilibrium) return;
  const auto relaxed = run_.relax(keys.tolerance, static_cast<std::size_t>(keys.most_steps));
  log_->info("equilibrium after {} steps, residual {:.3g} of the loads", relaxed.steps,
             relaxed.residual);
}

void Session::set_initial_velocities() {
  for (const auto& v : case_.initial_velocities)
    for (const auto n : v.nodes) run_.set_velocity(n, v.velocity);
}

WindowResult Session::advance(const Window& window) {
  const Stopwatch watch(wall_.compute);
  const auto result = run_.advance(window);
  ++progress_.window;
  return result;
}

void Session::keep() {
  const auto arrays = run_.checkpoint_arrays();
  kept_.resize(arrays.size());
  for (std::size_t k = 0; k < arrays.size(); ++k)
    kept_[k].assign(arrays[k].values.begin(), arrays[k].values.end());
  kept_progress_ = progress_;
}

void Session::rewind() {
  auto arrays = run_.checkpoint_arrays();
  for (std::size_t k = 0; k < arrays.size(); ++k)
    std::copy(kept_[k].begin(), kept_[k].end(), arrays[k].values.begin());
  run_.restored();
  progress_ = kept_progress_;
}

void Session::write_due(bool last) {
  const double t = run_.state().time;
  const bool rows = last || is_due(t, progress_.next_history);
  const bool fields = last || is_due(t, progress_.next_field);
  if (!rows && !fields) return;
  {
    const Stopwatch watch(wall_.tables);
    run_.assembly().evaluate(run_.state().displacement, cells_);
    const bool sampled = history_.globals().n_rows() > 0 &&
                         history_.globals().at(history_.globals().n_rows() - 1, 0) >= t;
    if (rows && !sampled) history_.sample(run_, cells_);
    if (rows) progress_.next_history = next_due(t, case_.output.history_every);
  }
  const Stopwatch watch(wall_.output);
  if (!fields) return;
  progress_.next_field = next_due(t, case_.output.every);
  if (fields_.times().empty() || fields_.times().back() < t) {
    const auto state = whole_.gather(run_, cells_);
    if (root())
      fields_.write(state);
    else
      fields_.skip(t);
  }
  if (root()) history_.write(options_.out);
}

void Session::write_checkpoint_to(const std::filesystem::path& directory) {
  const Stopwatch watch(wall_.checkpoint);
  write_checkpoint(directory, {run_, history_, fields_, progress_, options_.case_hash});
}

void Session::resume_from(const std::filesystem::path& directory) {
  read_checkpoint(directory, {run_, history_, fields_, progress_, options_.case_hash});
  log_->info("resumed window {} at t = {:.9g} s from {}", progress_.window, run_.state().time,
             directory.string());
}

std::string Session::bounded_by() {
  const auto bound = run_.smallest_element();
  return fmt::format("{}, L/c = {:.4g} s; step {:.3f} L/c", bound.place, bound.transit,
                     run_.stable_step() / bound.transit);
}

std::string Session::element_counts() {
  std::string text;
  for (const auto& type : make_elements()) {
    double n = 0.0;
    for (const auto& block : run_.assembly().blocks())
      if (block.type().name == type.name) n += static_cast<double>(block.n_elements());
    n = run_.team().sum(n);
    if (n > 0.0) text += fmt::format("{}{} {}", text.empty() ? "" : ", ", n, type.name);
  }
  return text;
}

void Session::write_summary() {
  nlohmann::json quantities = nlohmann::json::array();
  for (const auto& q : history_.quantities())
    quantities.push_back({{"name", q.name}, {"value", q.value}, {"unit", q.unit}});
  const auto& team = run_.team();
  const double bytes = team.sum(static_cast<double>(run_.assembly().bytes()));
  const auto bound = bounded_by();
  std::array<double, 2> ignored{run_.sums().ignored_pressure, run_.sums().ignored_impulse};
  team.most(ignored);
  quantities.push_back(
      {{"name", "solid_ignored_overpressure"}, {"value", ignored[0]}, {"unit", "Pa"}});
  quantities.push_back(
      {{"name", "solid_ignored_impulse"}, {"value", ignored[1]}, {"unit", "Pa s"}});
  if (!root()) return;
  const auto n_cells = static_cast<double>(whole_.mesh().n_cells());
  const double updates = run_.sums().steps * n_cells;
  const double total =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  const nlohmann::json performance{
      {"solid_elements", whole_.mesh().n_cells()},
      {"solid_nodes", whole_.mesh().n_nodes()},
      {"solid_steps", run_.sums().steps},
      {"solid_steps_slept", run_.sums().steps_slept},
      {"solid_elements_per_s", wall_.compute > 0.0 ? updates / wall_.compute : 0.0},
      {"solid_ranks", team.size()},
      {"solid_rank_imbalance", case_.imbalance},
      {"solid_threads", run_.assembly().threads()},
      {"solid_kernels", isa_names[static_cast<std::size_t>(run_.assembly().instruction_set())]},
      {"solid_bytes_per_element", bytes / n_cells},
      {"solid_stable_step_s", run_.stable_step()},
      {"solid_bounded_by", bound},
      {"solid_wall_s", total},
      {"solid_wall_compute_s", wall_.compute},
      {"solid_wall_tables_s", wall_.tables},
      {"solid_wall_output_s", wall_.output},
      {"solid_wall_checkpoint_s", wall_.checkpoint},
      {"solid_wall_waiting_s", wall_.waiting}};
  replace_file(
      options_.out / "solid_summary.json",
      nlohmann::json{{"quantities", quantities}, {"performance", performance}}.dump(2) + "\n");
}

std::string Session::describe() {
  const auto& team = run_.team();
  double mass = 0.0;
  for (std::size_t n = 0; n < run_.nodal_mass().size(); ++n)
    if (team.counts(n)) mass += run_.nodal_mass()[n];
  mass = team.sum(mass);
  const auto counts = element_counts();
  const auto bound = bounded_by();
  if (!root()) return {};
  std::string text = fmt::format(
      "solid: {} elements ({}), {} nodes, {} tissues, {:.6g} kg, {} threads, {} kernels\n",
      whole_.mesh().n_cells(), counts, whole_.mesh().n_nodes(), whole_.mesh().tissues.size(), mass,
      run_.assembly().threads(),
      isa_names[static_cast<std::size_t>(run_.assembly().instruction_set())]);
  if (!team.alone())
    text += fmt::format("{} ranks, the dearest at {:.3f} of the mean cost\n", team.size(),
                        case_.imbalance);
  text += fmt::format("stable step {:.4g} s, {:.0f} steps to {:.4g} s; bounded by {}\n",
                      run_.stable_step(), std::ceil(case_.common.end_time / run_.stable_step()),
                      case_.common.end_time, bound);
  if (!case_.interface.empty()) {
    const auto surface = make_wet_surface(whole_.mesh(), case_.interface);
    text += fmt::format("interface {}: {} facets, {} vertices\n", case_.interface,
                        whole_.mesh().face_sets.at(case_.interface).size(), surface.nodes.size());
  }
  return text;
}

}  // namespace ocublast::solid
