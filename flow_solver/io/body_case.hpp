#pragma once

#include "flow_solver/grid/precision.hpp"
#include "flow_solver/io/flow_case.hpp"

namespace ocublast::flow::inline OCU_PRECISION {

/// Reads [[flow.body]] with its path or free motion, and [flow.immersed], and refuses what does not
/// fit together. Needs the gas, the axes and the names of the solids.
void read_bodies(Section& flow, FlowCase& result);

}  // namespace ocublast::flow
