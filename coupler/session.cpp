#include "coupler/session.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>

#include "coupler/base/errors.hpp"
#include "coupler/base/version.hpp"
#include "coupler/event_log.hpp"
#include "coupler/handshake.hpp"
#include "coupler/link/checkpoint_place.hpp"
#include "coupler/link/payload.hpp"
#include "coupler/recording.hpp"
#include "coupler/run_start.hpp"
#include "coupler/scheme.hpp"
#include "coupler/socket_place.hpp"
#include "coupler/solver_start.hpp"
#include "coupler/window_log.hpp"

namespace ocublast::coupler {

using link::Clock;
using link::Header;
using link::Kind;
using link::to_word;

namespace {

/// Checkpoints kept; one more than needed, in case the last one turns out to be bad.
constexpr int kept_checkpoints = 2;
/// Recording and coupling.csv reach the disk at least this often, s.
constexpr double flush_every = 1.0;

class Session {
 public:
  Session(const RunOptions& options, const Settings& settings, std::shared_ptr<spdlog::logger> log);
  [[nodiscard]] bool run();

 private:
  [[nodiscard]] bool run_checked();
  void load_resume();
  void start_solvers();
  void shake();
  [[nodiscard]] Interface make_interface(const SolidHands& solid, Party party);
  void open_results(std::vector<Interface> interfaces, bool sends_force);
  void advance();
  [[nodiscard]] int predictor_order(double width);
  [[nodiscard]] bool implicit() const {
    return settings_.scheme == SchemeKind::serial_implicit ||
           settings_.scheme == SchemeKind::parallel_implicit;
  }
  [[nodiscard]] bool checkpoint_due() const;
  void flush_rows();
  void write_checkpoint();
  void await_all(link::Kind kind, const char* what);
  void finish();
  void show_progress();
  void tell_status(const std::string& phase, const std::string& detail = {});
  [[noreturn]] void fail(const std::string& text, int exit_code);
  [[nodiscard]] std::string describe(const PartnerFault& fault);

  RunOptions options_;
  Settings settings_;
  std::shared_ptr<spdlog::logger> log_;
  Clock::time_point begin_ = Clock::now();
  FileLock run_lock_;
  EventLog events_;
  SocketPlace place_;
  SolverStart start_;
  SignalWatch signals_;
  Server server_;
  Partners partners_;

