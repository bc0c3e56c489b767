#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace ocublast::link {

/// One end of a local connection that keeps packets apart (SOCK_SEQPACKET). Takes short messages
/// from thread to thread with one wake-up, where a ZeroMQ socket needs three.
class PacketSocket {
 public:
  PacketSocket() = default;
  explicit PacketSocket(int fd) : fd_(fd) {}
  ~PacketSocket() { close(); }
  PacketSocket(PacketSocket&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  PacketSocket& operator=(PacketSocket&& other) noexcept;
  /// To a PacketListener, saying its mark; empty where nobody listens.
  [[nodiscard]] static PacketSocket connect(const std::string& path, std::uint64_t mark) noexcept;

  [[nodiscard]] explicit operator bool() const { return fd_ >= 0; }
  [[nodiscard]] int fd() const { return fd_; }
  /// False, and nothing sent, where the other end is gone or its queue full.
  [[nodiscard]] bool send(std::string_view bytes) noexcept;
  /// The next packet; false where none is there. Closes itself when the other end has. Throws
  /// LinkError for a packet longer than a header may be.
  [[nodiscard]] bool receive(std::string& bytes);
  void close() noexcept;

 private:
  int fd_ = -1;
};

/// Where others connect to; the file lies in a directory of mode 0700.
class PacketListener {
 public:
  PacketListener() = default;
  /// Empty where the system does not let it listen there.
  explicit PacketListener(std::string path) noexcept;
  ~PacketListener();
  PacketListener(const PacketListener&) = delete;
  PacketListener& operator=(const PacketListener&) = delete;

  [[nodiscard]] explicit operator bool() const { return fd_ >= 0; }
  [[nodiscard]] const std::string& path() const { return path_; }
  /// The connection that said this mark; empty where there is none.
  [[nodiscard]] PacketSocket take(std::uint64_t mark);

 private:
  int fd_ = -1;
  std::string path_;
  std::vector<std::pair<std::uint64_t, PacketSocket>> waiting_;
};

}  // namespace ocublast::link
