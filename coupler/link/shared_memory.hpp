#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace ocublast::link {

/// Where bytes lie in the memory of a process on this machine. pid 0: nowhere.
struct MemoryPlace {
  std::uint32_t pid = 0;
  std::uint32_t fd = 0;      ///< of that process
  std::uint64_t offset = 0;  ///< bytes
  bool operator==(const MemoryPlace&) const = default;
};

/// Memory that this process writes and others of the same user on this machine map read-only: large
/// payloads pass without a copy. An anonymous file sealed against shrinking, so that a reader never
/// faults; it vanishes with the last process that has it. Divided into slots of equal size.
class SharedMemory {
 public:
  SharedMemory() = default;
  /// Throws LinkError when the system gives no such memory.
  SharedMemory(std::size_t slot_bytes, unsigned slots);
  ~SharedMemory();
  SharedMemory(SharedMemory&& other) noexcept;
  SharedMemory& operator=(SharedMemory&& other) noexcept;

  [[nodiscard]] explicit operator bool() const { return data_ != nullptr; }
  [[nodiscard]] unsigned slots() const { return slots_; }
  /// Slot number `k`, taken modulo the number of slots; aligned to 64 bytes.
  [[nodiscard]] std::span<std::byte> slot(std::uint64_t k) const;
  [[nodiscard]] MemoryPlace place(std::uint64_t k) const;

 private:
  int fd_ = -1;
  std::byte* data_ = nullptr;
  std::size_t slot_bytes_ = 0;
  std::size_t stride_ = 0;
  unsigned slots_ = 0;
};

/// Slots of a participant for payloads of this size: the receiver may still use the results of so
/// many windows less two. The coupler keeps two windows of motion. More slots let a recording lag
/// behind; all are gone through in turn, so that large ones push each other out of the cache.
[[nodiscard]] constexpr unsigned memory_slots(std::size_t slot_bytes) {
  constexpr std::size_t large = std::size_t{1} << 20;
  return slot_bytes < large ? 8 : 4;
}

/// A page that holds a random mark: whoever reads the mark there can share memory with this
/// process.
class MemoryProbe {
 public:
  MemoryProbe();
  [[nodiscard]] MemoryPlace place() const { return memory_.place(0); }
  [[nodiscard]] std::uint64_t mark() const { return mark_; }

 private:
  SharedMemory memory_;
  std::uint64_t mark_ = 0;
};

/// Reads the shared memory of other processes. What it gives stays valid as long as it lives.
class MemoryReader {
 public:
  MemoryReader() = default;
  ~MemoryReader();
  MemoryReader(const MemoryReader&) = delete;
  MemoryReader& operator=(const MemoryReader&) = delete;

  /// The bytes at a place. Throws LinkError when there is no such memory, it is not sealed, too
  /// short, or not aligned for doubles.
  [[nodiscard]] std::span<const std::byte> view(const MemoryPlace& place, std::uint64_t bytes);
  /// Whether the mark of a probe can be read.
  [[nodiscard]] bool finds(const MemoryPlace& probe, std::uint64_t mark) noexcept;

 private:
  struct Mapping {
    std::uint32_t pid, fd;
    std::span<const std::byte> bytes;
  };
  [[nodiscard]] const Mapping& map(const MemoryPlace& place);
  std::vector<Mapping> mappings_;
};

}  // namespace ocublast::link
