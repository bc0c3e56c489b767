#include "coupler/recording_format.hpp"

#include <fmt/format.h>

#include <cstddef>
#include <cstring>
#include <nlohmann/json.hpp>

#include "coupler/base/errors.hpp"
#include "coupler/link/payload.hpp"

namespace ocublast::coupler {

std::string to_word(Direction direction) {
  std::string who = direction.party == Party::flow ? "flow" : "solid";
  if (index_of(direction.party) > 1) who += fmt::format(" {}", index_of(direction.party));
  return direction.from ? who + "->" : "->" + who;
}

namespace traffic {

std::uint64_t record_checksum(const RecordHead& head, std::string_view header) {
  std::string bytes(offsetof(RecordHead, checksum), '\0');
  std::memcpy(bytes.data(), &head, bytes.size());
  bytes += header;
  return link::checksum({reinterpret_cast<const std::byte*>(bytes.data()), bytes.size()});
}

std::string to_text(const TrafficDescription& d) {
  return nlohmann::json{{"program", d.program},
                        {"case", d.case_name},
                        {"case_hash", fmt::format("{:016x}", d.case_hash)},
                        {"mesh_hash", fmt::format("{:016x}", d.mesh_hash)},
                        {"first_window", d.first_window},
                        {"solids", d.solids},
                        {"protocol", {link::protocol_major, link::protocol_minor}},
                        {"contract", link::contract_text()}}
      .dump();
}

TrafficDescription from_text(const std::string& text, const std::string& file) {
  try {
    const auto json = nlohmann::json::parse(text);
    TrafficDescription d;
    d.program = json.at("program");
    d.case_name = json.at("case");
    d.case_hash = std::stoull(json.at("case_hash").get<std::string>(), nullptr, 16);
    d.mesh_hash = std::stoull(json.at("mesh_hash").get<std::string>(), nullptr, 16);
    d.first_window = json.at("first_window");
    if (json.contains("solids")) d.solids = json.at("solids").get<std::vector<std::string>>();
    return d;
  } catch (const std::exception& error) {
    throw LinkError(fmt::format("{}: its description cannot be read: {}", file, error.what()));
  }
}

}  // namespace traffic
}  // namespace ocublast::coupler
