#pragma once

#include "flow_solver/grid/precision.hpp"
#include "flow_solver/io/flow_case.hpp"

namespace ocublast::flow::inline OCU_PRECISION {

/// The body that stands for a piston: a closed slab over the whole cross-section that reaches from
/// the piston's place at t = 0 over the domain's face and far beyond it, on the grid of the case.
[[nodiscard]] BodySurface make_piston_slab(const PistonCase& piston, const Grid& grid);

}  // namespace ocublast::flow
