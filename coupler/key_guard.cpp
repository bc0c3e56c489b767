#include <algorithm>
#include <array>
#include <cstring>

#include "coupler/base/errors.hpp"
#include "coupler/server.hpp"

namespace ocublast::coupler {
namespace {

constexpr std::size_t key_bytes = 32;
/// How often the thread looks whether it should end.
constexpr auto look_up_every = std::chrono::milliseconds(100);

std::string to_bytes(const std::string& z85) {
  std::array<std::uint8_t, key_bytes> bytes{};
  if (zmq_z85_decode(bytes.data(), z85.c_str()) == nullptr)
    throw LinkError("a CURVE key is malformed");
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

std::vector<std::string> receive_request(zmq::socket_t& socket) {
  std::vector<std::string> frames;
  zmq::message_t frame;
  do {
    if (!socket.recv(frame, zmq::recv_flags::dontwait)) break;
    frames.push_back(frame.to_string());
  } while (frame.more());
  return frames;
}

void reply(zmq::socket_t& socket, const std::string& request_id, bool granted) {
  const std::array<std::string, 6> frames{"1.0",
                                          request_id,
                                          granted ? "200" : "400",
                                          granted ? "OK" : "key not on the list of this run",
                                          "",
                                          ""};
  for (std::size_t i = 0; i < frames.size(); ++i)
    socket.send(zmq::buffer(frames[i]),
                i + 1 < frames.size() ? zmq::send_flags::sndmore : zmq::send_flags::none);
}

void serve(const std::stop_token& stop, zmq::socket_t& socket,
           const std::vector<std::string>& allowed) {
  while (!stop.stop_requested()) {
    zmq::pollitem_t item{socket.handle(), 0, ZMQ_POLLIN, 0};
    if (zmq::poll(&item, 1, look_up_every) == 0) continue;
    // version, request id, domain, address, identity, mechanism, credentials
    const auto request = receive_request(socket);
    const bool granted = request.size() == 7 && request[5] == "CURVE" &&
                         std::find(allowed.begin(), allowed.end(), request[6]) != allowed.end();
    reply(socket, request.size() > 1 ? request[1] : "", granted);
  }
}

}  // namespace

KeyGuard::KeyGuard(zmq::context_t& context, const link::CouplerKeys& keys)
    : socket_(context, zmq::socket_type::rep) {
  socket_.set(zmq::sockopt::linger, 0);
  socket_.bind("inproc://zeromq.zap.01");
  std::vector<std::string> allowed;
  for (const auto& key : keys.admitted) allowed.push_back(to_bytes(key));
  thread_ =
      std::jthread([this, allowed](const std::stop_token& stop) { serve(stop, socket_, allowed); });
}

}  // namespace ocublast::coupler
