#pragma once

#include "flow_solver/immersed/immersed_boundary.hpp"
#include "flow_solver/ranks/plane_work.hpp"

namespace ocublast::flow::inline OCU_PRECISION {

/// Work of a step by planes of nodes, with bodies whose topology is known.
[[nodiscard]] PlaneWork work_of_planes(const Grid& grid, const ImmersedBoundary& bodies);

}  // namespace ocublast::flow
