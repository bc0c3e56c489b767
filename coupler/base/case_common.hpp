#pragma once

#include <string>
#include <string_view>

#include "coupler/base/case_reader.hpp"

namespace ocublast {

/// What every program reads from a case: its name, the end of time, the ambient air.
struct CaseCommon {
  std::string name;
  std::string title;
  double end_time = 0.0;             ///< s
  double ambient_pressure = 0.0;     ///< Pa, absolute; loads are pressure minus this
  double ambient_temperature = 0.0;  ///< K
};

/// Declares and reads [case], [time], [ambient]; refuses top-level tables that nobody reads.
[[nodiscard]] CaseCommon read_case_common(CaseReader& reader);

/// A fault of the key where an interval of outputs, s, makes more than a million of them in a run
/// to `end_time`; 0 means none.
void check_interval(Section& section, std::string_view key, double every, double end_time);

}  // namespace ocublast
