#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "coupler/link/participant.hpp"

namespace ocublast::coupler {

/// A point of a surface: a triangle and the weights of its corners (they sum to 1).
struct SurfacePoint {
  std::int32_t triangle = -1;  ///< -1: none
  std::array<double, 3> weight{};
  double distance = 0.0;  ///< m, from the point asked for
};

/// Finds the nearest point of a triangulated surface on facets that look the same way, so that the
/// two sides of a thin plate are never taken for each other.
class SurfaceSearch {
 public:
  explicit SurfaceSearch(const link::InterfaceMesh& mesh);
  ~SurfaceSearch();
  SurfaceSearch(SurfaceSearch&&) noexcept;
  SurfaceSearch& operator=(SurfaceSearch&&) noexcept;

  /// Nearest point to x [m] among facets whose normal n has n . normal > 0.2 (as for the walls of
  /// the flow); triangle -1 where there is none. O(log of the number of triangles).
  [[nodiscard]] SurfacePoint nearest(const Eigen::Vector3d& x, const Eigen::Vector3d& normal) const;
  /// Length of a facet's edges if it were equilateral, m.
  [[nodiscard]] double facet_size(std::int32_t triangle) const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

/// Area times outward normal of each triangle, m^2.
[[nodiscard]] std::vector<Eigen::Vector3d> area_vectors(std::span<const double> vertices,
                                                        std::span<const std::int32_t> triangles);
/// Unit normals at the vertices: sums of the area vectors around them. Zero where they cancel.
[[nodiscard]] std::vector<Eigen::Vector3d> vertex_normals(const link::InterfaceMesh& mesh);

[[nodiscard]] inline Eigen::Vector3d point_of(std::span<const double> values, std::size_t vertex) {
  return {values[3 * vertex], values[3 * vertex + 1], values[3 * vertex + 2]};
}

}  // namespace ocublast::coupler
