#include "coupler/server.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/stat.h>

#include <algorithm>
#include <chrono>
#include <cstring>

#include "coupler/base/errors.hpp"
#include "coupler/link/payload.hpp"

namespace ocublast::coupler {

using link::Header;
using link::Kind;
using link::to_word;

namespace {

/// Time for the last words to leave the process.
constexpr int farewell_linger_ms = 1000;
constexpr std::chrono::milliseconds farewell_wait(200);
/// Longest time a send waits for room in a queue that never holds more than a message or two.
constexpr int send_limit_ms = 5000;

}  // namespace

Server::Server(const Setup& setup, std::shared_ptr<spdlog::logger> log)
    : setup_(setup),
      log_(std::move(log)),
      socket_(context_, zmq::socket_type::router),
      peers_(setup.roster.size()) {
  if (setup.keys) {
    guard_.emplace(context_, *setup.keys);
    socket_.set(zmq::sockopt::curve_server, 1);
    socket_.set(zmq::sockopt::curve_secretkey, setup.keys->own.secret_key);
    socket_.set(zmq::sockopt::zap_domain, std::string("ocublast"));
  }
  if (setup.share_memory && setup.endpoint.starts_with("ipc://")) probe_.emplace();
  link::set_common_options(socket_, setup.silence_limit);
  socket_.set(zmq::sockopt::router_mandatory, 1);
  socket_.set(zmq::sockopt::sndtimeo, send_limit_ms);
  socket_.set(zmq::sockopt::maxmsgsize, static_cast<std::int64_t>(setup.max_message));
  monitor_.emplace(context_, socket_, "coupler-connections", ZMQ_EVENT_DISCONNECTED);
  const mode_t before = ::umask(077);
  try {
    socket_.bind(setup.endpoint);
  } catch (const zmq::error_t& error) {
    ::umask(before);
    throw LinkError(fmt::format("cannot listen on {}: {}", setup.endpoint, error.what()));
  }
  ::umask(before);
  if (probe_) packets_.emplace(setup.endpoint.substr(std::string("ipc://").size()) + ".packets");
}

std::string Server::endpoint() const {
  return socket_.get(zmq::sockopt::last_endpoint);
}

std::vector<zmq::pollitem_t> Server::poll_items() {
  std::vector<zmq::pollitem_t> items{{socket_.handle(), 0, ZMQ_POLLIN, 0},
                                     {monitor_->handle().handle(), 0, ZMQ_POLLIN, 0}};
  for (const Peer& p : peers_)
    if (p.packets && !p.held) items.push_back({nullptr, p.packets.fd(), ZMQ_POLLIN, 0});
  return items;
}

/// READY announced them: from now on orders without a second frame go as packets, and results may
/// come so.
void Server::take_packets(Party party) {
  Peer& p = peer(party);
  if (packets_ && p.packet_mark != 0) p.packets = packets_->take(p.packet_mark);
  if (!p.packets)
    throw PartnerFault(party, "READY announces packets, but it has not connected for them");
}

/// The packet of a party whose turn it is. It may come before messages of the other way that were
/// sent before it: then it waits for them.
std::optional<Incoming> Server::receive_packet(Party party) {
  Peer& p = peer(party);
  try {
    if (!p.held && p.packets.receive(packet_)) {
      Incoming in;
      in.party = party;
      in.frames.header = zmq::message_t(packet_.data(), packet_.size());
      in.header = link::decode(packet_);
      check_packet(in);
      p.held = std::move(in);
    }
    if (!p.held || p.held->header.seq > p.received + 1) return {};
    if (p.held->header.seq < p.received + 1)
      throw LinkError(fmt::format("message refused: {} has number {}, expected {}",
                                  to_word(p.held->header.kind), p.held->header.seq,
                                  p.received + 1));
  } catch (const LinkError& error) {
    throw PartnerFault(party, error.what());
  }
  ++p.received;
  return std::exchange(p.held, std::nullopt);
}

void Server::check_packet(Incoming& in) {
  const Header& h = in.header;
  if (h.run_id != setup_.run_id)
    throw LinkError(fmt::format("message refused: of run {:016x}, this one is {:016x}", h.run_id,
                                setup_.run_id));
  if (h.kind != Kind::result || (h.memory.pid == 0) != (h.payload_bytes == 0))
    throw LinkError(fmt::format("message refused: {} as a packet", to_word(h.kind)));
  if (h.memory.pid != 0) in.memory = memory_.view(h.memory, h.payload_bytes);
}

void Server::watch_connections() {
  // An event names a file descriptor. It must be looked at before any later message, because a
  // descriptor is given to the next connection as soon as it is free.
  while (const auto event = monitor_->next())
    for (Peer& p : peers_)
      if (p.admitted && p.fd == event->value) {
        p.lost = true;
        p.fd = -1;
      }
}

std::optional<Incoming> Server::take() {
  watch_connections();
  for (const Party party : setup_.roster.all())
    if (auto message = receive_packet(party)) return message;
  do {
    something_read_ = false;
    if (auto message = receive()) return message;
  } while (something_read_);
  return {};
}

/// Reads one message. Nothing is returned for none and for strangers.
std::optional<Incoming> Server::receive() {
  zmq::message_t identity;
  if (!socket_.recv(identity, zmq::recv_flags::dontwait)) return {};
  something_read_ = true;
  const std::string routing_id = identity.to_string();
  Incoming in;
  bool two_frames = identity.more() && socket_.recv(in.frames.header).has_value() &&
                    in.frames.header.more() && socket_.recv(in.frames.payload).has_value();
  zmq::message_t rest;
  bool more = identity.more() && (two_frames ? in.frames.payload.more() : in.frames.header.more());
  while (more) {  // a message is atomic: its other frames are here already
    two_frames = false;
    static_cast<void>(socket_.recv(rest));
    more = rest.more();
  }
  Peer* known = nullptr;
  for (const Party party : setup_.roster.all())
    if (peer(party).admitted && peer(party).routing_id == routing_id) {
      known = &peer(party);
      in.party = party;
    }
  try {
    if (!two_frames) throw LinkError("message refused: it has not two frames");
    in.header = link::decode(in.frames.header_view());
    if (known == nullptr) {
      in.party = greet(routing_id, in.frames.header, in.header);
      return in;
    }
    if (in.header.run_id != setup_.run_id)
      throw LinkError(fmt::format("message refused: of run {:016x}, this one is {:016x}",
                                  in.header.run_id, setup_.run_id));
    // ABORT may overtake a packet that was sent before it, and ends everything anyway.
    const bool overtakes =
        in.header.kind == Kind::abort && known->packets && in.header.seq > known->received;
    if (in.header.seq != known->received + 1 && !overtakes)
      throw LinkError(fmt::format("message refused: {} has number {}, expected {}",
                                  to_word(in.header.kind), in.header.seq, known->received + 1));
    if (in.header.memory.pid != 0) {
      if (!probe_ || in.header.payload_bytes == 0 || in.frames.payload.size() != 0)
        throw LinkError("message refused: a payload in memory that was not agreed on");
      in.memory = memory_.view(in.header.memory, in.header.payload_bytes);
    }
  } catch (const LinkError& error) {
    if (known != nullptr) throw PartnerFault(in.party, error.what());
    dismiss(routing_id, error.what());
    return {};
  }
  ++known->received;
  if (in.header.kind == Kind::ready && in.header.takes_packets) take_packets(in.party);
  return in;
}

Party Server::party_of(const Header& hello) const {
  if (hello.role == link::Role::flow) return Party::flow;
  const auto& names = setup_.roster.solids();
  const auto at = std::find(names.begin(), names.end(), hello.name);
  if (at == names.end())
    throw LinkError(fmt::format(
        "refused: no solid of this case is called '{}'; expected {}", hello.name,
        setup_.roster.several() ? fmt::format("{}", fmt::join(names, ", ")) : "no name"));
  return solid_party(static_cast<std::size_t>(at - names.begin()));
}

Party Server::greet(const std::string& routing_id, const zmq::message_t& frame,
                    const Header& hello) {
  if (hello.kind != Kind::hello)
    throw LinkError(fmt::format("message refused: {} before HELLO", to_word(hello.kind)));
  if (hello.token != setup_.token)
    throw LinkError(
        "refused: the token is not that of this run; start solvers through the coupler, "
        "or give them its OCUBLAST_TOKEN");
  const Party party = party_of(hello);
  const std::string word = setup_.roster.word(party);
  if (setup_.only && *setup_.only != party)
    throw LinkError(fmt::format("refused: the {} side is replayed in this run", word));
  const std::string host =
      index_of(party) < setup_.hosts.size() ? setup_.hosts[index_of(party)] : std::string();
  const char* from = zmq_msg_gets(frame.handle(), "Peer-Address");
  if (!host.empty() && (from == nullptr || host != from))
    throw LinkError(fmt::format("refused: the {} side connects from {}, the case has it at {}",
                                word, from == nullptr ? "nowhere known" : from, host));
  // The end of an older connection, which had the number of this one, must not be taken for this
  // one's.
  watch_connections();
  Peer& p = peer(party);
  if (p.admitted)
    throw LinkError(fmt::format("refused: a {} participant is here already ({})", word, p.program));
  std::string mismatch;
  if (hello.major != link::protocol_major)
    mismatch =
        fmt::format("protocol {}.{} of {} does not fit protocol {}.{} of the coupler", hello.major,
                    hello.minor, hello.program, link::protocol_major, link::protocol_minor);
  else if (hello.case_hash != setup_.case_hash)
    mismatch = fmt::format(
        "case hash {:016x} of {} differs from {:016x} of the coupler: all sides "
        "must read the same case with the same --set",
        hello.case_hash, hello.program, setup_.case_hash);
  else if (hello.seq != 1)
    mismatch = fmt::format("HELLO has number {}, expected 1", hello.seq);
  if (!mismatch.empty()) {
    dismiss(routing_id, mismatch);
    throw PartnerFault(party, mismatch);
  }
  p = {};
  p.admitted = true;
  p.routing_id = routing_id;
  p.fd = zmq_msg_get(frame.handle(), ZMQ_SRCFD);
  p.received = 1;
  p.program = hello.program;
  Header welcome;
  welcome.kind = Kind::welcome;
  welcome.silence_limit = setup_.silence_limit;
  if (probe_ && hello.memory.pid != 0 && memory_.finds(hello.memory, hello.memory_mark)) {
    welcome.memory = probe_->place();
    welcome.memory_mark = probe_->mark();
    if (packets_ && *packets_) {
      welcome.packet_path = packets_->path();
      welcome.packet_mark = p.packet_mark = link::make_run_id();
    }
  }
  send(party, std::move(welcome));
  log_->info("{} is {}", word, hello.program);
  return party;
}

void Server::dismiss(const std::string& routing_id, const std::string& reason) {
  log_->warn("a stranger was refused: {}", reason);
  Header answer;
  answer.kind = Kind::abort;
  answer.run_id = 0;
  answer.seq = 1;
  answer.reason = reason;
  answer.exit_code = static_cast<std::uint32_t>(ExitCode::link);
  zmq::message_t nothing;
  send_frames(routing_id, link::encode(answer), nothing, false);
}

/// False when the peer is gone or, without `wait`, its queue is full.
bool Server::send_frames(const std::string& routing_id, std::string_view header,
                         zmq::message_t& payload, bool wait) {
  const auto flags = wait ? zmq::send_flags::none : zmq::send_flags::dontwait;
  try {
    if (!socket_.send(zmq::buffer(routing_id), zmq::send_flags::sndmore | flags)) return false;
    socket_.send(zmq::buffer(header), zmq::send_flags::sndmore);
    socket_.send(payload, zmq::send_flags::none);
    return true;
  } catch (const zmq::error_t&) {  // EHOSTUNREACH: the peer is gone
    return false;
  }
}

std::string Server::send(Party party, Header header, zmq::message_t& payload) {
  Peer& p = peer(party);
  header.run_id = setup_.run_id;
  header.seq = p.sent + 1;
  const bool in_memory = header.memory.pid != 0 && header.kind == Kind::step;
  if (!in_memory) header.payload_bytes = payload.size();
  if (header.payload_checksum == 0)
    header.payload_checksum =
        link::checksum({static_cast<const std::byte*>(payload.data()), payload.size()});
  std::string bytes = link::encode(header);
  if (header.kind == Kind::step && payload.size() == 0 && p.packets.send(bytes)) {
    ++p.sent;
    return bytes;
  }
  if (!p.admitted || !send_frames(p.routing_id, bytes, payload, true)) {
    PartnerFault fault(party,
                       fmt::format("takes no {}: its connection is gone", to_word(header.kind)));
    fault.gone = true;
    throw fault;
  }
  ++p.sent;
  return bytes;
}

std::string Server::send(Party party, Header header) {
  zmq::message_t nothing;
  return send(party, std::move(header), nothing);
}

void Server::send_wait(Party party, const std::string& reason) {
  Peer& p = peer(party);
  if (!p.admitted || p.lost) return;
  Header header;
  header.kind = Kind::wait;
  header.run_id = setup_.run_id;
  header.seq = p.sent + 1;
  header.reason = reason;
  zmq::message_t nothing;
  if (send_frames(p.routing_id, link::encode(header), nothing, false)) ++p.sent;
}

void Server::abort_all(const std::string& reason, int exit_code) noexcept {
  try {
    for (const Party party : setup_.roster.all()) {
      Peer& p = peer(party);
      if (!p.admitted || p.lost) continue;
      Header header;
      header.kind = Kind::abort;
      header.run_id = setup_.run_id;
      header.seq = ++p.sent;
      header.reason = reason;
      header.exit_code = static_cast<std::uint32_t>(exit_code);
      zmq::message_t nothing;
      send_frames(p.routing_id, link::encode(header), nothing, false);
    }
    socket_.set(zmq::sockopt::linger, farewell_linger_ms);
    // Closing at once, the end of the connection may overtake the word on it at the other side. Who
    // has read it goes; who is frozen is not waited for.
    const auto until = std::chrono::steady_clock::now() + farewell_wait;
    const auto waits = [](const Peer& p) { return p.admitted && !p.lost; };
    while (std::any_of(peers_.begin(), peers_.end(), waits) &&
           std::chrono::steady_clock::now() < until) {
      zmq::pollitem_t item{monitor_->handle().handle(), 0, ZMQ_POLLIN, 0};
      zmq::poll(&item, 1, std::chrono::milliseconds(5));
      watch_connections();
    }
  } catch (const std::exception& error) {
    log_->warn("could not tell the participants that the run ends: {}", error.what());
  }
}

}  // namespace ocublast::coupler
