#include "coupler/link/socket.hpp"

#include <algorithm>
#include <cstring>

#include "coupler/base/errors.hpp"

namespace ocublast::link {

std::chrono::milliseconds time_left(Clock::time_point deadline) {
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now());
  return std::max(left, std::chrono::milliseconds(0));
}

std::span<const std::byte> aligned_payload(const zmq::message_t& payload,
                                           std::vector<double>& aside) {
  const auto* data = static_cast<const std::byte*>(payload.data());
  if (reinterpret_cast<std::uintptr_t>(data) % alignof(double) == 0) return {data, payload.size()};
  if (payload.size() == 0) return {};
  aside.resize((payload.size() + sizeof(double) - 1) / sizeof(double));
  std::memcpy(aside.data(), data, payload.size());
  return {reinterpret_cast<const std::byte*>(aside.data()), payload.size()};
}

void set_common_options(zmq::socket_t& socket, double silence_limit) {
  // In lock step one or two messages are under way; a longer queue only hides a fault.
  constexpr int queue = 4;
  socket.set(zmq::sockopt::sndhwm, queue);
  socket.set(zmq::sockopt::rcvhwm, queue);
  // A message fits into the kernel's buffer: fewer hand-overs between the two sides.
  constexpr int kernel_buffer = 4 << 20;
  socket.set(zmq::sockopt::sndbuf, kernel_buffer);
  socket.set(zmq::sockopt::rcvbuf, kernel_buffer);
  socket.set(zmq::sockopt::linger, 0);
  const int timeout = static_cast<int>(std::clamp(1000.0 * silence_limit, 50.0, 5000.0));
  socket.set(zmq::sockopt::heartbeat_ivl, std::max(timeout / 5, 10));
  socket.set(zmq::sockopt::heartbeat_timeout, timeout);
  socket.set(zmq::sockopt::heartbeat_ttl, std::max(timeout, 100));
}

ConnectionMonitor::ConnectionMonitor(zmq::context_t& context, zmq::socket_t& watched,
                                     const std::string& name, int events)
    : pair_(context, zmq::socket_type::pair) {
  const std::string address = "inproc://" + name;
  if (zmq_socket_monitor(watched.handle(), address.c_str(), events) != 0)
    throw LinkError("cannot watch the connections of a socket");
  pair_.set(zmq::sockopt::linger, 0);
  pair_.connect(address);
}

std::optional<ConnectionEvent> ConnectionMonitor::next() {
  zmq::message_t what;
  if (!pair_.recv(what, zmq::recv_flags::dontwait)) return {};
  zmq::message_t address;
  static_cast<void>(pair_.recv(address, zmq::recv_flags::dontwait));
  ConnectionEvent event;
  if (what.size() < sizeof event.event + sizeof event.value) return {};
  std::memcpy(&event.event, what.data(), sizeof event.event);
  std::memcpy(&event.value, static_cast<const char*>(what.data()) + sizeof event.event,
              sizeof event.value);
  return event;
}

}  // namespace ocublast::link
