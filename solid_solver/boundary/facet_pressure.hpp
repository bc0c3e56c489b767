#pragma once

#include <vector>

#include "solid_solver/boundary/follower_pressure.hpp"
#include "solid_solver/boundary/schedule.hpp"

namespace ocublast::solid {

/// Pressures that follow a surface, one per facet by a schedule of its own: uniform on each facet.
class FacetPressure {
 public:
  /// `pressures` [facets] Pa over ambient; `nodes` are those of the whole surface, ascending.
  FacetPressure(const SolidMesh& mesh, const std::vector<Facet>& facets,
                FollowerPressure::Edges edges, std::vector<Schedule> pressures,
                const std::vector<std::int32_t>& nodes);

  /// Forces [nodes, 3] (N) at displacement [n, 4] (m) and time t (s), overwritten.
  void compute_forces(std::span<const double> displacement, double t,
                      std::span<double> forces) const;
  /// Whether no facet bears a load in [begin, end] (s).
  [[nodiscard]] bool quiet(double begin, double end) const;

 private:
  struct Piece {
    FollowerPressure surface;
    std::vector<std::size_t> places;  ///< of its nodes among those of the whole surface
  };
  std::vector<Piece> pieces_;
  std::vector<Schedule> pressures_;
};

}  // namespace ocublast::solid
