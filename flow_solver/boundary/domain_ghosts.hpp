#pragma once

#include "flow_solver/boundary/boundary.hpp"
#include "flow_solver/gas/gas.hpp"
#include "flow_solver/grid/grid.hpp"
#include "flow_solver/numerics/kernel.hpp"

namespace ocublast::flow {

/// Primitive values at a node: rho, u, v, w, T.
struct NodeState {
  double rho, u[3], T;
};

/// Ghost state beyond an open end after node state `s`: outgoing Riemann invariant of the node,
/// incoming one of the gas far away; entropy and tangential velocity from where the gas comes.
/// `sign` is +1 at the high end of `axis`, -1 at the low one.
[[nodiscard]] NodeState characteristic_state(const Gas& gas, const NodeState& s, const NodeState& far,
                                             int axis, double sign);

/// Nodes [lo, hi) of a part of the grid.
struct NodeBox {
  int lo[3], hi[3];
};

/// Fills four ghost nodes of the primitives beyond every end, x first, then whole rows, then whole
/// planes, so that edges and corners are filled as well. Only beside the box.
void fill_primitive_ghosts(const Grid& grid, const Boundaries& boundaries, const Gas& gas,
                           const NodeBox& box, const Block& W, int threads);

/// Fills the ghosts of one even scalar field: mirrored at symmetry and walls, repeated if periodic,
/// else the end value.
void fill_scalar_ghosts(const Grid& grid, const Boundaries& boundaries, const NodeBox& box,
                        const Block& block, int field, int threads);

}  // namespace ocublast::flow
