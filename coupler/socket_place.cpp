#include "coupler/socket_place.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstdlib>
#include <utility>

#include "coupler/base/errors.hpp"

namespace ocublast::coupler {

FileLock::FileLock(const std::filesystem::path& file, const std::string& refusal) {
  fd_ = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  if (fd_ < 0) throw LinkError(fmt::format("{}: cannot be created", file.string()));
  if (::flock(fd_, LOCK_EX | LOCK_NB) != 0) {
    ::close(std::exchange(fd_, -1));
    throw LinkError(refusal);
  }
}
FileLock::~FileLock() {
  if (fd_ >= 0) ::close(fd_);
}
FileLock::FileLock(FileLock&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
FileLock& FileLock::operator=(FileLock&& other) noexcept {
  std::swap(fd_, other.fd_);
  return *this;
}

namespace {

std::filesystem::path make_private_directory() {
  const char* runtime = std::getenv("XDG_RUNTIME_DIR");
  std::error_code ignored;
  const bool usable = runtime != nullptr && std::filesystem::is_directory(runtime, ignored) &&
                      ::access(runtime, W_OK) == 0;
  std::string name =
      (std::filesystem::path(usable ? runtime : "/tmp") / "ocublast-XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr)  // mode 0700 by definition
    throw LinkError(fmt::format("{}: cannot make a private directory for the socket", name));
  return name;
}

/// Refuses a directory in which somebody else could replace the socket.
void require_own_directory(const std::filesystem::path& directory) {
  struct stat status {};
  if (::stat(directory.c_str(), &status) != 0 || !S_ISDIR(status.st_mode))
    throw LinkError(fmt::format("{}: no such directory for the socket; make it with mode 700",
                                directory.string()));
  if (status.st_uid != ::geteuid() || (status.st_mode & 022) != 0)
    throw LinkError(
        fmt::format("{}: mode {:o}, owner {}: others could replace the socket; accepted "
                    "is a directory of your own with mode 700",
                    directory.string(), status.st_mode & 0777, status.st_uid));
}

void require_named_address(const std::string& endpoint) {
  const std::string address = endpoint.substr(6);
  const auto colon = address.rfind(':');
  if (colon == std::string::npos || colon == 0 || colon + 1 == address.size() || address[0] == '*')
    throw LinkError(
        fmt::format("endpoint {}: accepted is tcp://ADDRESS:PORT with the address to "
                    "listen on, for one machine 127.0.0.1",
                    endpoint));
}

}  // namespace

SocketPlace::SocketPlace(const std::string& wanted) : endpoint_(wanted) {
  if (wanted.starts_with("tcp://")) {
    require_named_address(wanted);
    return;
  }
  if (!wanted.empty() && !wanted.starts_with("ipc:///"))
    throw LinkError(
        fmt::format("endpoint '{}': accepted are ipc:///PATH and tcp://ADDRESS:PORT", wanted));
  if (wanted.empty()) {
    directory_ = make_private_directory();
    socket_ = directory_ / "coupler.sock";
  } else {
    socket_ = wanted.substr(6);
    require_own_directory(socket_.parent_path());
  }
  endpoint_ = "ipc://" + socket_.string();
  constexpr std::size_t longest_path = sizeof(sockaddr_un::sun_path) - 1;
  if (socket_.string().size() > longest_path)
    throw LinkError(
        fmt::format("{}: a socket's path has at most {} bytes, this one {}; choose a "
                    "shorter one",
                    socket_.string(), longest_path, socket_.string().size()));
  lock_.emplace(socket_.string() + ".lock",
                fmt::format("{}: another coupler listens there", socket_.string()));
  std::error_code ignored;
  std::filesystem::remove(socket_, ignored);  // left by a coupler that was killed
}

SocketPlace::~SocketPlace() {
  std::error_code ignored;
  if (!socket_.empty()) {
    std::filesystem::remove(socket_, ignored);
    if (!directory_.empty()) std::filesystem::remove(socket_.string() + ".lock", ignored);
  }
  lock_.reset();
  if (!directory_.empty()) std::filesystem::remove(directory_, ignored);
}

}  // namespace ocublast::coupler
