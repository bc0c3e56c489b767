#pragma once

#include <array>
#include <span>
#include <vector>

#include "flow_solver/immersed/immersed_boundary.hpp"
#include "flow_solver/step.hpp"

namespace ocublast::flow::inline OCU_PRECISION {

/// What the walls did over a run: impulse on each body, and the mass that leaked through them. The
/// mass of the gas is its mean density, cells at walls cut to the walls, times its volume, which
/// changes by what moving walls take; what neither that nor the flow through open faces of the
/// domain explains has leaked.
class WallBalance {
 public:
  /// `ranks` share the flow and outlive this; `start` and `add` are collective.
  WallBalance(const Ranks& ranks, const Flow& flow, const ImmersedBoundary& bodies);

  /// Sums over the gas and loads at the start, and at the end of a step of dt seconds.
  void start(const Totals& totals, std::span<const BodyLoad> loads);
  void add(double dt, const Totals& totals, std::span<const BodyLoad> loads);

  [[nodiscard]] double gas_mass() const { return mass_; }  ///< kg
  [[nodiscard]] double leaked_mass() const;                ///< kg, into the gas
  [[nodiscard]] const std::array<double, 3>& impulse(std::size_t b) const {
    return impulse_[b];
  }                                                                    ///< N s
  [[nodiscard]] double largest_leak() const { return largest_leak_; }  ///< kg

  [[nodiscard]] std::vector<double> save() const;
  /// Takes what `save` gave from the front of `saved`.
  void restore(std::span<const double>& saved);

 private:
  void measure(const Totals& totals);
  [[nodiscard]] double inflow() const;
  [[nodiscard]] double inflow_through(std::size_t a, int side, std::size_t b,
                                      std::array<int, 3> at) const;
  [[nodiscard]] double volume_rate(std::span<const BodyLoad> loads) const;

  const Ranks& ranks_;
  const Flow& flow_;
  const ImmersedBoundary& bodies_;
  std::vector<double> depth_;  ///< m, extent of each body in absent directions (product)
  std::vector<std::array<double, 3>> impulse_, force_;
  double volume_ = 0.0, volume_rate_ = 0.0;
  double mass_ = 0.0, first_mass_ = 0.0;
  double inflow_ = 0.0, brought_ = 0.0;
  double largest_leak_ = 0.0;
};

}  // namespace ocublast::flow
