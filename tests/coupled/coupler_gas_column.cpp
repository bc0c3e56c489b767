// Toy flow side: isentropic gas column on a Lagrangian staggered grid, centred in space, RK4 in
// time: d x_i/dt = u_i, m_i d u_i/dt = p_{i-1/2} - p_{i+1/2}, p = p0 (V0 / V)^gamma. The last node
// is the wall and follows the path between the wall states the coupler sends. Second order.
#include "coupler_toy.hpp"

namespace {

using ocublast::link::Order;
using ocublast::link::WallPath;

struct Wall {
  double x = toy::length;
  double v = 0.0;
};

/// Position of the wall at fraction s of a window of width w.
double wall_position(const Wall& a, const Wall& b, double w, double s, WallPath path) {
  if (path == WallPath::straight) return a.x + s * (b.x - a.x);
  const double s2 = s * s, s3 = s2 * s;
  return (2 * s3 - 3 * s2 + 1) * a.x + (s3 - 2 * s2 + s) * w * a.v + (3 * s2 - 2 * s3) * b.x +
         (s3 - s2) * w * b.v;
}

class Column {
 public:
  explicit Column(std::int64_t cells)
      : n_(static_cast<std::size_t>(cells)),
        h_(toy::length / static_cast<double>(cells)),
        x_(n_ + 1),
        u_(n_ + 1) {
    const double k = toy::wave_phase / toy::length;
    for (std::size_t i = 0; i <= n_; ++i) {
      x_[i] = h_ * static_cast<double>(i);
      u_[i] = toy::amplitude * toy::omega() * std::sin(k * x_[i]);
    }
    wall.v = u_[n_];
  }
  [[nodiscard]] double stable_step(double cfl) const { return cfl * h_ / toy::sound_speed(); }
  [[nodiscard]] double cell_pressure(const std::vector<double>& x, std::size_t i) const {
    return toy::p0 * std::pow(h_ / (x[i + 1] - x[i]), toy::gamma);
  }
  /// Extrapolated from the two cells nearest to the wall: second order.
  [[nodiscard]] double wall_overpressure() const {
    return 1.5 * cell_pressure(x_, n_ - 1) - 0.5 * cell_pressure(x_, n_ - 2) - toy::p0;
  }
  void step(double dt, double s_begin, double s_end, const Wall& target, double w, WallPath path);
  [[nodiscard]] std::vector<double> save() const {
    std::vector<double> all(x_);
    all.insert(all.end(), u_.begin(), u_.end());
    all.insert(all.end(), {wall.x, wall.v});
    return all;
  }
  void load(const std::vector<double>& all) {
    std::copy_n(all.begin(), n_ + 1, x_.begin());
    std::copy_n(all.begin() + static_cast<long>(n_ + 1), n_ + 1, u_.begin());
    wall = {all[2 * n_ + 2], all[2 * n_ + 3]};
  }
  Wall wall;

