#pragma once

#include <cstddef>
#include <vector>

#include "flow_solver/immersed/bodies.hpp"

namespace ocublast::flow {

/// Thickness of a body behind each facet, as far as it matters for the step: up to 0.6 cells, where
/// half of it meets the other bound on the wall's displacement.
class WallThickness {
 public:
  /// Along the inward normal from the middle of each facet to the first facet facing the other way;
  /// renewed only when the body has moved by more than a tenth of a cell `h` (m) since.
  void update(const BodyState& body, double h);
  /// m; HUGE_VAL where the body is thicker than matters.
  [[nodiscard]] double at(std::size_t facet) const {
    return facet < thickness_.size() ? thickness_[facet] : HUGE_VAL;
  }

 private:
  std::vector<double> thickness_;
  std::vector<double> measured_at_;  ///< positions of the last measurement
};

}  // namespace ocublast::flow
