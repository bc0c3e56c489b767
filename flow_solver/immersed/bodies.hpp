#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "flow_solver/immersed/aabb_tree.hpp"
#include "flow_solver/immersed/immersed_boundary.hpp"
#include "flow_solver/immersed/scan_conversion.hpp"
#include "flow_solver/immersed/snapped_grid.hpp"
#include "flow_solver/immersed/surface.hpp"
#include "flow_solver/immersed/wall_path.hpp"

namespace ocublast::flow {

/// One body with everything that follows from its surface and its motion.
struct BodyState {
  Body body;
  SurfaceTopology topology;
  WallPath path;
  std::vector<double> position;      ///< m [n_vertices, 3]
  std::vector<double> velocity;      ///< m/s
  std::vector<double> acceleration;  ///< m/s^2
  FacetGeometry geometry;            ///< for `position`
  bool at_rest = true;               ///< velocity and acceleration vanish everywhere
  bool moved_since_topology = true;
  bool moved_since_ghosts = false;

  AabbTree tree;                           ///< of the last topology
  std::vector<Point64> snapped;            ///< of the last topology
  std::array<LineCrossings, 3> crossings;  ///< of the last topology, per direction
  std::vector<double> searched;            ///< positions at which feet were last searched
  std::vector<std::uint8_t> stale;         ///< per facet: moved too far since
  std::vector<std::uint8_t> buried;        ///< per facet: all corners in other bodies

  explicit BodyState(Body&& b, double smooth_below_degrees);
  [[nodiscard]] Vec3 vertex(std::int32_t v) const { return row(position, v); }
  [[nodiscard]] std::size_t n_vertices() const { return position.size() / 3; }
  [[nodiscard]] std::size_t n_facets() const { return topology.facet.size(); }
};

/// All bodies and the questions asked about several at once.
class Bodies {
 public:
  /// Throws CaseError with all faults of all surfaces, and of bodies outside the grid.
  Bodies(const Grid& grid, std::vector<Body> bodies, double smooth_below_degrees);

  [[nodiscard]] std::size_t size() const { return state_.size(); }
  [[nodiscard]] BodyState& operator[](std::size_t b) { return state_[b]; }
  [[nodiscard]] const BodyState& operator[](std::size_t b) const { return state_[b]; }
  [[nodiscard]] const SnappedGrid& snapped_grid() const { return snapped_; }

  /// Has a body moved since the last topology?
  [[nodiscard]] bool moved() const;
  void move_to(double t);
  /// Trees, snapped vertices and crossings of the bodies that moved; facets buried in others.
  void update_search(double stale_distance);

  /// Is x in a body other than `except` (-1: in any)? Exact for the snapped surface.
  [[nodiscard]] bool inside_any(const Vec3& x, std::int32_t except) const;
  /// Winding number of body b around x.
  [[nodiscard]] int winding(std::size_t b, const Vec3& x) const;

 private:
  void find_buried();
  SnappedGrid snapped_;
  std::array<bool, 3> present_;
  std::vector<BodyState> state_;
};

}  // namespace ocublast::flow
