#pragma once

#include <string_view>

#include "flow_solver/grid/precision.hpp"
#include "flow_solver/io/flow_case.hpp"

namespace ocublast::flow::inline OCU_PRECISION {

/// A key that must be above zero.
[[nodiscard]] constexpr RealKey positive_key(std::string_view unit, std::string_view help,
                                             bool required = false) {
  return {.unit = unit, .min = 0.0, .above_min = true, .required = required, .help = help};
}

/// Pressure, temperature and velocity of a table; ambient at rest where left out.
[[nodiscard]] GasState read_gas_state(Section state, const CaseCommon& common);
[[nodiscard]] State to_state(const GasState& gas, const Gas& law);

/// Reads [flow.boundary]: kinds, gases, walls, tables and pistons of the six faces, and refuses
/// what does not fit together. Needs the gas and the axes.
void read_boundaries(Section& flow, FlowCase& result);

}  // namespace ocublast::flow
