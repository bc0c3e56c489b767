#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "coupler/link/message.hpp"

namespace ocublast::link {

/// XXH3, 64 bits, seed 0 (Y. Collet, xxhash.com), of a payload; 0 for an empty one.
[[nodiscard]] std::uint64_t checksum(std::span<const std::byte> bytes) noexcept;

/// Whether no value is infinite or not a number.
[[nodiscard]] bool all_finite(std::span<const double> values) noexcept;

/// Position of the first value that is infinite or not a number; values.size() if there is none.
[[nodiscard]] std::size_t first_not_finite(std::span<const double> values) noexcept;

/// Views of the parts of a payload whose header was checked. Absent parts are empty.
struct PayloadView {
  std::span<const double> position;
  std::span<const double> velocity;
  std::span<const double> acceleration;
  std::span<const double> overpressure;
  std::span<const double> force;
  std::span<const double> balance;
};
/// Precondition: bytes.size() == payload_bytes_expected(header), data aligned to 8 bytes, no mesh.
[[nodiscard]] PayloadView view_payload(const Header& header, std::span<const std::byte> bytes);

/// Checks a second frame against its header: length, checksum, finiteness. Throws LinkError that
/// names field, vertex and value.
void check_payload(const Header& header, std::span<const std::byte> bytes);

/// Payload of a MESH message and back. `mesh_from_payload` checks indices and finiteness.
[[nodiscard]] std::string mesh_payload(const InterfaceMesh& mesh);
[[nodiscard]] InterfaceMesh mesh_from_payload(const Header& header,
                                              std::span<const std::byte> bytes);

/// Sets malloc's thresholds so that large messages re-use memory instead of fetching fresh pages
/// from the kernel for each window (up to four times slower at 50,000 vertices).
void keep_freed_memory() noexcept;

}  // namespace ocublast::link
