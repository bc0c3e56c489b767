#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <utility>

#include "coupler/base/errors.hpp"
#include "coupler/link/payload.hpp"
#include "coupler/recording_format.hpp"

namespace ocublast::coupler {
namespace {

/// Records are handed to the writing thread in portions of this size: one wake-up per portion.
constexpr std::size_t portion_bytes = 1U << 20;
/// More than this waiting for the disk stops the coupling until there is room.
constexpr std::size_t most_queued_bytes = 256U << 20;
/// Disk space is set aside this far ahead: as much as is written already, within these bounds. Into
/// space set aside a write takes 10 to 30 % less time (5 MB on ext4: 1.2 to 1.5 instead of 1.4
/// to 1.8 ms).
constexpr std::uint64_t least_ahead_bytes = 4U << 20;
constexpr std::uint64_t most_ahead_bytes = 64U << 20;
/// Payloads up to this size are copied into the portion, larger ones shared.
constexpr std::size_t copied_payload_bytes = 16U << 10;

std::uint64_t monotonic_ns() {
  return static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::nanoseconds>(
                                        std::chrono::steady_clock::now().time_since_epoch())
                                        .count());
}

template <class T>
void add_bytes(std::string& out, const T& value) {
  out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

}  // namespace

TrafficWriter::TrafficWriter(const std::filesystem::path& file,
                             const TrafficDescription& description, Packing packing)
    : file_(file), begin_ns_(monotonic_ns()) {
  if (packing == Packing::zstd) packer_.emplace();
  fd_ = ::open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (fd_ < 0)
    throw LinkError(fmt::format("{}: cannot be created: {}", file.string(), std::strerror(errno)));
  const std::string text = traffic::to_text(description);
  buffer_ = traffic::magic;
  add_bytes(buffer_, static_cast<std::uint32_t>(text.size()));
  buffer_ += text;
  offset_ = buffer_.size();
  thread_ = std::thread([this] { write_chunks(); });
}

TrafficWriter::~TrafficWriter() {
  try {
    close();
  } catch (const std::exception&) {
    // Callers that must know call close() themselves.
  }
}

std::uint64_t TrafficWriter::append(Direction direction, std::string_view header,
                                    zmq::message_t& payload, std::optional<std::uint64_t> same_as) {
  Entry entry{.direction = direction, .same_as = same_as, .header_bytes = std::string(header)};
  if (!same_as) entry.payload.copy(payload);
  return add(std::move(entry));
}

std::uint64_t TrafficWriter::append(Direction direction, const link::Header& header,
                                    std::span<const std::byte> memory,
                                    std::optional<std::uint64_t> same_as) {
  Entry entry{.direction = direction, .same_as = same_as};
  entry.header = header;
  entry.memory = memory;
  return add(std::move(entry));
}

std::uint64_t TrafficWriter::add(Entry entry) {
  entry.number = count_++;
  entry.nanoseconds = monotonic_ns() - begin_ns_;
  chunk_bytes_ += sizeof(traffic::RecordHead) + entry.header_bytes.size() + entry.payload.size() +
                  entry.memory.size();
  chunk_.push_back(std::move(entry));
  if (chunk_bytes_ >= portion_bytes) flush();
  return count_ - 1;
}

void TrafficWriter::flush() {
  std::unique_lock lock(mutex_);
  room_.wait(lock, [this] { return queued_bytes_ <= most_queued_bytes || !failure_.empty(); });
  if (!failure_.empty()) throw LinkError(failure_);
  if (chunk_.empty()) return;
  queued_bytes_ += chunk_bytes_;
  queue_.emplace_back(std::move(chunk_), chunk_bytes_);
  chunk_.clear();
  chunk_bytes_ = 0;
  wake_.notify_one();
}

void TrafficWriter::wait_written(std::uint64_t number) {
  {
    const std::lock_guard lock(mutex_);
    if (written_ > number) return;
  }
  flush();
  std::unique_lock lock(mutex_);
  room_.wait(lock, [&] { return written_ > number || !failure_.empty(); });
  if (!failure_.empty()) throw LinkError(failure_);
}

/// Small pieces gather in the buffer, large ones go straight to the file.
void TrafficWriter::put(const void* data, std::size_t size) {
  offset_ += size;
  if (size <= copied_payload_bytes) {
    buffer_.append(static_cast<const char*>(data), size);
    return;
  }
  put_out();
  write(data, size);
}

void TrafficWriter::put_out() {
  write(buffer_.data(), buffer_.size());
  buffer_.clear();
}

void TrafficWriter::write_record(const Entry& entry) {
  const auto* data =
      entry.header ? static_cast<const void*>(entry.memory.data()) : entry.payload.data();
  const std::size_t size = entry.header ? entry.memory.size() : entry.payload.size();
  std::string header = entry.header_bytes;
  std::uint64_t payload_checksum = 0;
  if (entry.header) {
    link::Header plain = *entry.header;
    plain.memory = {};
    payload_checksum = entry.same_as ? checksums_[*entry.same_as] : link::checksum(entry.memory);
    plain.payload_checksum = payload_checksum;
    header = link::encode(plain);
  }
  checksums_.push_back(payload_checksum);
  traffic::RecordHead head;
  head.header_length = static_cast<std::uint32_t>(header.size());
  head.payload_length = entry.same_as ? 0 : size;
  head.number = entry.number;
  head.nanoseconds = entry.nanoseconds;
  head.payload_of = entry.same_as.value_or(entry.number);
  const auto party = static_cast<std::uint32_t>(index_of(entry.direction.party));
  head.direction = (party == 0 ? 0U : 1U) + (entry.direction.from ? 0U : 2U);
  head.solid = party == 0 ? 0U : party - 1;
  std::optional<std::string> packed;
  if (packer_ && head.payload_length > 0)
    packed = packer_->pack(traffic::channel_of(entry.direction),
                           {static_cast<const std::byte*>(data), size});
  if (packed) {
    head.direction |= traffic::packed_flag;
    head.payload_length = packed->size();
    data = packed->data();
  }
  head.checksum = traffic::record_checksum(head, header);
  index_.push_back(offset_);
  put(&head, sizeof head);
  put(header.data(), header.size());
  if (head.payload_length > 0) put(data, head.payload_length);
}

/// The file's length stays what is written, so that a run that dies leaves a recording like any
/// other. Where the file system cannot, or has no room left, writes find their space by themselves.
void TrafficWriter::set_aside(std::size_t size) {
  file_bytes_ += size;
  if (file_bytes_ <= set_aside_ || size <= copied_payload_bytes) return;
  const std::uint64_t ahead =
      file_bytes_ + std::clamp(file_bytes_, least_ahead_bytes, most_ahead_bytes);
  static_cast<void>(::fallocate(fd_, FALLOC_FL_KEEP_SIZE, static_cast<off_t>(set_aside_),
                                static_cast<off_t>(ahead - set_aside_)));
  set_aside_ = ahead;
}

void TrafficWriter::write(const void* data, std::size_t size) {
  const char* at = static_cast<const char*>(data);
  set_aside(size);
  while (size > 0) {
    const ssize_t written = ::write(fd_, at, size);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) {
      const std::lock_guard lock(mutex_);
      if (failure_.empty())
        failure_ = fmt::format(
            "{}: the recording cannot be written: {}; free some space or set "
            "coupling.record = false",
            file_.string(), std::strerror(errno));
      return;
    }
    at += written;
    size -= static_cast<std::size_t>(written);
  }
}

