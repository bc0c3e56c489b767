#pragma once

#include <memory>

#include "flow_solver/sources/radial_wave.hpp"
#include "flow_solver/step.hpp"

namespace ocublast::flow::inline OCU_PRECISION {

/// Ball of hot gas at rest that starts a spherical wave.
struct BallStart {
  double energy = 0.0;  ///< J above ambient
  double radius = 0.0;  ///< m
  double mass = 0.0;    ///< kg above ambient
};

/// Grid of a spherical run: fine in and beside the ball, cells growing in proportion to r.
struct RadialResolution {
  double cells_per_ball = 80.0;  ///< cells in the ball's radius
  double growth = 0.001;         ///< cell size by distance beyond twice the ball's radius
  bool wall_at_end = false;      ///< a rigid shell at r_max instead of open air
};

/// Spherical wave of a ball of hot gas: a one-dimensional run of the MUSCL scheme up to `r_max`
/// [m].
class BallWave final : public SteppedWave {
 public:
  BallWave(const Gas& gas, const State& ambient, const BallStart& ball, double r_max,
           const RadialResolution& resolution = {});
  ~BallWave() override;
  [[nodiscard]] RadialTotals totals() const override;
  /// The run itself, for read-out.
  [[nodiscard]] const Flow& flow() const { return *flow_; }
  using SteppedWave::time;

 protected:
  void step() override;

 private:
  void record(double t);
  std::unique_ptr<Flow> flow_;
  Totals quiet_;  ///< of the grid at rest
};

}  // namespace ocublast::flow
