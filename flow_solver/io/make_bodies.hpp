#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "coupler/link/participant.hpp"
#include "flow_solver/grid/grid.hpp"
#include "flow_solver/grid/precision.hpp"
#include "flow_solver/immersed/bodies.hpp"
#include "flow_solver/io/flow_case.hpp"

namespace ocublast::flow::inline OCU_PRECISION {

/// Which of the solids, in the order of FlowCase::solids, moves a coupled body.
[[nodiscard]] std::size_t solid_number(const FlowCase& flow_case, const BodyCase& body);

/// Bodies with their surfaces; `coupled` are the solids' in the order of FlowCase::solids, or none
/// where they are not known yet. Throws CaseError for a file that is no
/// surface and for a body outside the grid.
[[nodiscard]] std::vector<Body> make_bodies(const FlowCase& flow_case,
                                            std::span<const link::InterfaceMesh> coupled);

/// Throws CaseError for a charge whose centre lies in a body; tags are those of the first topology.
void require_charges_in_gas(const FlowCase& flow_case, const Grid& grid,
                            std::span<const std::uint8_t> tags);

}  // namespace ocublast::flow
