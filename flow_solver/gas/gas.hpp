#pragma once

#include <cmath>

namespace ocublast::flow {

/// Calorically perfect gas.
struct Gas {
  double heat_capacity_ratio = 1.4;  ///< 1, gamma = cp/cv
  double gas_constant = 287.05;      ///< J/(kg K)
};

/// Pressure [Pa] from density rho [kg/m^3] and temperature T [K].
[[nodiscard]] constexpr double pressure(const Gas& gas, double rho, double T) noexcept {
  return rho * gas.gas_constant * T;
}
/// Density [kg/m^3] from pressure p [Pa] and temperature T [K].
[[nodiscard]] constexpr double density(const Gas& gas, double p, double T) noexcept {
  return p / (gas.gas_constant * T);
}
/// Sound speed [m/s] at temperature T [K].
[[nodiscard]] inline double sound_speed(const Gas& gas, double T) noexcept {
  return std::sqrt(gas.heat_capacity_ratio * gas.gas_constant * T);
}

}  // namespace ocublast::flow
