#include "coupler/link/packet_socket.hpp"

#include <fmt/format.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <optional>

#include "coupler/base/errors.hpp"
#include "coupler/link/message.hpp"

namespace ocublast::link {
namespace {

constexpr int socket_kind = SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK;
/// Connections that have not been taken yet; more are strangers'.
constexpr std::size_t most_waiting = 2 * max_interfaces;

std::optional<sockaddr_un> to_address(const std::string& path) noexcept {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.empty() || path.size() >= sizeof address.sun_path) return {};
  std::memcpy(address.sun_path, path.data(), path.size());
  return address;
}

}  // namespace

PacketSocket& PacketSocket::operator=(PacketSocket&& other) noexcept {
  std::swap(fd_, other.fd_);
  return *this;
}

void PacketSocket::close() noexcept {
  if (fd_ >= 0) ::close(std::exchange(fd_, -1));
}

PacketSocket PacketSocket::connect(const std::string& path, std::uint64_t mark) noexcept {
  const auto address = to_address(path);
  if (!address) return {};
  PacketSocket made(::socket(AF_UNIX, socket_kind, 0));
  if (!made ||
      ::connect(made.fd_, reinterpret_cast<const sockaddr*>(&*address), sizeof *address) != 0 ||
      !made.send({reinterpret_cast<const char*>(&mark), sizeof mark}))
    return {};
  return made;
}

bool PacketSocket::send(std::string_view bytes) noexcept {
  while (fd_ >= 0) {
    if (::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(bytes.size()))
      return true;
    if (errno != EINTR) return false;
  }
  return false;
}

bool PacketSocket::receive(std::string& bytes) {
  if (fd_ < 0) return false;
  bytes.resize(max_header_bytes);
  ssize_t n = 0;
  do n = ::recv(fd_, bytes.data(), bytes.size(), MSG_TRUNC);
  while (n < 0 && errno == EINTR);
  if (n > static_cast<ssize_t>(max_header_bytes))
    throw LinkError(
        fmt::format("packet of {} bytes, at most {} are accepted", n, max_header_bytes));
  bytes.resize(n > 0 ? static_cast<std::size_t>(n) : 0);
  if (n == 0 || (n < 0 && errno != EAGAIN)) close();
  return n > 0;
}

PacketListener::PacketListener(std::string path) noexcept : path_(std::move(path)) {
  const auto address = to_address(path_);
  if (!address) return;
  ::unlink(path_.c_str());  // left by a coupler that was killed
  fd_ = ::socket(AF_UNIX, socket_kind, 0);
  const mode_t before = ::umask(077);
  const bool listens =
      fd_ >= 0 && ::bind(fd_, reinterpret_cast<const sockaddr*>(&*address), sizeof *address) == 0 &&
      ::listen(fd_, static_cast<int>(most_waiting)) == 0;
  ::umask(before);
  if (!listens && fd_ >= 0) ::close(std::exchange(fd_, -1));
}

PacketListener::~PacketListener() {
  if (fd_ < 0) return;
  ::close(fd_);
  ::unlink(path_.c_str());
}

PacketSocket PacketListener::take(std::uint64_t mark) {
  for (int fd = 0; waiting_.size() < most_waiting &&
                   (fd = ::accept4(fd_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK)) >= 0;) {
    PacketSocket come(fd);
    std::string said;
    std::uint64_t its = 0;
    if (!come.receive(said) || said.size() != sizeof its)
      continue;  // the mark lies there as soon as it is connected
    std::memcpy(&its, said.data(), sizeof its);
    waiting_.emplace_back(its, std::move(come));
  }
  for (auto& [its, socket] : waiting_)
    if (its == mark && socket) return std::move(socket);
  return {};
}

}  // namespace ocublast::link
