#pragma once

#include <spdlog/logger.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>
#include <zmq.hpp>

#include "coupler/link/keys.hpp"
#include "coupler/link/message.hpp"
#include "coupler/link/packet_socket.hpp"
#include "coupler/link/socket.hpp"
#include "coupler/party.hpp"

namespace ocublast::coupler {

/// A participant is at fault: what it did, and with which exit code the run ends.
struct PartnerFault : std::runtime_error {
  PartnerFault(Party who, const std::string& what, int code = 3)
      : std::runtime_error(what), party(who), exit_code(code) {}
  Party party;
  int exit_code;
  bool gone = false;  ///< found out by sending to it: how its process ended says more
};

/// A checked message of a participant.
struct Incoming {
  Party party = Party::flow;
  link::Header header;
  link::Frames frames;
  std::vector<double> aside;          ///< holds the payload where the frame is not aligned
  std::span<const std::byte> memory;  ///< the payload where it came through shared memory

  /// Payload aligned for doubles; valid until the message is moved.
  [[nodiscard]] std::span<const std::byte> payload() {
    return memory.empty() ? link::aligned_payload(frames.payload, aside) : memory;
  }
};

/// Admits only the keys of this run (ZeroMQ RFC 27), in a thread of its own.
class KeyGuard {
 public:
  KeyGuard(zmq::context_t& context, const link::CouplerKeys& keys);

 private:
  zmq::socket_t socket_;
  std::jthread thread_;  ///< last: ends before the socket
};

/// The coupler's socket: who is who, numbering, checks. Strangers and second instances are answered
/// and forgotten; a fault of an admitted participant is thrown as PartnerFault.
class Server {
 public:
  struct Setup {
    std::string endpoint;
    std::uint64_t run_id = 0;
    std::string token;
    std::uint64_t case_hash = 0;
    double silence_limit = 60.0;            ///< s
    double max_message = 256e6;             ///< bytes
    std::optional<link::CouplerKeys> keys;  ///< for tcp
    Roster roster;
    std::vector<std::string> hosts;  ///< by party: the only address it may connect from
    std::optional<Party> only;       ///< nobody else is accepted (the others are replayed)
    bool share_memory = true;        ///< ipc: payloads through shared memory
  };
  Server(const Setup& setup, std::shared_ptr<spdlog::logger> log);

  /// The endpoint with a port chosen by the system filled in.
  [[nodiscard]] std::string endpoint() const;
  /// For a poll: the socket, the watch over its connections, and packets that may come.
  [[nodiscard]] std::vector<zmq::pollitem_t> poll_items();

  /// Next message that is there now; a HELLO has been answered already. The payload is not checked
  /// yet (see link::check_payload).
  [[nodiscard]] std::optional<Incoming> take();
  /// Sends header and payload; numbers, run id and checksum are filled in (the checksum only where
  /// `payload_checksum` is 0, length and checksum not where header.memory names the payload).
  /// Returns the header frame as sent.
  std::string send(Party party, link::Header header, zmq::message_t& payload);
  std::string send(Party party, link::Header header);
  /// Tells a participant that the coupler is alive; dropped when its queue is full.
  void send_wait(Party party, const std::string& reason);
  /// Tells all why the run ends; never throws.
  void abort_all(const std::string& reason, int exit_code) noexcept;

  /// Whether a participant can read the coupler's memory (READY says so).
  [[nodiscard]] bool reads_memory(Party party) const { return peer(party).reads_memory; }
  void set_reads_memory(Party party, bool reads) { peer(party).reads_memory = reads; }

  [[nodiscard]] bool admitted(Party party) const { return peer(party).admitted; }
  /// Whether the connection of an admitted participant was lost.
  [[nodiscard]] bool lost(Party party) const { return peer(party).lost; }
  [[nodiscard]] const std::string& program(Party party) const { return peer(party).program; }
  [[nodiscard]] const Roster& roster() const { return setup_.roster; }

 private:
  struct Peer {
    bool admitted = false;
    bool lost = false;
    bool reads_memory = false;
    std::string routing_id;
    int fd = -1;
    std::uint64_t received = 0;
    std::uint64_t sent = 0;
    std::string program;
    std::uint64_t packet_mark = 0;
    link::PacketSocket packets;
    std::optional<Incoming> held;  ///< came as a packet before a message with a smaller number
  };
  [[nodiscard]] Peer& peer(Party party) { return peers_[index_of(party)]; }
  [[nodiscard]] const Peer& peer(Party party) const { return peers_[index_of(party)]; }
  [[nodiscard]] Party party_of(const link::Header& hello) const;
  void watch_connections();
  [[nodiscard]] std::optional<Incoming> receive();
  [[nodiscard]] std::optional<Incoming> receive_packet(Party party);
  void check_packet(Incoming& in);
  void take_packets(Party party);
  [[nodiscard]] Party greet(const std::string& routing_id, const zmq::message_t& frame,
                            const link::Header& hello);
  void dismiss(const std::string& routing_id, const std::string& reason);
  bool send_frames(const std::string& routing_id, std::string_view header, zmq::message_t& payload,
                   bool wait);

  Setup setup_;
  std::shared_ptr<spdlog::logger> log_;
  zmq::context_t context_{1};
  std::optional<KeyGuard> guard_;
  zmq::socket_t socket_;
  std::optional<link::ConnectionMonitor> monitor_;
  std::vector<Peer> peers_;
  std::optional<link::MemoryProbe> probe_;
  link::MemoryReader memory_;
  std::optional<link::PacketListener> packets_;
  std::string packet_;
  bool something_read_ = false;
};

}  // namespace ocublast::coupler
