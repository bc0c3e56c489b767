#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "flow_solver/grid/precision.hpp"
#include "flow_solver/immersed/free_body.hpp"
#include "flow_solver/io/flow_case.hpp"

namespace ocublast::flow::inline OCU_PRECISION {

/// Bodies that the flow solver moves itself: by a law, or by the gas.
class BodyMotions {
 public:
  BodyMotions(const FlowCase& flow_case, const ImmersedBoundary& bodies);

  /// Loads at the start of the run.
  void start(std::span<const BodyLoad> loads);
  /// Walls over the next step. A cubic through end positions and velocities follows a law to 4th
  /// order in the step, far below the flow's own error.
  void set_paths(ImmersedBoundary& bodies, double t_begin, double t_end);
  /// Loads at the end of that step, of `dt` seconds.
  void correct(double dt, std::span<const BodyLoad> loads);
  /// The body's state where it is free; null else.
  [[nodiscard]] const FreeBody* free_body(std::size_t b) const;

  [[nodiscard]] std::vector<double> save() const;
  /// Takes what `save` gave from the front of `saved`.
  void restore(std::span<const double>& saved);

 private:
  struct Motion {
    std::optional<RigidPath> path;
    std::unique_ptr<FreeBody> free;
  };
  std::vector<Motion> motions_;  ///< per body
  std::vector<double> x_, v_;
};

}  // namespace ocublast::flow
