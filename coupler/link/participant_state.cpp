// Messages to and from the coupler: connecting, numbering, checking, waiting with a deadline.
#include "coupler/link/participant_state.hpp"

#include <cstring>
#include <thread>
#include <utility>

#include "coupler/link/keys.hpp"

namespace ocublast::link {
namespace {

constexpr int watched_events =
    ZMQ_EVENT_HANDSHAKE_SUCCEEDED | ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL |
    ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL | ZMQ_EVENT_HANDSHAKE_FAILED_AUTH | ZMQ_EVENT_DISCONNECTED |
    ZMQ_EVENT_CLOSED;
/// Pause between two attempts to reach a coupler that does not listen yet.
constexpr auto retry_pause = std::chrono::milliseconds(100);
/// Longest time one attempt may take, name resolution included.
constexpr auto attempt_limit = std::chrono::seconds(3);

}  // namespace

bool Participant::State::try_connect(std::string& failure) {
  monitor.reset();
  socket = std::make_unique<zmq::socket_t>(context, zmq::socket_type::dealer);
  set_common_options(*socket, connection.silence_limit);
  socket->set(zmq::sockopt::immediate, 1);
  // A participant that comes back to another coupler in the middle of a run is never right.
  socket->set(zmq::sockopt::reconnect_ivl, -1);
  if (!connection.keys.empty()) {
    const ParticipantKeys keys =
        read_keys(connection.keys, connection.name.empty() ? std::string(to_word(connection.role))
                                                           : connection.name);
    socket->set(zmq::sockopt::curve_serverkey, keys.coupler_public);
    socket->set(zmq::sockopt::curve_publickey, keys.own.public_key);
    socket->set(zmq::sockopt::curve_secretkey, keys.own.secret_key);
    connection.token = keys.token;
  }
  monitor = std::make_unique<ConnectionMonitor>(
      context, *socket, fmt::format("monitor-{}", ++attempts), watched_events);
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

void Participant::State::check_run(const Header& header) const {
  if (header.run_id != run_id)
    throw error(fmt::format("{} of run {:016x}, ours is {:016x}", to_word(header.kind),
                            header.run_id, run_id));
}

/// A packet whose turn it is. Those of the other way keep their order among themselves only.
std::optional<Header> Participant::State::take_packet() {
  if (!held && packets.receive(packet)) {
    held = decode(packet);
    check_run(*held);
    if (held->memory.pid == 0 && held->payload_bytes != 0)
      throw error("a packet announces a second frame");
  }
  if (!held || held->seq > received + 1) return {};
  frames.payload.rebuild();
  return std::exchange(held, std::nullopt);
}

std::optional<Header> Participant::State::take_frames() {
  if (!socket->recv(frames.header, zmq::recv_flags::dontwait)) return {};
  if (!frames.header.more() || !socket->recv(frames.payload, zmq::recv_flags::dontwait) ||
      frames.payload.more())
    throw error("the coupler sent a message that has not two frames");
  Header header = decode(frames.header_view());
  if (run_id == 0 && (header.kind == Kind::welcome || header.kind == Kind::abort))
    run_id = header.run_id;
  check_run(header);
  return header;
}

/// Next message that is there now, checked; WAIT is swallowed but counts as word from the coupler.
std::optional<Header> Participant::State::take() {
  auto next = take_packet();
  if (!next) next = take_frames();
  if (!next) return {};
  const Header& header = *next;
  // ABORT may overtake a packet that was sent before it, and ends everything anyway.
  const bool overtakes = header.kind == Kind::abort && packets && header.seq > received;
  if (header.seq != received + 1 && !overtakes)
    throw error(fmt::format("{} with number {}, expected {}", to_word(header.kind), header.seq,
                            received + 1));
  received = header.seq;
  if (header.kind == Kind::abort) {
    ended = true;
    throw error(fmt::format("the coupler ended the run: {}", header.reason));
  }
  if (header.memory.pid == 0)
    check_payload(header, payload(header));
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
                               {monitor->handle().handle(), 0, ZMQ_POLLIN, 0},
                               {nullptr, packets.fd(), ZMQ_POLLIN, 0}};
    // What is held would wake us at once, for nothing.
    zmq::poll(items, packets && !held ? 3 : 2, time_left(deadline));
    const bool gone = (items[1].revents & ZMQ_POLLIN) != 0 && coupler_gone();
    while (const auto header = take()) {  // what it said before it went counts
      deadline = Clock::now() + seconds(connection.silence_limit);
      if (header->kind == Kind::wait) continue;
      for (const Kind kind : expected)
        if (header->kind == kind) return *header;
      throw error(
          fmt::format("{} came from the coupler while awaiting {}", to_word(header->kind), what));
    }
    if (gone) {
      ended = true;
      throw error(
          fmt::format("the coupler at {} is gone (connection closed after {:.1f} s of waiting "
                      "for {})",
                      connection.endpoint, seconds_since(begin), what));
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
  if (header.kind == Kind::result && payload.size() == 0 && packets.send(bytes)) {
    ++sent;
    return;
  }
  const auto deadline = Clock::now() + seconds(connection.silence_limit);
  while (!socket->send(zmq::buffer(bytes), zmq::send_flags::sndmore | zmq::send_flags::dontwait)) {
    zmq::pollitem_t items[] = {{socket->handle(), 0, ZMQ_POLLOUT, 0},
                               {monitor->handle().handle(), 0, ZMQ_POLLIN, 0}};
    zmq::poll(items, 2, time_left(deadline));
    if ((items[1].revents & ZMQ_POLLIN) != 0 && coupler_gone()) {
      while (take()) continue;  // its last word says more than the closed connection
      ended = true;
      throw error(
          fmt::format("the coupler at {} is gone (connection closed before {} could be sent)",
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
  if (we_read) packets = PacketSocket::connect(welcome.packet_path, welcome.packet_mark);
}

/// Where the values of the next report go: a slot of the shared memory, or the frame to be sent.
std::span<double> Participant::State::report_room() {
  const std::size_t n = report_doubles();
  if (memory) return {reinterpret_cast<double*>(memory.slot(reports).data()), n};
  if (frame.size() != n * sizeof(double)) frame.rebuild(n * sizeof(double));
  return {static_cast<double*>(frame.data()), n};
}

/// Sends a result. Values that the solver wrote into our room are there already.
void Participant::State::send_report(Header header,
                                     std::span<const std::span<const double>> parts) {
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

void Participant::State::count_parts() {
  n_vertices = 0;
  std::vector<std::uint64_t> hashes;
  for (const Part& part : meshes) {
    n_vertices += part.n_vertices;
    hashes.push_back(part.hash);
  }
  mesh_hash = meshes.size() == 1 ? meshes.front().hash : checksum(std::as_bytes(std::span(hashes)));
}

}  // namespace ocublast::link
