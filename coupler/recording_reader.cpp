#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "coupler/base/errors.hpp"
#include "coupler/link/payload.hpp"
#include "coupler/recording_format.hpp"

namespace ocublast::coupler {
namespace {

/// Longest description accepted: a thousand times what is written.
constexpr std::uint32_t max_description_bytes = 16U << 20;

template <class T>
bool read_value(std::ifstream& in, T& value) {
  return static_cast<bool>(in.read(reinterpret_cast<char*>(&value), sizeof value));
}

}  // namespace

TrafficReader::TrafficReader(const std::filesystem::path& file)
    : file_(file), in_(file, std::ios::binary) {
  if (!in_) throw LinkError(fmt::format("{}: cannot be opened", file.string()));
  size_ = std::filesystem::file_size(file);
  std::string magic(traffic::magic.size(), '\0');
  std::uint32_t length = 0;
  in_.read(magic.data(), static_cast<std::streamsize>(magic.size()));
  if (!in_ || magic != traffic::magic || !read_value(in_, length) ||
      length > std::min<std::uint64_t>(max_description_bytes, size_))
    throw LinkError(fmt::format("{}: not a recording (traffic.ocu)", file.string()));
  std::string text(length, '\0');
  if (!in_.read(text.data(), length))
    throw LinkError(fmt::format("{}: ends inside its description", file.string()));
  description_ = traffic::from_text(text, file.string());
  at_ = traffic::magic.size() + sizeof length + length;
  records_end_ = size_;
  read_footer();
}

void TrafficReader::read_footer() {
  traffic::Footer footer;
  if (size_ < at_ + sizeof footer) return;
  in_.seekg(static_cast<std::streamoff>(size_ - sizeof footer));
  if (!read_value(in_, footer) ||
      std::string_view(footer.magic, sizeof footer.magic) != traffic::magic)
    return;
  if (footer.index_offset < at_ || footer.index_offset > size_ ||
      footer.count != (size_ - sizeof footer - footer.index_offset) / sizeof(std::uint64_t))
    return;
  std::vector<std::uint64_t> index(footer.count);
  in_.seekg(static_cast<std::streamoff>(footer.index_offset));
  in_.read(reinterpret_cast<char*>(index.data()),
           static_cast<std::streamsize>(index.size() * sizeof(std::uint64_t)));
  if (!in_ || link::checksum(std::as_bytes(std::span(index))) != footer.index_checksum) return;
  records_end_ = footer.index_offset;
  complete_ = true;
}

std::optional<TrafficRecord> TrafficReader::fail(const std::string& what) {
  damage_ = fmt::format("{}: record {} at byte {}: {}", file_.string(), count_, at_, what);
  at_ = records_end_;
  return {};
}

std::optional<std::string> TrafficReader::read_payload(std::uint64_t number, std::size_t size) {
  const Place place = payloads_[number];
  const auto kept = unpacked_.find(place.channel);
  if (place.packed && kept != unpacked_.end() && kept->second.first == number)
    return kept->second.second;
  std::string payload(place.length, '\0');
  in_.seekg(static_cast<std::streamoff>(place.offset));
  if (!in_.read(payload.data(), static_cast<std::streamsize>(payload.size()))) return {};
  if (place.packed) {
    if (number != count_) return {};  // named by another record when later ones had been read
    auto whole = unpacker_.unpack(place.channel, std::as_bytes(std::span(payload)), size);
    if (whole) unpacked_[place.channel] = {number, *whole};
    return whole;
  }
  if (number == count_ && !payload.empty()) unpacker_.remember(place.channel, payload);
  return payload;
}

std::optional<TrafficRecord> TrafficReader::next() {
  if (at_ >= records_end_) return {};
  in_.clear();
  in_.seekg(static_cast<std::streamoff>(at_));
  traffic::RecordHead head;
  const std::uint64_t left = records_end_ - at_;
  if (left < sizeof head || !read_value(in_, head)) return fail("cut inside its head");
  if (head.mark != traffic::record_mark || head.number != count_ || head.payload_of > count_ ||
      (head.direction & ~traffic::packed_flag) > 3 || head.solid >= link::max_interfaces)
    return fail("not a record");
  if (head.header_length > link::max_header_bytes || head.payload_length > left ||
      sizeof head + head.header_length + head.payload_length > left)
    return fail("cut, or its lengths are wrong");
  TrafficRecord record;
  record.number = head.number;
  record.nanoseconds = head.nanoseconds;
  const std::uint32_t direction = head.direction & ~traffic::packed_flag;
  record.direction = {.party = direction % 2 == 0 ? Party::flow : solid_party(head.solid),
                      .from = direction < 2};
  record.header.resize(head.header_length);
  if (!in_.read(record.header.data(), head.header_length)) return fail("cut inside its header");
  if (traffic::record_checksum(head, record.header) != head.checksum)
    return fail("its checksum is wrong");
  const std::uint64_t own = at_ + sizeof head + head.header_length;
  const bool packed = head.direction != direction;
  payloads_.push_back(head.payload_of == count_ ? Place{own, head.payload_length, packed,
                                                        traffic::channel_of(record.direction)}
                                                : payloads_[head.payload_of]);
  try {
    const link::Header header = link::decode(record.header);
    auto payload = read_payload(head.payload_of, header.payload_bytes);
    if (!payload) return fail(packed ? "its packed payload is damaged" : "cut inside its payload");
    record.payload = std::move(*payload);
    const auto bytes = std::as_bytes(std::span(record.payload));
    if (header.payload_bytes != bytes.size() || header.payload_checksum != link::checksum(bytes))
      return fail("its payload differs from what its header announces");
  } catch (const LinkError& error) {
    return fail(error.what());
  }
  at_ = own + head.payload_length;
  ++count_;
  return record;
}

}  // namespace ocublast::coupler
