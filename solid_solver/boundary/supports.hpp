#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "solid_solver/boundary/schedule.hpp"

namespace ocublast::solid {

/// Nodes held in some directions.
struct FixedNodes {
  std::vector<std::int32_t> nodes;
  std::array<bool, 3> directions{true, true, true};
};

/// Nodes whose displacement along one axis is given in time.
struct PrescribedNodes {
  enum class Quantity { displacement, velocity, acceleration };
  std::vector<std::int32_t> nodes;
  std::size_t direction = 0;  ///< 0 x, 1 y, 2 z
  Quantity quantity = Quantity::displacement;
  Schedule schedule;  ///< m, m/s or m/s^2

  [[nodiscard]] double displacement(double t) const {
    return quantity == Quantity::displacement ? schedule.value(t)
           : quantity == Quantity::velocity   ? schedule.integral(t)
                                              : schedule.double_integral(t);
  }
  [[nodiscard]] double velocity(double t) const {
    return quantity == Quantity::displacement ? schedule.slope(t)
           : quantity == Quantity::velocity   ? schedule.value(t)
                                              : schedule.integral(t);
  }
};

/// Springs and dashpots from nodes to ground, alike in all directions.
struct SpringSet {
  std::vector<std::int32_t> nodes;
  std::vector<double> stiffness;  ///< [nodes] N/m
  std::vector<double> damping;    ///< [nodes] N s/m
};

}  // namespace ocublast::solid
