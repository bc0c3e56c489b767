#include "flow_solver/io/run.hpp"

#include <fmt/format.h>
#include <omp.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdio>

#include "coupler/base/errors.hpp"
#include "coupler/base/hdf5_file.hpp"
#include "coupler/link/checkpoint_place.hpp"
#include "flow_solver/io/csv_table.hpp"
#include "flow_solver/io/make_bodies.hpp"
#include "flow_solver/io/plane_work.hpp"

namespace ocublast::flow::inline OCU_PRECISION {
namespace {

/// Set by SIGINT and SIGTERM of a run without a coupler: the only state a signal handler may touch.
volatile std::sig_atomic_t stop_asked = 0;
void ask_to_stop(int) {
  stop_asked = 1;
}

WallTransport wall_transport(const FlowOptions& options) {
  if (options.viscosity == Viscosity::none) return {};
  const bool sutherland = options.viscosity == Viscosity::sutherland;
  return {.viscosity = options.dynamic_viscosity,
          .sutherland_reference = sutherland ? options.sutherland_reference : 0.0,
          .sutherland_temperature = options.sutherland_temperature,
          .prandtl = options.prandtl};
}

/// The flow's options; under ranks with the work that the bodies make of the grid.
FlowOptions options_on_ranks(const Ranks& ranks, const FlowCase& flow_case,
                             std::span<const link::InterfaceMesh> coupled) {
  FlowOptions options = flow_case.options;
  if (ranks.alone() || flow_case.bodies.empty()) return options;
  const Grid grid = make_grid(flow_case.axes, flow_case.geometry);
  ImmersedBoundary bodies(grid, options.gas, make_bodies(flow_case, coupled), flow_case.immersed);
  static_cast<void>(bodies.update_topology({}));
  options.rank_work = work_of_planes(grid, bodies);
  return options;
}

}  // namespace

FlowRun::FlowRun(const Ranks& ranks, FlowCase flow_case, const CommandLine& line,
                 std::shared_ptr<spdlog::logger> log,
                 std::span<const link::InterfaceMesh> coupled_surfaces)
    : ranks_(&ranks),
      case_(std::move(flow_case)),
      out_(line.out),
      log_(std::move(log)),
      quiet_(line.quiet || !ranks.root()),
      flow_(make_grid(case_.axes, case_.geometry), case_.boundaries,
            options_on_ranks(ranks, case_, coupled_surfaces), &ranks),
      probes_(flow_.grid(), case_.options.gas, case_.probes, case_.common.ambient_pressure),
      fields_(flow_.grid(), case_.options.gas,
              {.directory = line.out, .ambient_pressure = case_.common.ambient_pressure}, writer_),
      surfaces_(line.out, writer_) {
  wall_start_ = omp_get_wtime();
  auto surfaces = make_bodies(case_, coupled_surfaces);
  if (!surfaces.empty()) {
    case_.immersed.transport = wall_transport(case_.options);
    bodies_ = std::make_unique<ImmersedBoundary>(flow_.grid(), case_.options.gas,
                                                 std::move(surfaces), case_.immersed);
    bodies_->share(ranks, flow_.owned_by_rank());
    find_coupled_bodies();
  }
  place_surface_probes();
  double resume_time = -1.0;
  if (!line.resume.empty()) {
    clock_ = read_checkpoint(link::require_checkpoint(line.resume).directory, flow_, bodies_.get(),
                             probes_);
    flow_.set_time(clock_.time);
    resume_time = clock_.time;
    fields_.restore(clock_.field_times);
    surfaces_.restore(clock_.interface_times);
    surface_times_ = clock_.surface_times;
    surface_history_ = clock_.surface_history;
    restore_sums();
  }
  start_gas(!line.resume.empty());
  if (bodies_) {
    bodies_->move_to(clock_.time);
    const auto topology = bodies_->update_topology(flow_.primitives());
    if (!clock_.walls.empty()) bodies_->restore_history(clock_.walls);
    fluid_nodes_ = topology.fluid_nodes;
    require_charges_in_gas(case_, flow_.grid(), bodies_->tags());
    if (topology.smallest_gap > 0.0 && topology.smallest_gap < 2.0)
      log_->warn("a gap is {:.2f} cells wide: its pressure is not resolved", topology.smallest_gap);
    flow_.immerse(bodies_.get());
  } else {
    fluid_nodes_ = flow_.grid().n_cells();
  }
  flow_.fill_domain_ghosts();
  start_bodies(!line.resume.empty());
  if (!out_.empty() && ranks_->root()) {
    probes_.open(out_ / "probes.csv", resume_time);
    open_globals(resume_time);
  }
  if (line.resume.empty()) {
    probes_.sample(*ranks_, flow_.owned(), std::as_const(flow_).primitives(), tags(), clock_.time);
    write_outputs(false);
  }
  setup_seconds_ = omp_get_wtime() - wall_start_;
  const auto blocks = flow_.rank_blocks();
  log_->info(
      "{} nodes, {} in the gas, {} precision, kernels {}, {} x {} x {} ranks of {} threads, set-up "
      "{:.2f} s",
      flow_.grid().n_cells(), fluid_nodes_, precision_name, flow_.instruction_set(), blocks[0],
      blocks[1], blocks[2], case_.options.threads, setup_seconds_);
  if (is_single)
    log_->info(
        "single precision: fields are rounded to 6e-8 of their value; skip_tolerance {:g}, "
        "quiet_overpressure {:g}",
        case_.options.active_tolerance, case_.quiet_overpressure);
}

void FlowRun::find_coupled_bodies() {
  for (std::size_t k = 0; k < case_.solids.size(); ++k)
    for (std::size_t b = 0; b < case_.bodies.size(); ++b)
      if (case_.bodies[b].motion == BodyMotion::coupled &&
          solid_number(case_, case_.bodies[b]) == k) {
        const std::size_t count = bodies_->position(b).size() / 3;
        coupled_bodies_.push_back({.body = b, .first = overpressure_.size(), .count = count});
        overpressure_.resize(overpressure_.size() + count, 0.0);
      }
  sums_.walls.resize(coupled_bodies_.size());
}

/// Bursts and charges at the start; after a resume only the waves that still come in from outside.
void FlowRun::start_gas(bool resumed) {
  std::vector<Body> bodies;
  for (std::size_t b = 0; bodies_ && b < bodies_->n_bodies(); ++b)
    bodies.push_back(bodies_->body(b));
  const ChargeStart charges = start_charges(case_, flow_.grid(), bodies);
  if (!resumed) {
    start_quantities_ = apply_initial_state(case_, charges, flow_);
    for (const StartQuantity& q : start_quantities_)
      log_->info("{} {:.9g} {}", q.name, q.value, q.unit);
  }
  incident_ = charges.incident;
  if (!incident_) return;
  incident_->cover(clock_.time, clock_.time);
  flow_.set_incoming(incident_);
}

void FlowRun::place_surface_probes() {
  for (const auto& probe : case_.surface_probes) {
    SurfacePlace place;
    while (case_.bodies[place.body].name != probe.body) ++place.body;
    const auto& vertices = bodies_->body(place.body).surface.vertices;
    double nearest = std::numeric_limits<double>::max();
    for (std::size_t v = 0; v < vertices.size() / 3; ++v) {
      double distance = 0.0;
      for (std::size_t a = 0; a < 3; ++a)
        distance +=
            (vertices[3 * v + a] - probe.position[a]) * (vertices[3 * v + a] - probe.position[a]);
      if (distance < nearest) {
        nearest = distance;
        place.vertex = v;
      }
    }
    surface_places_.push_back(place);
  }
}

void FlowRun::sample_surface_probes() {
  if (surface_places_.empty()) return;
  surface_times_.push_back(clock_.time);
  std::vector<double> p;
  for (std::size_t s = 0; s < surface_places_.size(); ++s) {
    const auto& place = surface_places_[s];
    if (s == 0 || place.body != surface_places_[s - 1].body) {
      p.assign(bodies_->position(place.body).size() / 3, 0.0);
      bodies_->overpressure(place.body, readings_[place.body], p);
    }
    surface_history_.push_back(p[place.vertex]);
  }
}

std::span<const std::uint8_t> FlowRun::tags() const {
  return bodies_ ? bodies_->tags() : std::span<const std::uint8_t>();
}

double FlowRun::stable_step() {
  const double dt = flow_.stable_step();
  return bodies_ ? std::min(dt, bodies_->wall_step_limit()) : dt;
}

void FlowRun::read_loads() {
  readings_.resize(bodies_->n_bodies());
  loads_.resize(bodies_->n_bodies());
  for (std::size_t b = 0; b < loads_.size(); ++b) {
    readings_[b] =
        bodies_->read_wall(std::as_const(flow_).primitives(), b, case_.common.ambient_pressure);
    loads_[b] = bodies_->load(b, readings_[b]);
  }
}

/// Motions and balances from the start, or from what a checkpoint held.
void FlowRun::start_bodies(bool resumed) {
  if (!bodies_) return;
  motions_ = std::make_unique<BodyMotions>(case_, *bodies_);
  balance_ = std::make_unique<WallBalance>(*ranks_, flow_, *bodies_);
  read_loads();
  if (resumed) {
    restore_bodies(clock_.bodies);
    return;
  }
  motions_->start(loads_);
  balance_->start(flow_.totals(), loads_);
}

std::vector<double> FlowRun::save_bodies() const {
  if (!bodies_) return {};
  std::vector<double> saved = motions_->save();
  const auto balance = balance_->save();
  saved.insert(saved.end(), balance.begin(), balance.end());
  return saved;
}

void FlowRun::restore_bodies(std::span<const double> saved) {
  motions_->restore(saved);
  balance_->restore(saved);
}

void FlowRun::step_to(double t_end) {
  while (clock_.time < t_end) {
    const double begin = omp_get_wtime();
    const double remaining = t_end - clock_.time;
    // Equal steps to the end; 1e-9: no extra step for the rounding of the division.
    const double n = std::max(1.0, std::ceil(remaining / stable_step() * (1.0 - 1e-9)));
    const double dt = remaining / n;
    const double t_next = n == 1.0 ? t_end : clock_.time + dt;
    if (bodies_) motions_->set_paths(*bodies_, clock_.time, t_next);
    if (incident_) incident_->cover(clock_.time, t_next);
    try {
      last_report_ = flow_.advance(clock_.time, dt);
    } catch (const NumericsError& error) {
      throw NumericsError(error.what() + save_last_good());
    }
    totals_ = flow_.totals();
    if (bodies_) {
      read_loads();
      motions_->correct(t_next - clock_.time, loads_);
      balance_->add(t_next - clock_.time, totals_, loads_);
    }
    clock_.time = t_next;
    ++clock_.step;
    compute_seconds_ += omp_get_wtime() - begin;
    after_step();
  }
}

void FlowRun::after_step() {
  const auto& r = last_report_;
  sums_.cells += r.active_share * static_cast<double>(fluid_nodes_);
  sums_.active_sum += r.active_share;
  sums_.redone += r.redone;
  sums_.marked += static_cast<double>(r.marked_nodes);
  sums_.floored += static_cast<double>(r.floored_nodes);
  output_waits_ = iterating_;
  if (!iterating_) write_step();
}

void FlowRun::write_step() {
  const auto& r = last_report_;
  const double begin = omp_get_wtime();
  probes_.sample(*ranks_, flow_.owned(), std::as_const(flow_).primitives(), tags(), clock_.time);
  sample_surface_probes();
  write_globals(r);
  write_outputs(false);
  output_seconds_ += omp_get_wtime() - begin;
}

void FlowRun::write_outputs(bool last) {
  if (out_.empty()) return;
  const auto due = [&](double every, double& next) {
    if (every <= 0.0) return false;
    // A step that ends within 1e-9 of the interval before the due time counts as there.
    const bool now = clock_.time >= next - 1e-9 * every;
    if (now) next = every * (std::floor(clock_.time / every + 1e-9) + 1.0);
    return now || last;
  };
  const auto W = std::as_const(flow_).primitives();
  const auto written = [&](const std::vector<double>& times) {
    return !times.empty() && times.back() == clock_.time;
  };
  if (due(case_.output.every, clock_.next_output) && !written(fields_.times()))
    fields_.write(*ranks_, flow_.owned(), W, tags(), clock_.time);
  if (bodies_ && due(case_.output.interface_every, clock_.next_interface) &&
      !written(surfaces_.times()))
    surfaces_.write(*ranks_, *bodies_, W, case_.common.ambient_pressure, clock_.time);
}

void FlowRun::open_globals(double resume_time) {
  std::string header =
      "time_s,step,dt_s,mass_kg,energy_J,active_share,marked_nodes,redone,max_pressure_Pa,"
      "min_pressure_Pa";
  if (!case_.bodies.empty()) header += ",gas_mass_to_walls_kg,leaked_mass_kg";
  for (const auto& body : case_.bodies) {
    header += fmt::format(
        ",{0}_force_x_N,{0}_force_y_N,{0}_force_z_N,{0}_moment_x_N_m,{0}_moment_y_N_m,"
        "{0}_moment_z_N_m,{0}_impulse_x_N_s,{0}_impulse_y_N_s,{0}_impulse_z_N_s,{0}_power_W,"
        "{0}_exposed_area_m2",
        body.name);
    if (body.slip == WallSlip::no_slip)
      header += fmt::format(
          ",{0}_shear_force_x_N,{0}_shear_force_y_N,{0}_shear_force_z_N,{0}_heat_W", body.name);
    if (body.motion == BodyMotion::free)
      header += fmt::format(
          ",{0}_x_m,{0}_y_m,{0}_z_m,{0}_u_m_s,{0}_v_m_s,{0}_w_m_s,{0}_omega_x_rad_s,"
          "{0}_omega_y_rad_s,{0}_omega_z_rad_s",
          body.name);
  }
  for (const auto& probe : case_.surface_probes)
    header += fmt::format(",{}_overpressure_Pa", probe.name);
  globals_ = open_csv_table(out_ / "globals.csv", header, resume_time);
}

void FlowRun::write_globals(const StepReport& r) {
  if (!globals_.is_open()) return;
  globals_ << fmt::format("{:.17g},{},{:.9g},{:.15g},{:.15g},{:.5g},{},{},{:.9g},{:.9g}",
                          clock_.time, clock_.step, r.dt, totals_.mass, totals_.energy,
                          r.active_share, r.marked_nodes, r.redone, r.largest_pressure,
                          r.smallest_pressure);
  const auto put = [&](const auto& values) {
    for (const double x : values) globals_ << fmt::format(",{:.9g}", x);
  };
  if (balance_) put(std::array{balance_->gas_mass(), balance_->leaked_mass()});
  for (std::size_t b = 0; b < case_.bodies.size(); ++b) {
    const BodyLoad& load = loads_[b];
    put(load.force);
    put(load.moment);
    put(balance_->impulse(b));
    put(std::array{load.power, load.exposed_area});
    if (case_.bodies[b].slip == WallSlip::no_slip) {
      put(load.shear_force);
      put(std::array{load.heat});
    }
    if (const FreeBody* free = motions_->free_body(b)) {
      put(free->state().center.c);
      put(free->state().velocity.c);
      put(free->state().angular_velocity.c);
    }
  }
  for (std::size_t i = surface_places_.size(); i > 0; --i)
    globals_ << fmt::format(",{:.9g}", surface_history_[surface_history_.size() - i]);
  globals_ << '\n';
}

std::string FlowRun::status() const {
  double peak = 0.0;
  for (const auto& wall : sums_.walls) peak = std::max(peak, wall.peak);
  return fmt::format("active {:.0f} %, peak at probes {:.1f} kPa, at the wall {:.1f} kPa",
                     100.0 * last_report_.active_share, probes_.largest() * 1e-3, peak * 1e-3);
}

void FlowRun::show_progress(bool last) {
  if (quiet_) return;
  const double now = omp_get_wtime() - wall_start_;
  if (!last && now - progress_shown_ < 1.0) return;
  progress_shown_ = now;
  const double share = clock_.time / case_.common.end_time;
  std::fprintf(stdout, "%s\n",
               fmt::format("t {:.4g} of {:.4g} s  step {}  {:.0f} %  ETA {:.0f} s  {}", clock_.time,
                           case_.common.end_time, clock_.step, 100.0 * share,
                           share > 0.0 ? now * (1.0 / share - 1.0) : 0.0, status())
                   .c_str());
  std::fflush(stdout);
}

void FlowRun::save(const std::filesystem::path& directory) {
  writer_.finish();
  clock_.field_times = fields_.times();
  clock_.interface_times = surfaces_.times();
  clock_.surface_times = surface_times_;
  clock_.surface_history = surface_history_;
  keep_sums();
  clock_.bodies = save_bodies();
  if (ranks_->root()) std::filesystem::create_directories(directory);
  write_checkpoint(*ranks_, directory, flow_, bodies_.get(), probes_, clock_);
  probes_.flush();
  globals_.flush();
}

/// Brings everything back to the start of the failed step and writes it; says where.
std::string FlowRun::save_last_good() {
  if (out_.empty()) return "";
  flow_.roll_back(clock_.time);
  if (bodies_) bodies_->move_to(clock_.time);
  const auto place = link::checkpoint_directory(out_, static_cast<std::uint64_t>(clock_.step));
  save(place);
  return fmt::format("; the last good step, t = {:.9e} s, is in {}", clock_.time, place.string());
}

bool FlowRun::run_alone() {
  std::signal(SIGINT, ask_to_stop);
  std::signal(SIGTERM, ask_to_stop);
  const double end = case_.common.end_time;
  bool stopped = false;
  while (clock_.time < end) {
    stopped =
        ranks_->any_of_all(stop_asked != 0);  // the signal may reach them between different steps
    if (stopped) break;
    const double dt = stable_step();
    const double remaining = end - clock_.time;
    // The last two steps share what is left, so that the run ends exactly and without a sliver.
    const double next =
        remaining <= dt ? end : clock_.time + (remaining < 2.0 * dt ? 0.5 * remaining : dt);
    step_to(next);
    show_progress(false);
  }
  if (stopped) {
    if (out_.empty()) return false;
    save(link::checkpoint_directory(out_, static_cast<std::uint64_t>(clock_.step)));
    log_->warn("stopped by a signal at t = {:.6g} s; continue with --resume {}", clock_.time,
               out_.string());
    return false;
  }
  write_outputs(true);
  show_progress(true);
  write_summary();
  return true;
}

}  // namespace ocublast::flow
