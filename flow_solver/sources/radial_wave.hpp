#pragma once

#include <deque>
#include <vector>

#include "flow_solver/boundary/boundary.hpp"
#include "flow_solver/gas/gas.hpp"
#include "flow_solver/grid/precision.hpp"

namespace ocublast::flow::inline OCU_PRECISION {

/// Gas at a distance r from the charge; u points away from it.
struct RadialState {
  double rho = 0.0;              ///< kg/m^3
  double u = 0.0;                ///< m/s
  double p = 0.0;                ///< Pa
  double internal_energy = 0.0;  ///< J/m^3; products of a charge need not follow the law of the air
};

/// What a wave carries beyond the gas that was there before.
struct RadialTotals {
  double mass = 0.0;    ///< kg
  double energy = 0.0;  ///< J
};

/// Blast wave that knows its distance to the charge only, at all times of a window that moves
/// forward.
class RadialWave {
 public:
  virtual ~RadialWave() = default;
  /// Makes the times [begin, end] known and forgets earlier ones; `begin` never falls. s after
  /// detonation.
  virtual void cover(double begin, double end) = 0;
  /// Gas at r [m] and a covered time [s].
  [[nodiscard]] virtual RadialState at(double r, double t) const = 0;
  /// Largest distance [m] that the wave has reached at a covered time.
  [[nodiscard]] virtual double front_radius(double t) const = 0;
};

/// A wave computed in steps: states on nodes at each step, linear between nodes and between steps.
/// What it gives at a time does not depend on which windows were asked for.
class SteppedWave : public RadialWave {
 public:
  SteppedWave(const Gas& gas, const State& ambient) : gas_(gas), ambient_(ambient) {}
  void cover(double begin, double end) final;
  [[nodiscard]] RadialState at(double r, double t) const final;
  [[nodiscard]] double front_radius(double t) const final;
  /// Steps on until the front lies at `radius` [m] or beyond; the time then [s].
  double run_to_front(double radius);
  /// Totals of the wave at its latest step.
  [[nodiscard]] virtual RadialTotals totals() const = 0;
  [[nodiscard]] const State& ambient() const { return ambient_; }
  [[nodiscard]] const Gas& gas() const { return gas_; }
  /// Time of the latest step.
  [[nodiscard]] double time() const { return history_.back().t; }

 protected:
  struct Snapshot {
    double t = 0.0;
    double front = 0.0;
    std::vector<double> r;  ///< m, ascending
    std::vector<RadialState> state;
  };
  /// Adds the next step's snapshot.
  virtual void step() = 0;
  void keep(Snapshot snapshot);

 private:
  /// The first step at or after t, else the last.
  [[nodiscard]] std::size_t step_after(double t) const;
  [[nodiscard]] RadialState sample(const Snapshot& s, double r) const;
  Gas gas_;
  State ambient_;
  std::deque<Snapshot> history_;
};

}  // namespace ocublast::flow
