// A run as a participant: windows as the coupler orders them, kept and taken back where it
// iterates.
#include <omp.h>

#include <algorithm>
#include <csignal>

#include "flow_solver/io/run.hpp"

namespace ocublast::flow::inline OCU_PRECISION {

void FlowRun::keep_state() {
  kept_.parts.clear();
  for (const auto& part : flow_.checkpoint())
    kept_.parts.emplace_back(part.values.begin(), part.values.end());
  kept_.walls.clear();
  for (std::size_t b = 0; bodies_ && b < bodies_->n_bodies(); ++b) {
    const auto copy = [](std::span<const double> v) {
      return std::vector<double>(v.begin(), v.end());
    };
    kept_.walls.push_back(
        {copy(bodies_->position(b)), copy(bodies_->velocity(b)), copy(bodies_->acceleration(b))});
  }
  if (bodies_) kept_.history = bodies_->history();
  kept_.bodies = save_bodies();
  kept_.time = clock_.time;
  kept_.step = clock_.step;
  kept_.window = clock_.window;
  kept_.sums = sums_;
}

/// As at the start of a resumed run, from memory instead of a file.
void FlowRun::rewind() {
  const auto put_back = [&] {
    const auto parts = flow_.checkpoint();
    for (std::size_t k = 0; k < parts.size(); ++k)
      std::copy(kept_.parts[k].begin(), kept_.parts[k].end(), parts[k].values.begin());
  };
  put_back();
  clock_.time = kept_.time;
  clock_.step = kept_.step;
  clock_.window = kept_.window;
  sums_ = kept_.sums;
  if (bodies_) {
    for (std::size_t b = 0; b < kept_.walls.size(); ++b)
      if (bodies_->body(b).moves)
        bodies_->restore_wall(b, kept_.walls[b].position, kept_.walls[b].velocity,
                              kept_.walls[b].acceleration);
    bodies_->move_to(clock_.time);
    bodies_->update_topology(flow_.primitives());
    bodies_->restore_history(kept_.history);
    put_back();  // nodes that a wall going back set free were filled anew
    restore_bodies(kept_.bodies);
  }
  flow_.restored();  // takes the topology over: after the walls
  flow_.fill_domain_ghosts();
}

link::Report FlowRun::finish_window(const link::Order& order) {
  link::Report report;
  report.stable_step = stable_step();
  if (coupled_bodies_.empty()) return report;
  const double window = order.t_end - order.t_begin;
  const double quiet = case_.quiet_overpressure * case_.common.ambient_pressure;
  report.idle = true;
  std::vector<bool> loaded;
  for (const CoupledBody& c : coupled_bodies_) {
    const auto mine = std::span(overpressure_).subspan(c.first, c.count);
    bodies_->overpressure(c.body, readings_[c.body], mine);
    loaded.push_back(
        std::any_of(mine.begin(), mine.end(), [&](double p) { return std::abs(p) > quiet; }));
    report.idle = report.idle && !loaded.back();
    report.impedance = std::max(report.impedance, loads_[c.body].largest_impedance);
  }
  report.status = status();
  if (report.idle) return report;
  if (force_.empty())
    report.overpressure = overpressure_;
  else
    report.force = force_;
  for (std::size_t k = 0; k < coupled_bodies_.size(); ++k) {
    const CoupledBody& c = coupled_bodies_[k];
    const auto mine = std::span(overpressure_).subspan(c.first, c.count);
    const BodyLoad& load = loads_[c.body];
    Sums::Wall& wall = sums_.walls[k];
    link::InterfaceBalance balance;
    // A quiet load of one body is none, as it would be alone: its solid may sleep.
    const auto forces =
        force_.empty() ? std::span<double>() : std::span(force_).subspan(3 * c.first, 3 * c.count);
    if (!loaded[k]) {
      std::fill(mine.begin(), mine.end(), 0.0);
      std::fill(forces.begin(), forces.end(), 0.0);
    } else {
      if (!forces.empty()) bodies_->force(c.body, readings_[c.body], forces);
      // Trapezoidal rule on power and force: 2nd order in the window, as the coupling itself.
      balance.work = 0.5 * window * (wall.power + load.power);
      for (std::size_t a = 0; a < 3; ++a)
        balance.impulse[a] = 0.5 * window * (wall.force[a] + load.force[a]);
      wall.power = load.power;
      wall.force = load.force;
      const double peak = *std::max_element(mine.begin(), mine.end());
      if (peak > wall.peak) {
        wall.peak = peak;
        wall.peak_time = clock_.time;
      }
    }
    report.work += balance.work;
    for (std::size_t a = 0; a < 3; ++a) report.impulse[a] += balance.impulse[a];
    report.interfaces.push_back(balance);
  }
  return report;
}

void FlowRun::move_coupled_bodies(const link::Order& order) {
  for (const CoupledBody& c : coupled_bodies_) {
    const auto position = order.position.subspan(3 * c.first, 3 * c.count);
    const auto velocity = order.velocity.subspan(3 * c.first, 3 * c.count);
    // One of several may rest where it is: no path, as if it had been said so.
    const bool rests =
        coupled_bodies_.size() > 1 &&
        std::all_of(velocity.begin(), velocity.end(), [](double v) { return v == 0.0; }) &&
        std::equal(position.begin(), position.end(), bodies_->position(c.body).begin());
    if (rests) continue;
    if (order.wall_path == link::WallPath::cubic)
      bodies_->set_path(c.body, order.t_begin, order.t_end, position, velocity);
    else
      bodies_->set_straight_path(c.body, order.t_begin, order.t_end, position);
  }
}

/// The coupler's next order, which the root has, on every rank.
link::Order FlowRun::await_order(link::Participant* coupler) {
  link::Order order;
  if (coupler != nullptr) order = coupler->next();
  if (ranks_->alone()) return order;
  ranks_->await_root();
  struct Header {
    link::Order::Kind kind;
    link::WallPath wall_path;
    std::uint32_t iteration;
    bool idle;
    std::uint64_t window;
    double t_begin, t_end;
    std::size_t n_position, n_velocity;
  };
  Header h{order.kind,  order.wall_path,       order.iteration,
           order.idle,  order.window,          order.t_begin,
           order.t_end, order.position.size(), order.velocity.size()};
  ranks_->broadcast(std::span<Header>(&h, 1));
  order.kind = h.kind;
  order.wall_path = h.wall_path;
  order.iteration = h.iteration;
  order.idle = h.idle;
  order.window = h.window;
  order.t_begin = h.t_begin;
  order.t_end = h.t_end;
  const auto share = [&](std::span<const double>& values, std::size_t count,
                         std::vector<double>& room) {
    room.assign(values.begin(), values.end());
    room.resize(count);
    ranks_->broadcast(std::span<double>(room));
    values = room;
  };
  share(order.position, h.n_position, ordered_position_);
  share(order.velocity, h.n_velocity, ordered_velocity_);
  if (order.kind == link::Order::Kind::checkpoint)
    order.checkpoint = ranks_->broadcast(order.checkpoint.string());
  return order;
}

void FlowRun::run_coupled(link::Participant* coupler, bool forces_taken) {
  if (forces_taken) {
    if (coupler != nullptr) coupler->send_forces();
    force_.assign(3 * overpressure_.size(), 0.0);
  }
  std::signal(SIGINT,
              SIG_IGN);  // Ctrl-C reaches the whole group; the coupler decides what it means
  const double first_step = stable_step();
  if (coupler != nullptr)
    coupler->ready(first_step, static_cast<std::uint64_t>(clock_.window), clock_.time);
  while (true) {
    const auto order = await_order(coupler);
    if (output_waits_ && order.iteration <= 1) {  // the last answer counts
      output_waits_ = false;
      write_step();
    }
    if (order.kind == link::Order::Kind::finish) break;
    if (order.kind == link::Order::Kind::checkpoint) {
      save(order.checkpoint);
      if (coupler != nullptr) coupler->checkpoint_written();
      continue;
    }
    const double begin = omp_get_wtime();
    if (order.iteration == 1) keep_state();
    if (order.iteration > 1) rewind();
    iterating_ = order.iteration > 0;
    if (!order.idle) move_coupled_bodies(order);
    const auto steps_before = clock_.step;
    step_to(order.t_end);
    clock_.window = static_cast<std::int64_t>(order.window);
    auto report = finish_window(order);
    report.steps_taken = static_cast<std::uint32_t>(clock_.step - steps_before);
    report.compute_seconds = omp_get_wtime() - begin;
    if (coupler != nullptr) coupler->send(report);
  }
  write_outputs(true);
  write_summary();
  if (coupler != nullptr) coupler->goodbye();
}
}  // namespace ocublast::flow
