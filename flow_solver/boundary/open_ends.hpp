#pragma once

#include "flow_solver/boundary/boundary.hpp"
#include "flow_solver/gas/gas.hpp"
#include "flow_solver/grid/precision.hpp"

namespace ocublast::flow::inline OCU_PRECISION {

/// Primitive values at a node: rho, u, v, w, T.
struct NodeState {
  double rho, u[3], T;
};

/// The same from a state with pressure.
[[nodiscard]] NodeState node_state(const Gas& gas, const State& s);

// Ghost states beyond an open end after node state `s` and outer gas `far`. `sign` is +1 at the
// high end of `axis`, -1 at the low one.

/// Outgoing Riemann invariant of the node, incoming one of the gas far away; entropy and tangential
/// velocity from where the gas comes.
[[nodiscard]] NodeState characteristic_state(const Gas& gas, const NodeState& s,
                                             const NodeState& far, int axis, double sign);
/// Velocity and temperature of `far`; the pressure follows the wave that leaves: dp + rho c du_n =
/// 0 along it. Supersonic inflow takes all of `far`.
[[nodiscard]] NodeState inflow_state(const Gas& gas, const NodeState& s, const NodeState& far,
                                     int axis, double sign);
/// Gas at rest in `total`, brought to the face at constant entropy and total enthalpy along the
/// normal, with the outgoing invariant of the node; sonic at most. Gas that flows back meets the
/// reservoir as an outflow.
[[nodiscard]] NodeState reservoir_state(const Gas& gas, const NodeState& s, const NodeState& total,
                                        int axis, double sign);

}  // namespace ocublast::flow
