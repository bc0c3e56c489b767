#pragma once

#include <chrono>
#include <optional>
#include <span>
#include <string>
#include <vector>
#include <zmq.hpp>

#include "coupler/link/message.hpp"

namespace ocublast::link {

using Clock = std::chrono::steady_clock;

[[nodiscard]] inline Clock::duration seconds(double s) {
  return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(s));
}
[[nodiscard]] inline double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}
/// Time left until `deadline` for zmq::poll, at least 0, rounded up so that a poll never spins.
[[nodiscard]] std::chrono::milliseconds time_left(Clock::time_point deadline);

/// The two frames of a message.
struct Frames {
  zmq::message_t header;
  zmq::message_t payload;

  [[nodiscard]] std::string_view header_view() const {
    return {static_cast<const char*>(header.data()), header.size()};
  }
};

/// Payload bytes aligned for doubles: those of the frame, or a copy in `aside` where ZeroMQ handed
/// out an odd address (it slices small messages out of its read buffer).
[[nodiscard]] std::span<const std::byte> aligned_payload(const zmq::message_t& payload,
                                                         std::vector<double>& aside);

/// Options both ends share: bounded queues, no linger, heartbeats well inside `silence_limit` [s].
void set_common_options(zmq::socket_t& socket, double silence_limit);

/// One event of a socket's connections.
struct ConnectionEvent {
  std::uint16_t event = 0;  ///< ZMQ_EVENT_...
  std::int32_t value = 0;   ///< file descriptor or error, see zmq_socket_monitor
};

/// Reports connections of a socket coming and going. Must not outlive the context.
class ConnectionMonitor {
 public:
  ConnectionMonitor(zmq::context_t& context, zmq::socket_t& watched, const std::string& name,
                    int events);
  [[nodiscard]] zmq::socket_ref handle() { return pair_; }
  /// Next event; nothing when there is none now.
  [[nodiscard]] std::optional<ConnectionEvent> next();

 private:
  zmq::socket_t pair_;
};

}  // namespace ocublast::link
