#pragma once

#include <cmath>

#include "flow_solver/boundary/boundary.hpp"

namespace ocublast::flow {

/// Width of the tanh of a starting interface in cells: wide enough not to shift the shock that
/// grows out of it, and narrower than the shock.
inline constexpr double interface_width = 0.5;

/// State at the distance s [m] beyond a plane interface on a grid of spacing h [m]; `width` in
/// cells.
[[nodiscard]] inline State interface_state(const State& left, const State& right, double s,
                                           double h, double width = interface_width) {
  const double f = 0.5 * (1.0 + std::tanh(s / (width * h)));
  return {.rho = (1.0 - f) * left.rho + f * right.rho,
          .u = (1.0 - f) * left.u + f * right.u,
          .v = (1.0 - f) * left.v + f * right.v,
          .w = (1.0 - f) * left.w + f * right.w,
          .p = (1.0 - f) * left.p + f * right.p};
}

}  // namespace ocublast::flow
