#pragma once

#include "flow_solver/gas/gas.hpp"
#include "flow_solver/grid/fields.hpp"
#include "flow_solver/grid/grid.hpp"
#include "flow_solver/immersed/far_nodes.hpp"
#include "flow_solver/immersed/immersed_boundary.hpp"
#include "flow_solver/immersed/line_cutting.hpp"

namespace ocublast::flow::inline OCU_PRECISION {

/// Integrated along the cut lines, from the last face to the wall with the end node's state; mean
/// over the present directions, each of which sees the whole surface. Error: second order in the
/// spacing along lines, that of the midpoint rule across. With far nodes: this rank's part.
[[nodiscard]] WallCells integrate_wall_cells(const Grid& grid, const CutGrid& cut,
                                             const GasNodes& W, const Gas& gas);

}  // namespace ocublast::flow
