#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <fstream>
#include <map>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>
#include <zmq.hpp>

#include "coupler/link/message.hpp"
#include "coupler/party.hpp"
#include "coupler/payload_packing.hpp"

namespace ocublast::coupler {

/// traffic.ocu: the exact messages of a run.
///   file    magic "OCUTRAF1" | u32 length | description (JSON text) | records | index | footer
///   record  u32 mark | u32 header length | u64 payload length | u64 number | u64 monotonic ns |
///           u64 number of the record that holds the payload (itself, or an earlier one with the
///           same bytes) | u32 direction, + 256: packed | u32 which of several solids | u64 XXH3 of
///           all before and the header bytes | header bytes | payload bytes
///   index   u64 file offset per record
///   footer  u64 number of records | u64 offset of the index | u64 XXH3 of the index | magic
/// All numbers little-endian. The payload is protected by the checksum that the header carries.
/// A packed payload (payload_packing.hpp) has the length that its header announces when unpacked.
/// Index and footer are for speed; a file without them (crash) is read by scanning.
/// Directions: 0 from the flow, 1 from a solid, 2 to the flow, 3 to a solid.
struct Direction {
  Party party = Party::flow;
  bool from = true;  ///< from the participant, else to it
  bool operator==(const Direction&) const = default;
};
/// "flow->", "->solid", "->solid 2".
[[nodiscard]] std::string to_word(Direction direction);

/// What a recording says about itself.
struct TrafficDescription {
  std::string program;  ///< of the coupler, with version
  std::string case_name;
  std::uint64_t case_hash = 0;
  std::uint64_t mesh_hash = 0;
  std::uint64_t first_window = 1;       ///< later than 1 after a resume
  std::vector<std::string> solids{""};  ///< names; one empty name: a single solid
};

struct TrafficRecord {
  std::uint64_t number = 0;       ///< 0, 1, ...
  std::uint64_t nanoseconds = 0;  ///< since the recording began
  Direction direction;
  std::string header;   ///< frame 1
  std::string payload;  ///< frame 2
};

/// Writes a recording. Frames are shared, not copied; a thread of its own writes them, so that the
/// coupling never waits for the disk unless 256 MB are waiting already.
class TrafficWriter {
 public:
  enum class Packing { none, zstd };
  TrafficWriter(const std::filesystem::path& file, const TrafficDescription& description,
                Packing packing = Packing::none);
  ~TrafficWriter();
  TrafficWriter(const TrafficWriter&) = delete;
  TrafficWriter& operator=(const TrafficWriter&) = delete;

  /// Appends a message; returns its number. `same_as`: number of an earlier record with the same
  /// payload. The payload's content is shared with the caller and must not change afterwards.
  std::uint64_t append(Direction direction, std::string_view header, zmq::message_t& payload,
                       std::optional<std::uint64_t> same_as = {});
  /// The same for a payload in shared memory, which must stay until wait_written(number). The
  /// record holds the message as it would have been sent in two frames: with a checksum, without a
  /// place.
  std::uint64_t append(Direction direction, const link::Header& header,
                       std::span<const std::byte> memory,
                       std::optional<std::uint64_t> same_as = {});
  /// Waits until the record of this number has been written; all of them.
  void wait_written(std::uint64_t number);
  void wait_written() {
    if (count_ > 0) wait_written(count_ - 1);
  }
  /// Hands everything to the writing thread. Throws LinkError when an earlier write failed.
  void flush();
  /// Writes index and footer and closes. Throws LinkError when anything could not be written.
  void close();

 private:
  /// A record before it is put into its form, which is the thread's work.
  struct Entry {
    Direction direction;
    std::uint64_t number = 0;
    std::uint64_t nanoseconds = 0;
    std::optional<std::uint64_t> same_as;
    std::string header_bytes;
    std::optional<link::Header> header;  ///< instead of the bytes, for a payload in memory
    zmq::message_t payload;
    std::span<const std::byte> memory;
  };
  using Chunk = std::vector<Entry>;
  std::uint64_t add(Entry entry);
  void write_chunks();
  void write_record(const Entry& entry);
  void put(const void* data, std::size_t size);
  void put_out();
  void write(const void* data, std::size_t size);
  void set_aside(std::size_t size);

  std::filesystem::path file_;
  int fd_ = -1;
  std::uint64_t begin_ns_ = 0;
  std::uint64_t count_ = 0;
  Chunk chunk_;
  std::size_t chunk_bytes_ = 0;

  std::mutex mutex_;
  std::condition_variable wake_;
  std::condition_variable room_;
  std::deque<std::pair<Chunk, std::size_t>> queue_;  ///< guarded by mutex_
  std::size_t queued_bytes_ = 0;                     ///< guarded by mutex_
  bool stop_ = false;                                ///< guarded by mutex_
  std::string failure_;                              ///< guarded by mutex_
  std::uint64_t written_ = 0;                        ///< records on file; guarded by mutex_

  // Of the thread, and of close() after it.
  std::uint64_t offset_ = 0;
  std::uint64_t file_bytes_ = 0;  ///< handed to the system
  std::uint64_t set_aside_ = 0;   ///< bytes of the file whose space is taken already
  std::vector<std::uint64_t> index_;
  std::string buffer_;
  std::vector<std::uint64_t> checksums_;  ///< of the payload of each record
  std::optional<PayloadPacker> packer_;
  std::thread thread_;
};

/// Reads a recording record by record, in order.
class TrafficReader {
 public:
  /// Throws LinkError when the file is not a recording.
  explicit TrafficReader(const std::filesystem::path& file);

  [[nodiscard]] const TrafficDescription& description() const { return description_; }
  /// Next record with its payload; nothing at the end. A damaged or cut record ends the recording:
  /// `damage` then says where and what.
  [[nodiscard]] std::optional<TrafficRecord> next();
  [[nodiscard]] const std::string& damage() const { return damage_; }
  /// Whether the file was closed properly (index and footer are there and agree).
  [[nodiscard]] bool complete() const { return complete_; }

 private:
  void read_footer();
  [[nodiscard]] std::optional<TrafficRecord> fail(const std::string& what);
  [[nodiscard]] std::optional<std::string> read_payload(std::uint64_t number, std::size_t size);

  std::filesystem::path file_;
  std::ifstream in_;
  std::uint64_t size_ = 0;
  std::uint64_t records_end_ = 0;
  std::uint64_t at_ = 0;
  std::uint64_t count_ = 0;
  bool complete_ = false;
  TrafficDescription description_;
  std::string damage_;
  struct Place {
    std::uint64_t offset, length;
    bool packed;
    int channel;
  };
  PayloadUnpacker unpacker_;
  /// Packed ones that a later record may name: the last of each channel.
  std::map<int, std::pair<std::uint64_t, std::string>> unpacked_;
  std::vector<Place> payloads_;  ///< of the records read so far
};

}  // namespace ocublast::coupler