void TrafficWriter::write_chunks() {
  std::unique_lock lock(mutex_);
  while (true) {
    wake_.wait(lock, [this] { return stop_ || !queue_.empty(); });
    if (queue_.empty()) return;
    auto [chunk, bytes] = std::move(queue_.front());
    queue_.pop_front();
    lock.unlock();
    for (const Entry& entry : chunk) write_record(entry);
    put_out();
    const std::uint64_t done = index_.size();
    chunk.clear();
    lock.lock();
    queued_bytes_ -= bytes;
    written_ = done;
    room_.notify_one();
  }
}

void TrafficWriter::close() {
  if (fd_ < 0) return;
  try {
    flush();
  } catch (const LinkError&) {
    // Reported below, after the thread has ended.
  }
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  wake_.notify_one();
  thread_.join();
  traffic::Footer footer;
  footer.count = index_.size();
  footer.index_offset = offset_;
  const auto index = std::as_bytes(std::span(index_));
  footer.index_checksum = link::checksum(index);
  if (failure_.empty()) put_out();
  if (failure_.empty()) write(index.data(), index.size());
  if (failure_.empty()) write(&footer, sizeof footer);
  // What was set aside and not needed goes back.
  if (set_aside_ > file_bytes_)
    static_cast<void>(!::ftruncate(fd_, static_cast<off_t>(file_bytes_)));
  if (::close(std::exchange(fd_, -1)) != 0 && failure_.empty())
    failure_ = fmt::format("{}: could not be closed: {}", file_.string(), std::strerror(errno));
  if (!failure_.empty()) throw LinkError(failure_);
}

}  // namespace ocublast::coupler
