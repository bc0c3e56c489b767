#pragma once

#include <limits>

namespace ocublast::solid {

/// Moduli at zero strain, Pa; they set wave speeds and steps.
struct ElasticModuli {
  double shear = 0.0;
  double bulk = 0.0;
};

inline constexpr double no_fallback = std::numeric_limits<double>::quiet_NaN();
inline constexpr double no_limit = std::numeric_limits<double>::infinity();

/// One constant of a law as it stands in the case file.
struct LawConstant {
  const char* key;
  const char* unit;
  const char* help;
  double example;  ///< of a soft tissue; tests use it
  double min = 0.0;
  double max = no_limit;
  bool above_min = true;          ///< min itself is not accepted
  double fallback = no_fallback;  ///< where the case gives none; none: required
};

}  // namespace ocublast::solid