 private:
  std::size_t n_;
  double h_;
  std::vector<double> x_, u_;
};

void Column::step(double dt, double s_begin, double s_end, const Wall& target, double w,
                  WallPath path) {
  const double half = 0.5;
  const double fractions[4] = {0.0, half, half, 1.0};
  const double weights[4] = {1.0 / 6, 1.0 / 3, 1.0 / 3, 1.0 / 6};
  const auto x0 = x_, u0 = u_;
  auto x_sum = x_, u_sum = u_, x = x_, u = u_;
  for (int stage = 0; stage < 4; ++stage) {
    x[n_] = wall_position(wall, target, w, s_begin + fractions[stage] * (s_end - s_begin), path);
    std::vector<double> du(n_ + 1, 0.0);
    for (std::size_t i = 1; i < n_; ++i)
      du[i] = (cell_pressure(x, i - 1) - cell_pressure(x, i)) / (toy::rho * h_);
    const auto u_stage = u;
    const double next = stage < 3 ? fractions[stage + 1] : 0.0;
    for (std::size_t i = 1; i < n_; ++i) {
      x_sum[i] += weights[stage] * dt * u_stage[i];
      u_sum[i] += weights[stage] * dt * du[i];
      x[i] = x0[i] + next * dt * u_stage[i];
      u[i] = u0[i] + next * dt * du[i];
    }
  }
  x_ = x_sum;
  u_ = u_sum;
  x_[n_] = wall_position(wall, target, w, s_end, path);
}

struct Keys {
  std::int64_t cells = 32;
  double cfl = 0.8;
  std::int64_t vertices = 0;  ///< of a mesh of its own along an edge; 0: the solid's mesh
  toy::Fault fault;
};

double mean_x(std::span<const double> vectors) {
  double sum = 0.0;
  for (std::size_t i = 0; i < vectors.size(); i += 3) sum += vectors[i];
  return sum / static_cast<double>(vectors.size() / 3);
}

ocublast::link::Report advance(Column& column, const Order& order, const Keys& keys,
                               std::span<double> load) {
  const auto begin = std::chrono::steady_clock::now();
  const double w = order.t_end - order.t_begin;
  const Wall target =
      order.idle ? column.wall : Wall{mean_x(order.position), mean_x(order.velocity)};
  const double p_begin = column.wall_overpressure();
  const double x_begin = column.wall.x;
  for (std::uint32_t k = 0; k < order.steps; ++k)
    column.step(w / order.steps, double(k) / order.steps, double(k + 1) / order.steps, target, w,
                order.wall_path);
  column.wall = target;
  const double p = column.wall_overpressure();
  std::fill(load.begin(), load.end(), p);
  ocublast::link::Report report;
  report.overpressure = load;
  report.stable_step = column.stable_step(keys.cfl);
  report.steps_taken = order.steps;
  report.work = 0.5 * (p_begin + p) * (target.x - x_begin);
  report.impulse = {0.5 * (p_begin + p) * w, 0.0, 0.0};
  report.impedance = toy::rho * toy::sound_speed();
  report.compute_seconds = toy::seconds_since(begin);
  report.status = "gas";
  if (keys.fault.is("not_finite", order.window)) load[load.size() / 2] = std::nan("");
  if (keys.fault.is("size", order.window)) report.overpressure = report.overpressure.first(1);
  return report;
}

void couple(ocublast::link::Participant& coupler, const ocublast::CommandLine& line,
            const Keys& keys) {
  keys.fault.happen_in("hello");
  static_cast<void>(coupler.receive_mesh());
  if (keys.vertices > 0) coupler.send_mesh(toy::make_face(keys.vertices));
  keys.fault.happen(0);
  keys.fault.happen_in("ready");
  Column column(keys.cells);
  std::uint64_t window = 0;
  double time = 0.0;
  if (!line.resume.empty()) {
    const auto place = ocublast::link::require_checkpoint(line.resume);
    auto all = toy::read_doubles(place.directory / "flow.state");
    time = all.back();
    all.pop_back();
    window = static_cast<std::uint64_t>(all.back());
    all.pop_back();
    column.load(all);
  }
  coupler.ready(column.stable_step(keys.cfl), window, time);
  std::vector<double> begin_of_window;
  for (auto order = coupler.next(); order.kind != Order::Kind::finish; order = coupler.next()) {
    if (order.kind == Order::Kind::checkpoint) {
      keys.fault.happen_in("checkpoint");
      auto all = column.save();
      all.push_back(static_cast<double>(window));
      all.push_back(time);
      toy::write_doubles(order.checkpoint / "flow.state", all);
      coupler.checkpoint_written();
      continue;
    }
    keys.fault.happen(order.window);
    if (order.iteration == 2) keys.fault.happen_in("iteration");
    if (order.iteration == 1) begin_of_window = column.save();
    if (order.iteration > 1) column.load(begin_of_window);
    coupler.send(advance(column, order, keys, coupler.room().overpressure));
    time = order.t_end;
    window = order.window;
  }
  keys.fault.happen_in("farewell");
  coupler.goodbye();
}

int run(const ocublast::CommandLine& line) {
  ocublast::CaseReader reader(line.source);
  static_cast<void>(ocublast::read_case_common(reader));
  auto section = reader.section("flow", "toy gas column");
  Keys keys;
  section.integer("cells", keys.cells, {.min = 2, .help = "cells"});
  section.real("cfl", keys.cfl,
               {.unit = "1", .min = 0.0, .above_min = true, .help = "Courant number"});
  section.integer("own_vertices", keys.vertices,
                  {.min = 0, .help = "vertices along an edge of a mesh of its own"});
  keys.fault.declare(section);
  keys.fault.from_environment("OCU_TOY_FAULT_FLOW");
  reader.finish();
  if (line.check_only) return 0;
  if (const char* rank = std::getenv("OMPI_COMM_WORLD_RANK");
      rank != nullptr && std::string(rank) != "0") {
    // A rank that computes its part for ever: rank 0 alone speaks, and sees the coupler go. Nobody
    // but who launched it can end it.
    if (keys.fault.kind != "rank") keys.fault.hang("rank");
    toy::Fault::await_go();
    ::kill(::getpid(), SIGKILL);
  }
  const std::uint64_t hash = reader.hash() + (keys.fault.kind == "case_hash" ? 1 : 0);
  auto connection =
      ocublast::link::connection_from_environment(ocublast::link::Role::flow, "gas_column 1", hash);
  if (keys.fault.kind == "token") connection.token += "x";
  if (keys.fault.kind == "absent") std::this_thread::sleep_for(std::chrono::hours(1));
  if (keys.fault.kind == "early") return 1;
  keys.fault.happen_in("start");
  ocublast::link::Participant coupler(connection);
  coupler.guard([&] { couple(coupler, line, keys); });
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const auto line = ocublast::parse_command_line(argc, argv, "gas_column", "toy flow side");
    return line ? run(*line) : 0;
  } catch (...) {
    return ocublast::report_current_exception("gas_column");
  }
}