  std::optional<StoredState> resumed_;
  CouplingState state_;
  std::uint64_t mesh_hash_ = 0;
  TimeWindow window_;
  struct {
    std::uint64_t window = 0;
    double time = 0.0;  ///< s
  } finished_;          ///< by both, and nothing found wrong with it
  std::string phase_ = "during the handshake";
  std::optional<TrafficWriter> traffic_;
  std::optional<WindowLog> rows_;
  std::vector<InterfaceArea> areas_;
  std::vector<InterfaceLog> interface_rows_;  ///< where there are several
  std::optional<Exchange> exchange_;
  std::unique_ptr<Scheme> scheme_;
  std::uint64_t last_checkpoint_window_ = 0;
  double last_checkpoint_time_ = 0.0;
  std::uint64_t first_window_ = 0;
  double first_time_ = 0.0;
  bool warned_theta_ = false;
  WallTime wall_;
  Clock::time_point windows_begin_ = Clock::now();
  Clock::time_point last_flush_ = Clock::now();
  Clock::time_point last_progress_{};
  std::array<std::string, 2> status_;
};

FileLock lock_run(const std::filesystem::path& out) {
  std::filesystem::create_directories(out / "log");
  return {out / "log" / "coupler.lock",
          fmt::format("{}: another coupler is running in this directory", out.string())};
}

Server::Setup server_setup(const Settings& settings, const SocketPlace& place,
                           const SolverStart& start) {
  return {.endpoint = place.endpoint(),
          .run_id = link::make_run_id(),
          .token = start.token(),
          .case_hash = settings.case_hash,
          .silence_limit = settings.silence_limit,
          .max_message = 1e6 * settings.max_message,
          .keys = start.coupler_keys(),
          .roster = settings.roster,
          .hosts = settings.hosts,
          .only = {},
          .share_memory = settings.share_memory};
}

Session::Session(const RunOptions& options, const Settings& settings,
                 std::shared_ptr<spdlog::logger> log)
    : options_(options),
      settings_(settings),
      log_(std::move(log)),
      run_lock_(lock_run(options.out)),
      events_(options.out / "log" / "events.jsonl"),
      place_(options.endpoint.empty() ? settings.endpoint : options.endpoint),
      start_(options, settings.roster, place_.encrypted(), settings.case_hash),
      server_(server_setup(settings, place_, start_), log_),
      partners_(server_, signals_, {settings.silence_limit, settings.step_limit}, log_) {}

void Session::load_resume() {
  if (options_.resume.empty()) return;
  const auto place = link::require_checkpoint(options_.resume);
  resumed_ = read_state(place.directory);
  state_ = resumed_->state;
  window_.number = first_window_ = last_checkpoint_window_ = state_.window;
  window_.t_end = first_time_ = last_checkpoint_time_ = state_.time;
  finished_ = {state_.window, state_.time};
  if (resumed_->case_hash != settings_.case_hash)
    throw CaseError(
        fmt::format("--resume {}: the checkpoint is of case {:016x}, this case is {:016x}; "
                    "resume with the same case file and --set",
                    options_.resume.string(), resumed_->case_hash, settings_.case_hash));
  log_->info("resumed from {}: window {}, t = {} s", place.directory.string(), state_.window,
             state_.time);
}

void Session::start_solvers() {
  std::vector<Party> elsewhere;
  for (const Party party : settings_.roster.all())
    if (options_.await || !settings_.hosts[index_of(party)].empty()) elsewhere.push_back(party);
  if (!options_.await && !elsewhere.empty() && !place_.encrypted())
    throw CaseError(
        "coupling.hosts: others connect by tcp: give coupling.endpoint = \"tcp://ADDRESS:PORT\"");
  if (!elsewhere.empty()) start_.announce(elsewhere, server_.endpoint(), settings_.silence_limit);
  for (const Party party : settings_.roster.all())
    if (std::find(elsewhere.begin(), elsewhere.end(), party) == elsewhere.end())
      partners_.start(start_.child(party, server_.endpoint(), settings_.silence_limit));
}

/// The flow's mesh beside a solid's: a map where they differ.
Interface Session::make_interface(const SolidHands& solid, Party party) {
  const auto n = static_cast<std::size_t>(solid.mesh.header.n_vertices);
  Interface interface {
    .n_flow = n, .n_solid = n, .takes_force = solid.ready->header.takes_force, .map = {}
  };
  const double area = area_of(mesh_of(solid.mesh));
  areas_.push_back(
      {.flow = solid.flow_mesh ? area_of(mesh_of(*solid.flow_mesh)) : area, .solid = area});
  if (!solid.flow_mesh || solid.flow_mesh->header.mesh_hash == solid.mesh.header.mesh_hash)
    return interface;
  const auto begin = Clock::now();
  try {
    interface.map = std::make_unique<InterfaceMap>(mesh_of(*solid.flow_mesh), mesh_of(solid.mesh),
                                                   settings_.mapping);
  } catch (const LinkError& error) {
    throw PartnerFault(Party::flow, error.what(), static_cast<int>(ExitCode::bad_case));
  }
  interface.n_flow = interface.map->n_flow();
  log_->info(
      "{} mapped by {}: {} vertices of the flow, {} of the solid, largest gap {:.3g} m, load as "
      "{}, {:.3f} s",
      settings_.roster.word(party), interface.map->method(), interface.n_flow, n,
      interface.map->largest_gap(),
      interface.takes_force ? "forces (conservative)" : "overpressure (not conservative)",
      link::seconds_since(begin));
  return interface;
}

void Session::shake() {
  Handshake hands = shake_hands(partners_, server_, settings_.start_limit, state_);
  mesh_hash_ = hash_of_meshes(hands);
  std::vector<Interface> interfaces;
  std::uint64_t vertices = 0, triangles = 0;
  std::string solids;
  for (std::size_t k = 0; k < hands.solids.size(); ++k) {
    interfaces.push_back(make_interface(hands.solids[k], solid_party(k)));
    vertices += hands.solids[k].mesh.header.n_vertices;
    triangles += hands.solids[k].mesh.header.n_triangles;
    solids += (solids.empty() ? "" : ", ") + server_.program(solid_party(k));
  }
  if (resumed_) {
    if (resumed_->mesh_hash != mesh_hash_)
      throw PartnerFault(Party::solid,
                         fmt::format("brings the interface mesh {:016x}, the checkpoint is "
                                     "of {:016x}",
                                     mesh_hash_, resumed_->mesh_hash));
  } else {
    start_state(state_, hands, settings_.leap_frog);
  }
  const bool sends_force = hands.flow_ready.takes_force;
  for (std::size_t k = 0; k < interfaces.size(); ++k)
    if (sends_force && (interfaces[k].map || !interfaces[k].takes_force))
      throw PartnerFault(
          Party::flow,
          fmt::format("sends forces, but {}",
                      interfaces[k].map ? "has an interface mesh of its own"
                                        : settings_.roster.word(solid_party(k)) + " takes none"));
  open_results(std::move(interfaces), sends_force);
  exchange_->set_wall(state_.wall.values.empty() ? state_.position.values : state_.wall.values);
  if (traffic_) record_handshake(*traffic_, hands);
  log_->info("ready: {} vertices, {} triangles, stable steps {} s (flow) and {} s (solid)",
             vertices, triangles, state_.stable_flow, state_.stable_solid);
  events_.note("ready", {{"flow", server_.program(Party::flow)},
                         {"solid", solids},
                         {"vertices", vertices},
                         {"window", state_.window},
                         {"time_s", state_.time}});
}

void Session::open_results(std::vector<Interface> interfaces, bool sends_force) {
  const bool same_run = resumed_.has_value();
  rows_.emplace(options_.out / "coupling.csv", same_run ? state_.window : 0);
  if (settings_.roster.several())
    for (const auto& name : settings_.roster.solids())
      interface_rows_.emplace_back(options_.out, name, same_run ? state_.window : 0);
  if (settings_.record) {
    auto file = options_.out / "traffic.ocu";
    if (same_run && std::filesystem::exists(file))
      file = options_.out / fmt::format("traffic_{:08}.ocu", state_.window + 1);
    traffic_.emplace(
        file,
        TrafficDescription{.program = fmt::format("coupler {}", version_text),
                           .case_name = settings_.common.name,
                           .case_hash = settings_.case_hash,
                           .mesh_hash = mesh_hash_,
                           .first_window = state_.window + 1,
                           .solids = settings_.roster.solids()},
        settings_.record_packed ? TrafficWriter::Packing::zstd : TrafficWriter::Packing::none);
  }
  exchange_.emplace(partners_, server_, settings_, std::move(interfaces), sends_force,
                    traffic_ ? &*traffic_ : nullptr);
  scheme_ = make_scheme(*exchange_, settings_);
}

/// Order the stability figure theta = Z w / M allows (moving walls: order 2 up to 0.02, 1 to 0.04).
int Session::predictor_order(double width) {
  if (state_.impedance <= 0.0 || state_.mass_per_area <= 0.0) return settings_.predictor_order;
  const double theta = state_.impedance * width / state_.mass_per_area;
  state_.theta_max = std::max(state_.theta_max, theta);
  if (implicit()) return settings_.predictor_order;
  if (theta > settings_.theta_refuse && !settings_.allow_unstable)
    throw NumericsError(fmt::format(
        "window {}, t = {:.6g} s: theta = {:.3g} (gas impedance {:.4g} kg/(m^2 s) x window {:.3g} "
        "s / "
        "solid mass per area {:.4g} kg/m^2) is above {:.3g}, where explicit coupling grows without "
        "bound; use scheme = \"serial-implicit\", shorter windows (window = \"fixed\"), or "
        "coupling.allow_unstable = true",
        window_.number, window_.t_begin, theta, state_.impedance, width, state_.mass_per_area,
        settings_.theta_refuse));
  if (theta > settings_.theta_warn && !std::exchange(warned_theta_, true)) {
    log_->warn(
        "theta = {:.3g} is above {:.3g} from window {} (t = {:.6g} s) on: predictor of order 1",
        theta, settings_.theta_warn, window_.number, window_.t_begin);
    events_.note("theta",
                 {{"window", window_.number}, {"theta", theta}, {"limit", settings_.theta_warn}});
  }
  return allowed_order(settings_, state_, width);
}

void Session::advance() {
  const auto begin = Clock::now();
  window_ = scheme_->next(state_);
  const int order = predictor_order(window_.width());
  const double theta =
      state_.mass_per_area > 0.0 ? state_.impedance * window_.width() / state_.mass_per_area : 0.0;
  const WindowReports reports = scheme_->advance(state_, window_, order);
  finished_ = {state_.window, state_.time};
  const double elapsed = link::seconds_since(begin);
  const double overhead = elapsed - reports.flow.compute_seconds - reports.solid.compute_seconds;
  wall_.flow += reports.flow.compute_seconds;
  wall_.solid += reports.solid.compute_seconds;
  wall_.coupling += overhead;
  wall_.overheads.push_back(static_cast<float>(overhead));
  status_ = {reports.flow.status, reports.solid.status};
  WindowRow row{.window = window_,
                .steps_solid = reports.solid.steps,
                .work_flow = reports.flow.work,
                .work_solid = reports.solid.work,
                .impulse_flow = reports.flow.impulse,
                .impulse_solid = reports.solid.impulse,
                .energy_error = state_.balance.energy_error(),
                .theta = theta,
                .iterations = reports.iterations,
                .residual = reports.residual,
                .overhead = overhead};
  row.window.steps_flow = reports.flow.steps;
  rows_->add(row);
  for (std::size_t k = 0; k < interface_rows_.size(); ++k)
    interface_rows_[k].add(window_,
                           reports.flow_balance.empty()
                               ? std::span<const double>()
                               : std::span(reports.flow_balance).subspan(4 * k, 4),
                           reports.solids[k]);
  if (link::seconds_since(last_flush_) < flush_every) return;
  last_flush_ = Clock::now();
  flush_rows();
  if (traffic_) traffic_->flush();
  show_progress();
}

void Session::flush_rows() {
  rows_->flush();
  for (InterfaceLog& rows : interface_rows_) rows.flush();
}

bool Session::checkpoint_due() const {
  const auto every_windows = static_cast<std::uint64_t>(settings_.checkpoint_every_windows);
  if (every_windows > 0 && state_.window - last_checkpoint_window_ >= every_windows) return true;
  // From fixed points in time, so that a resumed run checkpoints where the uninterrupted one does.
  const double every = settings_.checkpoint_every;
  return every > 0.0 && std::floor(state_.time / every) > std::floor(last_checkpoint_time_ / every);
}

/// DONE or BYE of everybody, each at the window where it stands.
void Session::await_all(Kind kind, const char* what) {
  std::vector<bool> here(settings_.roster.size());
  while (true) {
    const auto missing = std::find(here.begin(), here.end(), false);
    if (missing == here.end()) return;
    const auto blame = static_cast<Party>(missing - here.begin());
    const Incoming answer = partners_.await(blame, what, settings_.start_limit);
    const std::uint64_t window = answer.party == Party::flow ? state_.flow_window() : state_.window;
    const std::size_t i = index_of(answer.party);
    if (answer.header.kind != kind || here[i] ||
        (kind == Kind::done && answer.header.window != window))
      throw PartnerFault(answer.party, fmt::format("sent {} while {} was awaited",
                                                   to_word(answer.header.kind), what));
    here[i] = true;
    if (kind == Kind::bye)
      partners_.set_over(answer.party);
    else
      partners_.set_computing(answer.party, false);
  }
}

void Session::write_checkpoint() {
  phase_ = "while writing the checkpoint";
  const auto directory = begin_checkpoint(options_.out, state_.window);
  for (const Party party : settings_.roster.all()) {
    Header header;
    header.kind = Kind::checkpoint;
    header.window = party == Party::flow ? state_.flow_window() : state_.window;
    const auto own =
        directory / settings_.roster.name(party);  // of several solids each has its own
    std::filesystem::create_directories(own);
    header.directory = (settings_.roster.name(party).empty() ? directory : own).string();
    server_.send(party, std::move(header));
    partners_.set_computing(party, true);
  }
  if (const auto wall = exchange_->wall(); !wall.empty())
    state_.wall = SharedValues::from(std::vector<double>(wall.begin(), wall.end()));
  write_state(directory, state_, settings_.case_hash, mesh_hash_);
  // A run that is killed later goes on from here: its tables must reach this far.
  flush_rows();
  if (traffic_) traffic_->flush();
  await_all(Kind::done, "DONE");
  if (traffic_) traffic_->wait_written();
  complete_checkpoint(options_.out, state_.window, kept_checkpoints);
  last_checkpoint_window_ = state_.window;
  last_checkpoint_time_ = state_.time;
  phase_ = "";
  log_->info("checkpoint of window {} at t = {} s", state_.window, state_.time);
  events_.note("checkpoint", {{"window", state_.window}, {"time_s", state_.time}});
}

void Session::finish() {
  phase_ = "during the farewell";
  for (const Party party : settings_.roster.all()) {
    Header header;
    header.kind = Kind::finish;
    header.window = state_.window;
    server_.send(party, std::move(header));
    partners_.set_computing(party, true);
  }
  await_all(Kind::bye, "BYE");
  partners_.await_children(settings_.start_limit);
  wall_.total = link::seconds_since(begin_);
  rows_->close();
  std::vector<std::pair<std::string, Balance>> balances;
  for (InterfaceLog& rows : interface_rows_) {
    rows.close();
    balances.emplace_back(rows.name(), rows.balance());
  }
  if (traffic_) traffic_->close();
  write_summary(options_.out / "coupling_summary.json", {.time = state_.time,
                                                         .windows = state_.window - first_window_,
                                                         .theta_max = state_.theta_max,
                                                         .balance = state_.balance,
                                                         .areas = areas_,
                                                         .interfaces = balances,
                                                         .wall = wall_});
}

void Session::tell_status(const std::string& phase, const std::string& detail) {
  const double span = settings_.common.end_time - first_time_;
  const double share = span > 0.0 ? (state_.time - first_time_) / span : 1.0;
  const double spent = link::seconds_since(windows_begin_);
  write_status(options_.out, {.case_name = settings_.common.name,
                              .phase = phase,
                              .detail = detail,
                              .window = state_.window,
                              .time = state_.time,
                              .end_time = settings_.common.end_time,
                              .seconds_left = share > 0.0 ? spent * (1.0 - share) / share : 0.0,
                              .overhead = wall_.median_overhead(),
                              .theta = state_.theta_max,
                              .energy_error = state_.balance.relative_energy_error(),
                              .flow = status_[0],
                              .solid = status_[1]});
}

void Session::show_progress() {
  if (exchange_) tell_status("windows");
  if (options_.quiet || !exchange_) return;
  const double done =
      settings_.common.end_time > 0.0 ? state_.time / settings_.common.end_time : 1.0;
  const double share = settings_.common.end_time > first_time_
                           ? (state_.time - first_time_) / (settings_.common.end_time - first_time_)
                           : 1.0;
  const double spent = link::seconds_since(windows_begin_);
  const std::string eta =
      share > 0.0 ? fmt::format("{:.0f} s left", spent * (1.0 - share) / share) : "";
  std::string line = fmt::format(
      "t {:.4e} s  window {}  {:.1f} %  {}  {:.0f} us/window  theta {:.2g}", state_.time,
      state_.window, 100.0 * done, eta, 1e6 * wall_.median_overhead(), state_.theta_max);
  for (const auto& text : status_)
    if (!text.empty()) line += "  " + text;
  if (::isatty(STDOUT_FILENO) != 0)
    std::printf("\r\033[K%s", line.c_str());
  else
    std::printf("%s\n", line.c_str());
  std::fflush(stdout);
}

std::string Session::describe(const PartnerFault& fault) {
  const std::string& program = server_.program(fault.party);
  const std::string word = settings_.roster.word(fault.party);
  const std::string who = program.empty() ? word : fmt::format("{} ({})", word, program);
  const bool in_window = window_.number > finished_.window;
  const std::string when =
      !phase_.empty() ? phase_
      : in_window     ? fmt::format("in window {} (t = {:.6g} s to {:.6g} s)", window_.number,
                                    window_.t_begin, window_.t_end)
                  : fmt::format("after window {} (t = {:.6g} s)", finished_.window, finished_.time);
  const auto log = partners_.log_of(fault.party);
  std::string text = fmt::format("{} failed {}, {:.1f} s after the start: {}", who, when,
                                 link::seconds_since(begin_), fault.what());
  if (!log.empty()) text += fmt::format("; its log: {}", log.string());
  return text;
}

void Session::fail(const std::string& text, int exit_code) {
  if (::isatty(STDOUT_FILENO) != 0 && !options_.quiet) std::printf("\n");
  log_->info("the run ends: {}", text);
  events_.note("failed", {{"window", finished_.window},
                          {"time_s", finished_.time},
                          {"exit_code", exit_code},
                          {"reason", text.substr(0, text.find('\n'))}});
  tell_status("failed", text.substr(0, text.find('\n')));
  partners_.end_all(text.substr(0, text.find('\n')), exit_code);
  try {
    if (rows_) rows_->close();
    if (traffic_) traffic_->close();
  } catch (const LinkError& error) {
    log_->warn("{}", error.what());
  }
  switch (exit_code) {
    case 2:
      throw CaseError(text);
    case 4:
      throw NumericsError(text);
    default:
      throw LinkError(text);
  }
}

bool Session::run() {
  constexpr int log_lines = 15;
  try {
    return run_checked();
  } catch (const PartnerFault& first) {
    const PartnerFault fault = partners_.cause_of(first);
    std::string text = describe(fault);
    const auto log = partners_.log_of(fault.party);
    const std::string tail = log.empty() ? std::string() : tail_of(log, log_lines);
    if (!tail.empty()) text += "\n" + tail.substr(0, tail.size() - 1);
    fail(text, fault.exit_code);
  } catch (const CaseError& error) {
    fail(error.what(), 2);
  } catch (const NumericsError& error) {
    fail(error.what(), 4);
  } catch (const std::exception& error) {
    fail(error.what(), 3);
  }
}

bool Session::run_checked() {
  events_.note("started", {{"case", settings_.common.name},
                           {"pid", ::getpid()},
                           {"endpoint", server_.endpoint()},
                           {"resumed", !options_.resume.empty()}});
  tell_status("handshake");
  load_resume();
  start_solvers();
  shake();
  wall_.set_up = link::seconds_since(begin_);
  windows_begin_ = Clock::now();
  phase_ = "";
  partners_.set_tick([this] { show_progress(); });
  while (state_.time < settings_.common.end_time && !partners_.stop_requested()) {
    advance();
    if (checkpoint_due() && state_.time < settings_.common.end_time) write_checkpoint();
  }
  const bool stopped = state_.time < settings_.common.end_time;
  if (stopped && last_checkpoint_window_ != state_.window) write_checkpoint();
  finish();
  if (!options_.quiet) {
    show_progress();
    if (::isatty(STDOUT_FILENO) != 0) std::printf("\n");
  }
  events_.note(stopped ? "stopped" : "ended", {{"window", state_.window}, {"time_s", state_.time}});
  tell_status(stopped ? "stopped" : "ended");
  if (stopped)
    log_->warn("stopped at window {}, t = {:.6g} s, as asked; --resume {} goes on from there",
               state_.window, state_.time, options_.out.string());
  return !stopped;
}

}  // namespace

bool run_coupled(const RunOptions& options, const Settings& settings,
                 const std::shared_ptr<spdlog::logger>& log) {
  return Session(options, settings, log).run();
}

}  // namespace ocublast::coupler
