#include "coupler/link/shared_memory.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>
#include <utility>

#include "coupler/base/errors.hpp"
#include "coupler/link/keys.hpp"

namespace ocublast::link {
namespace {

/// Slots begin at cache lines.
constexpr std::size_t alignment = 64;
/// A participant has one memory for probing and one for payloads; more is no honest participant.
constexpr std::size_t most_mappings = 16;

}  // namespace

SharedMemory::SharedMemory(std::size_t slot_bytes, unsigned slots)
    : slot_bytes_(slot_bytes),
      stride_((slot_bytes + alignment - 1) / alignment * alignment),
      slots_(slots) {
  const std::size_t size = stride_ * slots;
  fd_ = ::memfd_create("ocublast-payload", MFD_CLOEXEC | MFD_ALLOW_SEALING);
  if (fd_ < 0 || ::ftruncate(fd_, static_cast<off_t>(size)) != 0 ||
      ::fcntl(fd_, F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL) != 0)
    throw LinkError(fmt::format("no shared memory of {} bytes: {}", size, std::strerror(errno)));
  // Pages are fetched now, not in the first windows.
  void* at = ::mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_POPULATE, fd_, 0);
  if (at == MAP_FAILED)
    throw LinkError(fmt::format("no shared memory of {} bytes: {}", size, std::strerror(errno)));
  data_ = static_cast<std::byte*>(at);
}

SharedMemory::~SharedMemory() {
  if (data_ != nullptr) ::munmap(data_, stride_ * slots_);
  if (fd_ >= 0) ::close(fd_);
}

SharedMemory::SharedMemory(SharedMemory&& other) noexcept {
  *this = std::move(other);
}

SharedMemory& SharedMemory::operator=(SharedMemory&& other) noexcept {
  std::swap(fd_, other.fd_);
  std::swap(data_, other.data_);
  std::swap(slot_bytes_, other.slot_bytes_);
  std::swap(stride_, other.stride_);
  std::swap(slots_, other.slots_);
  return *this;
}

std::span<std::byte> SharedMemory::slot(std::uint64_t k) const {
  return {data_ + (k % slots_) * stride_, slot_bytes_};
}

MemoryPlace SharedMemory::place(std::uint64_t k) const {
  return {.pid = static_cast<std::uint32_t>(::getpid()),
          .fd = static_cast<std::uint32_t>(fd_),
          .offset = (k % slots_) * stride_};
}

MemoryProbe::MemoryProbe() : memory_(sizeof(std::uint64_t), 1), mark_(make_run_id()) {
  std::memcpy(memory_.slot(0).data(), &mark_, sizeof mark_);
}

MemoryReader::~MemoryReader() {
  for (const Mapping& m : mappings_)
    ::munmap(const_cast<std::byte*>(m.bytes.data()), m.bytes.size());
}

const MemoryReader::Mapping& MemoryReader::map(const MemoryPlace& place) {
  for (const Mapping& m : mappings_)
    if (m.pid == place.pid && m.fd == place.fd) return m;
  const std::string path = fmt::format("/proc/{}/fd/{}", place.pid, place.fd);
  if (mappings_.size() >= most_mappings)
    throw LinkError(fmt::format("{}: more shared memories than a participant has", path));
  struct stat status {};
  // Looked at before it is opened: opening a pipe or a device could wait or act.
  if (::stat(path.c_str(), &status) != 0 || !S_ISREG(status.st_mode))
    throw LinkError(fmt::format("{}: no shared memory", path));
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (fd < 0) throw LinkError(fmt::format("{}: shared memory cannot be opened", path));
  const int seals = ::fcntl(fd, F_GET_SEALS);
  const bool usable =
      ::fstat(fd, &status) == 0 && status.st_size > 0 && seals >= 0 && (seals & F_SEAL_SHRINK) != 0;
  const auto size = static_cast<std::size_t>(status.st_size);
  void* at =
      usable ? ::mmap(nullptr, size, PROT_READ, MAP_SHARED | MAP_POPULATE, fd, 0) : MAP_FAILED;
  ::close(fd);
  if (at == MAP_FAILED)
    throw LinkError(fmt::format("{}: shared memory that could shrink, or cannot be mapped", path));
  return mappings_.emplace_back(
      Mapping{place.pid, place.fd, {static_cast<const std::byte*>(at), size}});
}

std::span<const std::byte> MemoryReader::view(const MemoryPlace& place, std::uint64_t bytes) {
  const auto all = map(place).bytes;
  if (place.offset % alignof(double) != 0 || place.offset > all.size() ||
      bytes > all.size() - place.offset)
    throw LinkError(fmt::format("{} bytes at {} of a shared memory of {} bytes", bytes,
                                place.offset, all.size()));
  return all.subspan(place.offset, bytes);
}

bool MemoryReader::finds(const MemoryPlace& probe, std::uint64_t mark) noexcept {
  try {
    std::uint64_t found = 0;
    std::memcpy(&found, view(probe, sizeof found).data(), sizeof found);
    return found == mark;
  } catch (const std::exception&) {
    return false;  // another machine, container or user: payloads travel in the messages
  }
}

}  // namespace ocublast::link
