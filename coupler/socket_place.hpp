#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace ocublast::coupler {

/// A file held with flock until it is destroyed; the file stays.
class FileLock {
 public:
  /// Throws LinkError with `refusal` when somebody else holds it.
  FileLock(const std::filesystem::path& file, const std::string& refusal);
  ~FileLock();
  FileLock(FileLock&& other) noexcept;
  FileLock& operator=(FileLock&& other) noexcept;

 private:
  int fd_ = -1;
};

/// Where the coupler listens. For ipc: a socket that only this user can reach, in a private
/// directory made for the run (mode 0700) unless a path was given, held by a lock because a second
/// bind on the same path would silently steal it. Removed by the destructor.
class SocketPlace {
 public:
  /// `wanted`: empty, "ipc://PATH" or "tcp://ADDRESS:PORT". Throws LinkError that says what is
  /// accepted: a path of at most 107 bytes in a directory of our own that others cannot write to,
  /// an address that is named instead of "*".
  explicit SocketPlace(const std::string& wanted);
  ~SocketPlace();
  SocketPlace(const SocketPlace&) = delete;
  SocketPlace& operator=(const SocketPlace&) = delete;

  [[nodiscard]] const std::string& endpoint() const { return endpoint_; }
  [[nodiscard]] bool encrypted() const { return endpoint_.starts_with("tcp://"); }

 private:
  std::string endpoint_;
  std::filesystem::path socket_;     ///< empty for tcp
  std::filesystem::path directory_;  ///< made for this run, else empty
  std::optional<FileLock> lock_;
};

}  // namespace ocublast::coupler
