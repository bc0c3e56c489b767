#pragma once

#include "flow_solver/boundary/boundary.hpp"
#include "flow_solver/gas/gas.hpp"
#include "flow_solver/grid/grid.hpp"
#include "flow_solver/numerics/kernel.hpp"

namespace ocublast::flow {

/// Nodes [lo, hi) of a part of the grid.
struct NodeBox {
  int lo[3], hi[3];
};

/// Fills four ghost nodes of the primitives beyond every end at time t, x first, then whole rows,
/// then whole planes, so that edges and corners are filled as well. Only beside the box.
void fill_primitive_ghosts(const Grid& grid, const Boundaries& boundaries, const Gas& gas, double t,
                           const NodeBox& box, const Block& W, int threads);

/// Fills the ghosts of one even scalar field: mirrored at symmetry and walls, repeated if periodic,
/// else the end value.
void fill_scalar_ghosts(const Grid& grid, const Boundaries& boundaries, const NodeBox& box,
                        const Block& block, int field, int threads);

}  // namespace ocublast::flow
