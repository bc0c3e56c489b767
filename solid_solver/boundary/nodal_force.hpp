#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace ocublast::solid {

/// The motion over one step, nodal arrays [n, 4].
struct StepMotion {
  std::span<const double> displacement;  ///< m, at the end
  std::span<const double> velocity;      ///< m/s, of the half step
  double t_old = 0.0;                    ///< s
  double t_new = 0.0;                    ///< s
  double dt = 0.0;                       ///< s; 0 when forces are asked for at a standstill
  /// [n] 0 where another rank counts what is done at the node; empty: all count here.
  std::span<const std::uint8_t> counted;
  [[nodiscard]] bool counts(std::size_t node) const {
    return counted.empty() || counted[node] != 0;
  }
};

/// What forces did in a step at the nodes that count. Works are by the trapezoidal rule, which
/// balances the kinetic energy of the scheme.
struct ForceWork {
  double stored = 0.0;      ///< J, potential now
  double dissipated = 0.0;  ///< J, in the step
  double external = 0.0;    ///< J, done on the body in the step
};

/// Forces on nodes beside those of elements and pressures; chosen by the case. Among ranks every
/// copy of a node gets the same force.
class NodalForce {
 public:
  virtual ~NodalForce() = default;
  /// Subtracts its forces (N) at the motion's end from the residual [n, 4].
  virtual ForceWork apply(const StepMotion& motion, std::span<double> residual) = 0;
  /// Adds an upper bound of its stiffness, applied to x, to y: for the stable step.
  virtual void add_stiffness(std::span<const double> /*x*/, std::span<double> /*y*/) const {}
  /// Bound of the damping ratio it gives a mode of omega rad/s; nodal mass in kg.
  [[nodiscard]] virtual double damping_ratio(double /*omega*/,
                                             std::span<const double> /*mass*/) const {
    return 0.0;
  }
  /// Whether it leaves a body at rest alone in [begin, end] s.
  [[nodiscard]] virtual bool quiet(double /*begin*/, double /*end*/) const { return true; }
  /// What must be kept for a resumed run.
  [[nodiscard]] virtual std::span<double> state() { return {}; }
};

}  // namespace ocublast::solid
