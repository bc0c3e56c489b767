#include "coupler/link/participant.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <utility>

#include "coupler/link/participant_state.hpp"

namespace ocublast::link {
namespace {

/// Linger of the last message, so that it leaves before the process ends.
constexpr int farewell_linger_ms = 1000;
}  // namespace

Participant::Participant(const Connection& connection)
    : state_(std::make_unique<State>(connection)) {
  keep_freed_memory();
  auto& s = *state_;
  s.connect();
  Header hello;
  hello.kind = Kind::hello;
  hello.role = connection.role;
  hello.name = connection.name;
  hello.program = connection.program;
  hello.token = s.connection.token;
  hello.case_hash = connection.case_hash;
  s.offer_memory(hello);
  s.send(std::move(hello), std::string_view());
  const Header welcome = s.await({Kind::welcome}, "WELCOME");
  s.connection.silence_limit = welcome.silence_limit;
  s.accept_memory(welcome);
}

Participant::~Participant() {
  if (state_ && state_->socket && !state_->ended)
    abort(std::uncaught_exceptions() > 0 ? "ended by an error" : "ended without a word");
}
Participant::Participant(Participant&&) noexcept = default;
Participant& Participant::operator=(Participant&& other) noexcept {
  if (state_ && state_->socket && !state_->ended) abort("replaced by another participant");
  state_ = std::move(other.state_);
  return *this;
}

void Participant::send_mesh(const InterfaceMesh& mesh) {
  auto& s = *state_;
  const std::string payload = mesh_payload(mesh);
  Header header;
  header.kind = Kind::mesh;
  header.fields = field::mesh;
  header.n_vertices = mesh.n_vertices();
  header.n_triangles = mesh.triangles.size() / 3;
  header.n_quads = mesh.n_quads;
  header.mesh_name = mesh.name;
  header.takes_force = s.connection.role == Role::solid && s.takes_force;
  header.mesh_hash = checksum({reinterpret_cast<const std::byte*>(payload.data()), payload.size()});
  const State::Part own{mesh.name, header.n_vertices, header.mesh_hash};
  if (s.connection.role == Role::solid || s.meshes.size() == 1) {
    s.meshes = {own};
  } else {  // in place of the one of this name
    const auto at = std::find_if(s.meshes.begin(), s.meshes.end(),
                                 [&](const State::Part& p) { return p.name == own.name; });
    if (at == s.meshes.end())
      throw s.error(fmt::format("a mesh '{}' of its own: no solid is called so", own.name));
    *at = own;
  }
  s.count_parts();
  s.send(std::move(header), payload);
}

std::vector<InterfaceMesh> Participant::receive_meshes() {
  auto& s = *state_;
  std::vector<InterfaceMesh> found;
  s.meshes.clear();
  do {
    const Header header = s.await({Kind::mesh}, "the interface mesh of a solid");
    const auto bytes = s.payload(header);
    found.push_back(mesh_from_payload(header, bytes));
    s.meshes.push_back({header.mesh_name, header.n_vertices, checksum(bytes)});
    if (found.size() == header.n_interfaces) break;
  } while (true);
  s.count_parts();
  return found;
}

InterfaceMesh Participant::receive_mesh() {
  auto meshes = receive_meshes();
  if (meshes.size() != 1)
    throw state_->error(
        fmt::format("{} solids take part, this flow side knows one", meshes.size()));
  return std::move(meshes.front());
}

void Participant::take_forces() {
  state_->takes_force = true;
}
void Participant::send_forces() {
  state_->takes_force = true;
}

namespace {

/// Adds a part to a message if it is there; its length must be that of the interface mesh.
void add_part(Header& header, std::vector<std::span<const double>>& parts,
              std::span<const double> values, std::uint32_t bit, std::size_t expected,
              std::string_view name) {
  if (values.empty()) return;
  if (values.size() != expected)
    throw LinkError(fmt::format("{}: {} has {} values, the interface mesh needs {}",
                                to_word(header.kind), name, values.size(), expected));
  header.fields |= bit;
  parts.push_back(values);
}

}  // namespace

void Participant::ready(double stable_step, std::uint64_t window, double time,
                        const InitialMotion& motion) {
  auto& s = *state_;
  Header header;
  header.kind = Kind::ready;
  header.window = s.finished_window = window;
  header.time = time;
  header.stable_step = stable_step;
  header.mesh_hash = s.mesh_hash;
  header.n_vertices = s.n_vertices;
  header.shares_memory = s.we_read;
  header.takes_packets = static_cast<bool>(s.packets);
  header.takes_force = s.takes_force;
  const std::size_t most = s.connection.role == Role::flow ? s.load_components() : 9;
  const std::size_t bytes = (most * s.n_vertices + s.balance_doubles()) * sizeof(double);
  if (s.coupler_reads && s.n_vertices > 0) s.memory = SharedMemory(bytes, memory_slots(bytes));
  std::vector<std::span<const double>> parts;
  const std::size_t n = 3 * s.n_vertices;
  add_part(header, parts, motion.position, field::position, n, "position");
  add_part(header, parts, motion.velocity, field::velocity, n, "velocity");
  add_part(header, parts, motion.acceleration, field::acceleration, n, "acceleration");
  s.send(std::move(header), parts);
}

Order Participant::next() {
  auto& s = *state_;
  if (s.owes_result || s.owes_done)
    throw s.error("next order asked for before the last one was answered");
  s.order = s.await({Kind::step, Kind::checkpoint, Kind::finish}, "the next order");
  const Header& header = s.order;
  Order order;
  order.window = header.window;
  if (header.kind == Kind::finish) {
    order.kind = Order::Kind::finish;
    return order;
  }
  if (header.kind == Kind::checkpoint) {
    order.kind = Order::Kind::checkpoint;
    order.checkpoint = header.directory;
    s.owes_done = true;
    return order;
  }
  const bool again = header.iteration > 1;
  if (header.window != s.finished_window + (again ? 0 : 1) ||
      (again && header.iteration != s.iteration + 1))
    throw s.error(fmt::format("STEP for window {}, iteration {} came after window {}, iteration {}",
                              header.window, header.iteration, s.finished_window, s.iteration));
  s.iteration = header.iteration;
  const PayloadView view =
      header.fields == 0 ? PayloadView{} : view_payload(header, s.payload(header));
  const bool complete = s.connection.role == Role::flow
                            ? !view.position.empty() && !view.velocity.empty()
                            : !view.overpressure.empty() || (s.takes_force && !view.force.empty());
  if (header.idle ? header.fields != 0 : !complete || header.n_vertices != s.n_vertices)
    throw s.error(fmt::format("STEP for window {} lacks what the {} side needs", header.window,
                              to_word(s.connection.role)));
  order.t_begin = header.t_begin;
  order.t_end = header.t_end;
  order.steps = header.steps;
  order.load_shape = header.load_shape;
  order.wall_path = header.wall_path;
  order.iteration = header.iteration;
  order.wants_acceleration = header.wants_acceleration;
  order.idle = header.idle;
  order.position = view.position;
  order.velocity = view.velocity;
  order.overpressure = view.overpressure;
  order.force = view.force;
  s.owes_result = true;
  return order;
}

void Participant::send(const Report& report) {
  auto& s = *state_;
  if (!s.owes_result) throw s.error("a report without a step order");
  Header header;
  header.kind = Kind::result;
  header.window = s.order.window;
  header.t_begin = s.order.t_begin;
  header.t_end = s.order.t_end;
  header.steps = report.steps_taken;
  header.iteration = s.order.iteration;
  header.idle = report.idle;
  header.stable_step = report.stable_step;
  header.work = report.work;
  header.impulse = report.impulse;
  header.impedance = report.impedance;
  header.mass_per_area = report.mass_per_area;
  header.compute_seconds = report.compute_seconds;
  header.status = report.status;
  header.n_vertices = s.n_vertices;
  std::vector<std::span<const double>> parts;
  std::vector<double> balance;
  for (const auto& one : report.interfaces)
    balance.insert(balance.end(), {one.work, one.impulse[0], one.impulse[1], one.impulse[2]});
  if (!report.idle) {
    add_part(header, parts, report.position, field::position, 3 * s.n_vertices, "position");
    add_part(header, parts, report.velocity, field::velocity, 3 * s.n_vertices, "velocity");
    if (s.order.wants_acceleration)
      add_part(header, parts, report.acceleration, field::acceleration, 3 * s.n_vertices,
               "acceleration");
    add_part(header, parts, report.overpressure, field::overpressure, s.n_vertices, "overpressure");
    add_part(header, parts, report.force, field::force, 3 * s.n_vertices, "force");
    header.n_interfaces = s.balance_doubles() > 0 && !balance.empty()
                              ? static_cast<std::uint32_t>(s.meshes.size())
                              : 1;
    if (header.n_interfaces > 1)
      add_part(header, parts, balance, field::balance, s.balance_doubles(), "balance");
  }
  s.send_report(std::move(header), parts);
  s.owes_result = false;
  s.finished_window = s.order.window;
}

Participant::Room Participant::room() {
  auto& s = *state_;
  const auto all = s.report_room();
  Room room;
  if (s.connection.role == Role::flow) {
    (s.takes_force ? room.force : room.overpressure) =
        all.first(s.load_components() * s.n_vertices);
    return room;
  }
  const std::size_t n = 3 * s.n_vertices;
  room.position = all.first(n);
  room.velocity = all.subspan(n, n);
  room.acceleration = all.subspan(2 * n);
  return room;
}

void Participant::checkpoint_written() {
  auto& s = *state_;
  if (!s.owes_done) throw s.error("a checkpoint reported that was not ordered");
  Header header;
  header.kind = Kind::done;
  header.window = s.order.window;
  s.send(std::move(header), std::string_view());
  s.owes_done = false;
}

void Participant::goodbye() {
  auto& s = *state_;
  Header header;
  header.kind = Kind::bye;
  header.window = s.finished_window;
  s.send(std::move(header), std::string_view());
  s.socket->set(zmq::sockopt::linger, farewell_linger_ms);
  s.ended = true;
}

void Participant::guard(const std::function<void()>& work) {
  try {
    work();
  } catch (const CaseError& error) {
    abort(error.what(), ExitCode::bad_case);
    throw;
  } catch (const LinkError& error) {
    abort(error.what(), ExitCode::link);
    throw;
  } catch (const NumericsError& error) {
    abort(error.what(), ExitCode::numerics);
    throw;
  } catch (const std::exception& error) {
    abort(error.what(), ExitCode::other);
    throw;
  }
}

void Participant::abort(const std::string& reason, ExitCode code) noexcept {
  if (!state_ || !state_->socket || state_->ended) return;
  auto& s = *state_;
  s.ended = true;
  try {
    Header header;
    header.kind = Kind::abort;
    header.window = s.finished_window;
    header.reason = reason;
    header.exit_code = static_cast<std::uint32_t>(code);
    header.run_id = s.run_id;
    header.seq = ++s.sent;
    const std::string bytes = encode(header);
    if (s.socket->send(zmq::buffer(bytes), zmq::send_flags::sndmore | zmq::send_flags::dontwait))
      s.socket->send(zmq::message_t(), zmq::send_flags::dontwait);
    s.socket->set(zmq::sockopt::linger, farewell_linger_ms);
  } catch (const std::exception&) {
    // Nobody is left to be told.
  }
}

}  // namespace ocublast::link
