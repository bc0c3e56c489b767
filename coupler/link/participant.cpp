#include "coupler/link/participant.hpp"

#include <algorithm>
#include <cstring>
#include <exception>
#include <initializer_list>
#include <optional>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include "coupler/link/keys.hpp"
#include "coupler/link/message.hpp"
#include "coupler/link/payload.hpp"
#include "coupler/link/socket.hpp"

namespace ocublast::link {
namespace {

constexpr int watched_events = ZMQ_EVENT_HANDSHAKE_SUCCEEDED | ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL |
                               ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL |
                               ZMQ_EVENT_HANDSHAKE_FAILED_AUTH | ZMQ_EVENT_DISCONNECTED |
                               ZMQ_EVENT_CLOSED;
/// Linger of the last message, so that it leaves before the process ends.
constexpr int farewell_linger_ms = 1000;
/// Pause between two attempts to reach a coupler that does not listen yet.
constexpr auto retry_pause = std::chrono::milliseconds(100);
/// Longest time one attempt may take, name resolution included.
constexpr auto attempt_limit = std::chrono::seconds(3);

}  // namespace

/// Order matters: the sockets end before the context.
struct Participant::State {
  Connection connection;
  zmq::context_t context{1};
  std::unique_ptr<zmq::socket_t> socket;
  std::unique_ptr<ConnectionMonitor> monitor;
  int attempts = 0;

  std::uint64_t run_id = 0;
  std::uint64_t sent = 0;      ///< seq of the last message sent
  std::uint64_t received = 0;  ///< seq of the last message received
  /// The interface as this side sees it: one mesh per solid.
  struct Part {
    std::string name;
    std::uint64_t n_vertices = 0;
    std::uint64_t hash = 0;
  };
  std::vector<Part> meshes;
  std::uint64_t n_vertices = 0;    ///< of all parts
  std::uint64_t mesh_hash = 0;
  std::uint64_t finished_window = 0;
  std::uint32_t iteration = 0; ///< of that window
  Header order;                ///< the last STEP or CHECKPOINT
  bool takes_force = false;
  bool owes_result = false;
  bool owes_done = false;
  bool ended = false;          ///< BYE or ABORT was sent or received, or the coupler is gone
  Frames frames;               ///< of the last message; an Order's spans point into it
  std::vector<double> aside;

  std::optional<MemoryProbe> probe;
  MemoryReader reader;
  bool coupler_reads = false;  ///< our memory
  bool we_read = false;        ///< the coupler's
  SharedMemory memory;         ///< for reports
  std::uint64_t reports = 0;   ///< sent with values; the slot of the next one
  zmq::message_t frame;        ///< for the next report where memory is not shared

  explicit State(const Connection& c) : connection(c) {}

  [[nodiscard]] std::string who() const {
    const std::string name = connection.name.empty() ? "" : fmt::format(" '{}'", connection.name);
    return fmt::format("{}{} ({})", to_word(connection.role), name, connection.program);
  }
  [[nodiscard]] LinkError error(std::string_view what) const {
    return LinkError(fmt::format("{}: {}; last finished window {}", who(), what, finished_window));
  }

