#pragma once

#include <optional>
#include <span>
#include <string>

#include "coupler/link/message.hpp"

namespace ocublast::coupler {

/// A message as it is compared: what was measured with a clock, and what names a run, left out.
[[nodiscard]] link::Header comparable(link::Header header);

/// First difference between two messages, in words with window, field, vertex and both values;
/// nothing when they agree. `tolerance` is relative to the largest magnitude in the field;
/// 0 compares bytes. Payloads must be aligned for doubles.
[[nodiscard]] std::optional<std::string> first_difference(
    const link::Header& expected, std::span<const std::byte> expected_payload,
    const link::Header& found, std::span<const std::byte> found_payload, double tolerance);

}  // namespace ocublast::coupler
