#pragma once

#include <string>

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

}  // namespace ocublast