  void connect();
  [[nodiscard]] bool try_connect(std::string& failure);
  void send(Header header, std::span<const std::span<const double>> parts);
  void send(Header header, std::string_view payload);
  void send(Header header, zmq::message_t payload);
  void send_report(Header header, std::span<const std::span<const double>> parts);
  [[nodiscard]] Header await(std::initializer_list<Kind> expected, std::string_view what);
  [[nodiscard]] bool coupler_gone();
  [[nodiscard]] std::optional<Header> take();
  void offer_memory(Header& hello);
  void accept_memory(const Header& welcome);
  [[nodiscard]] std::size_t report_doubles() const {
    return (connection.role == Role::flow ? 1 : order.wants_acceleration ? 9 : 6) * n_vertices + balance_doubles();
  }
  [[nodiscard]] std::size_t balance_doubles() const { return meshes.size() > 1 ? 4 * meshes.size() : 0; }
  void count_parts();
  [[nodiscard]] std::span<double> report_room();
  [[nodiscard]] std::span<const std::byte> payload(const Header& header) {
    return header.memory.pid != 0 ? reader.view(header.memory, header.payload_bytes)
                                  : aligned_payload(frames.payload, aside);
  }
};

bool Participant::State::try_connect(std::string& failure) {
  monitor.reset();
  socket = std::make_unique<zmq::socket_t>(context, zmq::socket_type::dealer);
  set_common_options(*socket, connection.silence_limit);
  socket->set(zmq::sockopt::immediate, 1);
  // A participant that comes back to another coupler in the middle of a run is never right.
  socket->set(zmq::sockopt::reconnect_ivl, -1);
  if (!connection.keys.empty()) {
    const ParticipantKeys keys = read_keys(
        connection.keys, connection.name.empty() ? std::string(to_word(connection.role)) : connection.name);
    socket->set(zmq::sockopt::curve_serverkey, keys.coupler_public);
    socket->set(zmq::sockopt::curve_publickey, keys.own.public_key);
    socket->set(zmq::sockopt::curve_secretkey, keys.own.secret_key);
    connection.token = keys.token;
  }
  monitor = std::make_unique<ConnectionMonitor>(context, *socket,
                                                fmt::format("monitor-{}", ++attempts), watched_events);
  socket->connect(connection.endpoint);
  const auto deadline = Clock::now() + attempt_limit;
  while (Clock::now() < deadline) {
    zmq::pollitem_t item{monitor->handle().handle(), 0, ZMQ_POLLIN, 0};
    zmq::poll(&item, 1, time_left(deadline));
    while (const auto event = monitor->next()) {
      if (event->event == ZMQ_EVENT_HANDSHAKE_SUCCEEDED) return true;
      failure = event->event == ZMQ_EVENT_HANDSHAKE_FAILED_AUTH ? "it refused our key"
                : event->event == ZMQ_EVENT_CLOSED              ? "nobody listens there"
                                                                : "the connection was refused";
      return false;
    }
  }
  failure = "no answer";
  return false;
}

void Participant::State::connect() {
  const auto begin = Clock::now();
  const auto deadline = begin + seconds(connection.silence_limit);
  std::string failure;
  while (true) {
    try {
      if (try_connect(failure)) return;
    } catch (const zmq::error_t& error) {
      failure = error.what();
    } catch (const LinkError& error) {  // the key file is not there yet
      failure = error.what();
    }
    if (Clock::now() + retry_pause >= deadline) break;
    std::this_thread::sleep_for(retry_pause);
  }
  throw LinkError(fmt::format("{}: cannot reach the coupler at {}: {} (tried for {:.1f} s)", who(),
                              connection.endpoint, failure, seconds_since(begin)));
}

/// Next message that is there now, checked; WAIT is swallowed but counts as word from the coupler.
std::optional<Header> Participant::State::take() {
  if (!socket->recv(frames.header, zmq::recv_flags::dontwait)) return {};
  if (!frames.header.more() || !socket->recv(frames.payload, zmq::recv_flags::dontwait) ||
      frames.payload.more())
    throw error("the coupler sent a message that has not two frames");
  Header header = decode(frames.header_view());
  if (run_id == 0 && (header.kind == Kind::welcome || header.kind == Kind::abort))
    run_id = header.run_id;
  if (header.run_id != run_id)
    throw error(fmt::format("{} of run {:016x}, ours is {:016x}", to_word(header.kind),
                            header.run_id, run_id));
  if (header.seq != received + 1)
    throw error(fmt::format("{} with number {}, expected {}", to_word(header.kind), header.seq,
                            received + 1));
  received = header.seq;
  if (header.kind == Kind::abort) {
    ended = true;
    throw error(fmt::format("the coupler ended the run: {}", header.reason));
  }
  if (header.memory.pid == 0) check_payload(header, payload(header));
  else if (header.kind != Kind::welcome && frames.payload.size() != 0)
    throw error("a message with its payload both in memory and in a frame");
  return header;
}

bool Participant::State::coupler_gone() {
  bool gone = false;
  while (const auto event = monitor->next()) gone = gone || event->event == ZMQ_EVENT_DISCONNECTED;
  return gone;
}

Header Participant::State::await(std::initializer_list<Kind> expected, std::string_view what) {
  const auto begin = Clock::now();
  auto deadline = begin + seconds(connection.silence_limit);
  while (true) {
    zmq::pollitem_t items[] = {{socket->handle(), 0, ZMQ_POLLIN, 0},
                               {monitor->handle().handle(), 0, ZMQ_POLLIN, 0}};
    zmq::poll(items, 2, time_left(deadline));
    const bool gone = (items[1].revents & ZMQ_POLLIN) != 0 && coupler_gone();
    while (const auto header = take()) {  // what it said before it went counts
      deadline = Clock::now() + seconds(connection.silence_limit);
      if (header->kind == Kind::wait) continue;
      for (const Kind kind : expected)
        if (header->kind == kind) return *header;
      throw error(fmt::format("{} came from the coupler while awaiting {}", to_word(header->kind), what));
    }
    if (gone) {
      ended = true;
      throw error(fmt::format("the coupler at {} is gone (connection closed after {:.1f} s of waiting "
                              "for {})", connection.endpoint, seconds_since(begin), what));
    }
    if (Clock::now() >= deadline) {
      ended = true;
      throw error(fmt::format("no word from the coupler at {} for {:.1f} s while awaiting {}",
                              connection.endpoint, connection.silence_limit, what));
    }
  }
}

void Participant::State::send(Header header, zmq::message_t payload) {
  header.run_id = run_id;
  header.seq = sent + 1;
  const bool in_memory = header.memory.pid != 0 && header.kind == Kind::result;
  if (!in_memory) header.payload_bytes = payload.size();
  header.payload_checksum =
      checksum({static_cast<const std::byte*>(payload.data()), payload.size()});
  const std::string bytes = encode(header);
  const auto deadline = Clock::now() + seconds(connection.silence_limit);
  while (!socket->send(zmq::buffer(bytes), zmq::send_flags::sndmore | zmq::send_flags::dontwait)) {
    zmq::pollitem_t items[] = {{socket->handle(), 0, ZMQ_POLLOUT, 0},
                               {monitor->handle().handle(), 0, ZMQ_POLLIN, 0}};
    zmq::poll(items, 2, time_left(deadline));
    if ((items[1].revents & ZMQ_POLLIN) != 0 && coupler_gone()) {
      while (take()) continue;  // its last word says more than the closed connection
      ended = true;
      throw error(fmt::format("the coupler at {} is gone (connection closed before {} could be sent)",
                              connection.endpoint, to_word(header.kind)));
    }
    if (Clock::now() >= deadline)
      throw error(fmt::format("the coupler takes no {} for {:.1f} s", to_word(header.kind),
                              connection.silence_limit));
  }
  socket->send(payload, zmq::send_flags::none);
  ++sent;
}

void Participant::State::send(Header header, std::string_view payload) {
  send(std::move(header), zmq::message_t(payload.data(), payload.size()));
}

void Participant::State::send(Header header, std::span<const std::span<const double>> parts) {
  std::size_t bytes = 0;
  for (const auto& part : parts) bytes += part.size_bytes();
  zmq::message_t payload(bytes);
  auto* at = static_cast<std::byte*>(payload.data());
  for (const auto& part : parts) {
    if (!part.empty()) std::memcpy(at, part.data(), part.size_bytes());
    at += part.size_bytes();
  }
  send(std::move(header), std::move(payload));
}

void Participant::State::offer_memory(Header& hello) {
  if (!connection.share_memory || !connection.endpoint.starts_with("ipc://")) return;
  probe.emplace();
  hello.memory = probe->place();
  hello.memory_mark = probe->mark();
}

void Participant::State::accept_memory(const Header& welcome) {
  coupler_reads = welcome.memory.pid != 0;
  we_read = coupler_reads && reader.finds(welcome.memory, welcome.memory_mark);
}

/// Where the values of the next report go: a slot of the shared memory, or the frame to be sent.
std::span<double> Participant::State::report_room() {
  const std::size_t n = report_doubles();
  if (memory) return {reinterpret_cast<double*>(memory.slot(reports).data()), n};
  if (frame.size() != n * sizeof(double)) frame.rebuild(n * sizeof(double));
  return {static_cast<double*>(frame.data()), n};
}

/// Sends a result. Values that the solver wrote into our room are there already.
void Participant::State::send_report(Header header, std::span<const std::span<const double>> parts) {
  std::size_t n = 0;
  for (const auto& part : parts) n += part.size();
  if (n == 0 || n > report_doubles()) {
    send(std::move(header), parts);
    return;
  }
  const auto room = report_room();
  double* at = room.data();
  for (const auto& part : parts) {
    if (part.data() != at) std::memmove(at, part.data(), part.size_bytes());
    at += part.size();
  }
  if (memory) {
    header.memory = memory.place(reports++);
    header.payload_bytes = n * sizeof(double);
    send(std::move(header), zmq::message_t());
  } else if (n == room.size()) {
    send(std::move(header), std::exchange(frame, zmq::message_t()));
  } else {
    send(std::move(header), zmq::message_t(room.data(), n * sizeof(double)));
  }
}

Participant::Participant(const Connection& connection) : state_(std::make_unique<State>(connection)) {
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
  header.mesh_name = mesh.name;
  header.mesh_hash = checksum({reinterpret_cast<const std::byte*>(payload.data()), payload.size()});
  const State::Part own{mesh.name, header.n_vertices, header.mesh_hash};
  if (s.connection.role == Role::solid || s.meshes.size() == 1) {
    s.meshes = {own};
  } else {  // in place of the one of this name
    const auto at = std::find_if(s.meshes.begin(), s.meshes.end(), [&](const State::Part& p) { return p.name == own.name; });
    if (at == s.meshes.end()) throw s.error(fmt::format("a mesh '{}' of its own: no solid is called so", own.name));
    *at = own;
  }
  s.count_parts();
  s.send(std::move(header), payload);
}

void Participant::State::count_parts() {
  n_vertices = 0;
  std::vector<std::uint64_t> hashes;
  for (const Part& part : meshes) {
    n_vertices += part.n_vertices;
    hashes.push_back(part.hash);
  }
  mesh_hash = meshes.size() == 1 ? meshes.front().hash : checksum(std::as_bytes(std::span(hashes)));
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
    throw state_->error(fmt::format("{} solids take part, this flow side knows one", meshes.size()));
  return std::move(meshes.front());
}

void Participant::take_forces() { state_->takes_force = true; }

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
  header.takes_force = s.takes_force;
  if (s.coupler_reads && s.n_vertices > 0)
    s.memory = SharedMemory(((s.connection.role == Role::flow ? 1 : 9) * s.n_vertices + s.balance_doubles()) *
                                sizeof(double), memory_slots);
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
      add_part(header, parts, report.acceleration, field::acceleration, 3 * s.n_vertices, "acceleration");
    add_part(header, parts, report.overpressure, field::overpressure, s.n_vertices, "overpressure");
    header.n_interfaces = s.balance_doubles() > 0 && !balance.empty() ? static_cast<std::uint32_t>(s.meshes.size()) : 1;
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
    room.overpressure = all.first(s.n_vertices);
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
