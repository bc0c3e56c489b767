// Toy solid side: a piston of mass M on a spring K (both per area), velocity Verlet with the load
// linear (or constant) in a window. Second order. At the end it writes its largest errors against
// the exact solution to OUT/spring_errors.txt and its whole history to OUT/spring_history.txt.
#include <fmt/format.h>

#include "coupler_toy.hpp"

namespace {

using ocublast::link::LoadShape;
using ocublast::link::Order;

struct Keys {
  double mass = 5.0;
  double stable_step = 0.01;
  bool takes_force = false;
  bool scattered = false;
  std::int64_t vertices = 2;
  toy::Fault fault;
};

struct Errors {
  double position = 0.0, velocity = 0.0, pressure = 0.0;
};

struct Piston {
  double d = 0.0;                       ///< m
  double v = toy::exact_velocity(0.0);  ///< m/s
  double p = 0.0;                       ///< Pa, load at the end of the last window
  double time = 0.0;                    ///< s
  double a = 0.0;                       ///< m/s^2
};

double advance(Piston& s, const Order& order, double p_end, double mass) {
  const double w = order.t_end - order.t_begin;
  const double dt = w / order.steps;
  const double K = toy::spring(mass);
  const double p_begin = order.load_shape == LoadShape::linear ? s.p : p_end;
  double work = 0.0;
  for (std::uint32_t k = 0; k < order.steps; ++k) {
    const double p_a = p_begin + (p_end - p_begin) * k / order.steps;
    const double p_b = p_begin + (p_end - p_begin) * (k + 1) / order.steps;
    const double v_half = s.v + 0.5 * dt * (p_a - K * s.d) / mass;
    const double d_before = s.d;
    s.d += dt * v_half;
    s.v = v_half + 0.5 * dt * (p_b - K * s.d) / mass;
    work += 0.5 * (p_a + p_b) * (s.d - d_before);
    s.a = (p_b - K * s.d) / mass;
  }
  s.p = p_end;
  s.time = order.t_end;
  return work;
}

void note_errors(Errors& worst, const Piston& s) {
  const double d_scale = toy::amplitude * std::sin(toy::wave_phase);
  const double p_scale =
      toy::rho * toy::sound_speed() * toy::omega() * toy::amplitude * std::cos(toy::wave_phase);
  worst.position =
      std::max(worst.position, std::abs(s.d - toy::exact_displacement(s.time)) / d_scale);
  worst.velocity = std::max(worst.velocity,
                            std::abs(s.v - toy::exact_velocity(s.time)) / (d_scale * toy::omega()));
  worst.pressure =
      std::max(worst.pressure, std::abs(s.p - toy::exact_overpressure(s.time)) / p_scale);
}

void fill(std::span<double> x, std::span<double> v, const ocublast::link::InterfaceMesh& mesh,
          const Piston& s) {
  for (std::size_t i = 0; i < x.size(); i += 3) {
    x[i] = mesh.vertices[i] + s.d;
    x[i + 1] = mesh.vertices[i + 1];
    x[i + 2] = mesh.vertices[i + 2];
    v[i] = s.v;
    v[i + 1] = v[i + 2] = 0.0;
  }
}

void couple(ocublast::link::Participant& coupler, const ocublast::CommandLine& line,
            const Keys& keys) {
  auto mesh = toy::make_face(keys.vertices);
  if (keys.scattered) mesh.triangles.clear();
  keys.fault.happen(0);
  keys.fault.happen_in("hello");
  coupler.send_mesh(mesh);
  if (keys.takes_force) coupler.take_forces();
  Piston piston;
  std::uint64_t window = 0;
  if (!line.resume.empty()) {
    const auto place = ocublast::link::require_checkpoint(line.resume);
    const auto all = toy::read_doubles(place.directory / "solid.state");
    piston = {all[0], all[1], all[2], all[3], all[4]};
    window = place.window;
  }
  std::vector<double> x(mesh.vertices.size()), v(mesh.vertices.size(), 0.0);
  fill(x, v, mesh, piston);
  ocublast::link::InitialMotion motion;
  if (window == 0) motion.velocity = v;
  keys.fault.happen_in("ready");
  coupler.ready(keys.stable_step, window, piston.time, motion);
  Errors worst;
  std::string history;
  Piston begin_of_window;
  Piston seen = piston;  // the last window whose answer counts
  const auto note = [&] {
    if (seen.time == piston.time) return;
    seen = piston;
    note_errors(worst, piston);
    history += fmt::format("{} {} {} {} {}\n", window, piston.time, piston.d, piston.v, piston.p);
  };
  for (auto order = coupler.next(); order.kind != Order::Kind::finish; order = coupler.next()) {
    if (order.iteration <= 1) note();
    if (order.kind == Order::Kind::checkpoint) {
      keys.fault.happen_in("checkpoint");
      toy::write_doubles(order.checkpoint / "solid.state",
                         {piston.d, piston.v, piston.p, piston.time, piston.a});
      coupler.checkpoint_written();
      continue;
    }
    keys.fault.happen(order.window);
    if (order.iteration == 2) keys.fault.happen_in("iteration");
    const auto begin = std::chrono::steady_clock::now();
    double p = 0.0;
    for (const double value : order.overpressure) p += value;
    if (!order.overpressure.empty()) p /= static_cast<double>(order.overpressure.size());
    for (std::size_t i = 0; i < order.force.size(); i += 3)
      p += order.force[i];  // on a face of 1 m^2
    if (order.iteration == 1) begin_of_window = piston;
    if (order.iteration > 1) piston = begin_of_window;
    window = order.window;
    const double before = piston.p;
    ocublast::link::Report report;
    report.work = advance(piston, order, p, keys.mass);
    report.impulse = {0.5 * (before + p) * (order.t_end - order.t_begin), 0.0, 0.0};
    const auto room = coupler.room();
    fill(room.position, room.velocity, mesh, piston);
    if (!room.acceleration.empty())
      std::fill(room.acceleration.begin(), room.acceleration.end(), 0.0);
    for (std::size_t i = 0; i < room.acceleration.size(); i += 3) room.acceleration[i] = piston.a;
    report.position = room.position;
    report.velocity = room.velocity;
    report.acceleration = room.acceleration;
    report.stable_step = keys.stable_step;
    report.steps_taken = order.steps;
    report.mass_per_area = keys.mass;
    report.compute_seconds = toy::seconds_since(begin);
    if (keys.fault.is("not_finite", order.window))
      room.velocity[4] = std::numeric_limits<double>::infinity();
    if (keys.fault.is("nudge", order.window) && std::getenv("OCU_TOY_NUDGE") != nullptr)
      room.velocity[6] *= 1.0 + 1e-6;
    if (keys.fault.is("size", order.window)) report.position = report.position.first(3);
    coupler.send(report);
  }
  note();
  if (!line.out.empty()) {
    std::ofstream(line.out / "spring_errors.txt")
        << fmt::format("{} {} {}\n", worst.position, worst.velocity, worst.pressure);
    std::ofstream(line.out / "spring_history.txt") << history;
  }
  keys.fault.happen_in("farewell");
  coupler.goodbye();
}

int run(const ocublast::CommandLine& line) {
  ocublast::CaseReader reader(line.source);
  static_cast<void>(ocublast::read_case_common(reader));
  auto section = reader.section("solid", "toy piston on a spring");
  Keys keys;
  section.real("mass_kg_m2", keys.mass,
               {.unit = "kg/m^2", .min = 0.0, .above_min = true, .help = "piston"});
  section.real("stable_step_s", keys.stable_step,
               {.unit = "s", .min = 0.0, .above_min = true, .help = "step"});
  section.integer("vertices", keys.vertices,
                  {.min = 2, .help = "vertices along an edge of the face"});
  section.flag("takes_force", keys.takes_force, "takes forces where the flow has another mesh");
  section.flag("scattered", keys.scattered, "its mesh has no triangles");
  keys.fault.declare(section);
  keys.fault.from_environment("OCU_TOY_FAULT_SOLID");
  reader.finish();
  if (line.check_only) return 0;
  const std::uint64_t hash = reader.hash() + (keys.fault.kind == "case_hash" ? 1 : 0);
  auto connection =
      ocublast::link::connection_from_environment(ocublast::link::Role::solid, "spring 1", hash);
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
    const auto line = ocublast::parse_command_line(argc, argv, "spring", "toy solid side");
    return line ? run(*line) : 0;
  } catch (...) {
    return ocublast::report_current_exception("spring");
  }
}
