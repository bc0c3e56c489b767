#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "coupler/recording.hpp"

namespace ocublast::coupler::traffic {

inline constexpr std::string_view magic = "OCUTRAF1";
inline constexpr std::uint32_t record_mark = 0x4f435552;  // "RUCO" as bytes

/// In RecordHead::direction: the payload is packed (payload_packing.hpp).
inline constexpr std::uint32_t packed_flag = 0x100;

/// The fixed part of a record, as it lies in the file. No padding: 4+4+8+8+8+8+4+4+8 = 56.
struct RecordHead {
  std::uint32_t mark = record_mark;
  std::uint32_t header_length = 0;
  std::uint64_t payload_length = 0;  ///< bytes in this record: 0 when an earlier one holds them
  std::uint64_t number = 0;
  std::uint64_t nanoseconds = 0;
  std::uint64_t payload_of = 0;
  std::uint32_t direction = 0;
  std::uint32_t solid = 0;  ///< which of several
  std::uint64_t checksum = 0;
};
static_assert(sizeof(RecordHead) == 56);

struct Footer {
  std::uint64_t count = 0;
  std::uint64_t index_offset = 0;
  std::uint64_t index_checksum = 0;
  char magic[8] = {'O', 'C', 'U', 'T', 'R', 'A', 'F', '1'};
};
static_assert(sizeof(Footer) == 32);

/// Payloads are packed against the one before of the same channel.
[[nodiscard]] inline int channel_of(Direction d) {
  return 2 * static_cast<int>(index_of(d.party)) + (d.from ? 0 : 1);
}

/// XXH3 of the head without its checksum, then of the header bytes mixed in.
[[nodiscard]] std::uint64_t record_checksum(const RecordHead& head, std::string_view header);

[[nodiscard]] std::string to_text(const TrafficDescription& description);
/// Throws LinkError when the text is not a description.
[[nodiscard]] TrafficDescription from_text(const std::string& text, const std::string& file);

}  // namespace ocublast::coupler::traffic
