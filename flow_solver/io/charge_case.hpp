#pragma once

#include <array>
#include <string_view>

#include "flow_solver/grid/precision.hpp"
#include "flow_solver/io/flow_case.hpp"

namespace ocublast::flow::inline OCU_PRECISION {

/// Faces of the domain in the order of Boundaries.
inline constexpr std::array<std::string_view, 6> domain_face_names = {"x_min", "x_max", "y_min",
                                                                      "y_max", "z_min", "z_max"};

/// Whether a charge lies outside the grid: its wave comes in through the open faces.
[[nodiscard]] bool is_outside(const FlowCase& flow_case, const ChargeCase& charge);

/// Whether a face is a plane of symmetry through the charge (or r = 0 of a radial grid).
[[nodiscard]] bool through_charge(const FlowCase& flow_case, std::size_t face,
                                  const ChargeCase& charge);

/// Declares and reads flow.charge; faults are left with the reader.
void read_charges(Section& flow, FlowCase& result);

}  // namespace ocublast::flow
