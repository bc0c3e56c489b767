#pragma once

#include <fmt/format.h>

#include <initializer_list>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "coupler/link/message.hpp"
#include "coupler/link/packet_socket.hpp"
#include "coupler/link/participant.hpp"
#include "coupler/link/payload.hpp"
#include "coupler/link/socket.hpp"

namespace ocublast::link {

/// What a participant knows of its connection and of where the run stands; internal to the library.
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
  std::uint64_t n_vertices = 0;  ///< of all parts
  std::uint64_t mesh_hash = 0;
  std::uint64_t finished_window = 0;
  std::uint32_t iteration = 0;  ///< of that window
  Header order;                 ///< the last STEP or CHECKPOINT
  bool takes_force = false;     ///< solid; flow: sends forces
  bool owes_result = false;
  bool owes_done = false;
  bool ended = false;  ///< BYE or ABORT was sent or received, or the coupler is gone
  Frames frames;       ///< of the last message; an Order's spans point into it
  std::vector<double> aside;

  std::optional<MemoryProbe> probe;
  MemoryReader reader;
  bool coupler_reads = false;  ///< our memory
  bool we_read = false;        ///< the coupler's
  SharedMemory memory;         ///< for reports
  std::uint64_t reports = 0;   ///< sent with values; the slot of the next one
  zmq::message_t frame;        ///< for the next report where memory is not shared

  PacketSocket packets;  ///< STEP and RESULT come and go here where no second frame is needed
  std::string packet;
  std::optional<Header> held;  ///< came as a packet before a message with a smaller number

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
  [[nodiscard]] std::optional<Header> take_frames();
  [[nodiscard]] std::optional<Header> take_packet();
  void check_run(const Header& header) const;
  void offer_memory(Header& hello);
  void accept_memory(const Header& welcome);
  [[nodiscard]] std::size_t report_doubles() const {
    const std::size_t motion = order.wants_acceleration ? 9 : 6;
    return (connection.role == Role::flow ? load_components() : motion) * n_vertices +
           balance_doubles();
  }
  [[nodiscard]] std::size_t balance_doubles() const {
    return meshes.size() > 1 ? 4 * meshes.size() : 0;
  }
  [[nodiscard]] std::size_t load_components() const { return takes_force ? 3 : 1; }
  void count_parts();
  [[nodiscard]] std::span<double> report_room();
  [[nodiscard]] std::span<const std::byte> payload(const Header& header) {
    return header.memory.pid != 0 ? reader.view(header.memory, header.payload_bytes)
                                  : aligned_payload(frames.payload, aside);
  }
};

}  // namespace ocublast::link
