#pragma once

#include <array>

namespace ocublast::coupler {

/// What both sides say the interface exchanged, summed over windows.
struct Balance {
  double work_flow = 0.0;                ///< J, done on the solid, by the flow's quadrature
  double work_solid = 0.0;               ///< J, the same by the solid's
  double work_exchanged = 0.0;           ///< J, sum of |work| of the larger side per window
  std::array<double, 3> impulse_flow{};  ///< N s, given to the solid
  std::array<double, 3> impulse_solid{};

  /// Energy made or lost by the coupling, J: positive when the solid received more than the flow
  /// gave.
  [[nodiscard]] double energy_error() const { return work_solid - work_flow; }
  /// The same relative to all that was exchanged; 0 where nothing was.
  [[nodiscard]] double relative_energy_error() const {
    return work_exchanged > 0.0 ? energy_error() / work_exchanged : 0.0;
  }
  void add(double flow, double solid, const std::array<double, 3>& by_flow,
           const std::array<double, 3>& by_solid);
  bool operator==(const Balance&) const = default;
};

}  // namespace ocublast::coupler
