#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "flow_solver/grid/precision.hpp"
#include "flow_solver/immersed/immersed_boundary.hpp"
#include "flow_solver/io/flow_case.hpp"
#include "flow_solver/sources/charge.hpp"

namespace ocublast::flow::inline OCU_PRECISION {

/// What the charges of a case bring at the start of its run.
struct ChargeStart {
  double after_detonation = 0.0;            ///< s, of the run's time 0
  std::vector<std::string> names;           ///< of the mapped charges
  std::vector<WaveOnGrid> mapped;           ///< charges inside the grid
  std::shared_ptr<IncidentWaves> incident;  ///< those outside; null: none
};

/// Runs the waves of all charges side by side until the first front comes near: to a body or a face
/// that it must not cross before it is on the grid, or, from outside, to the grid. Throws CaseError
/// for a charge in a body, or with too little room for its source.
[[nodiscard]] ChargeStart start_charges(const FlowCase& flow_case, const Grid& grid,
                                        std::span<const Body> bodies);

/// Distance [m] from a point to a closed surface, negative inside (of outward triangles).
[[nodiscard]] double signed_distance(const BodySurface& surface, const std::array<double, 3>& x);

}  // namespace ocublast::flow
