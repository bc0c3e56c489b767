#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "coupler/link/participant.hpp"

namespace ocublast::coupler {

/// A value at a point as a sum over vertices of a mesh; the weights sum to 1.
struct PointRow {
  std::vector<std::pair<std::int32_t, double>> weights;
  double gap = 0.0;   ///< m, from the point to the mesh
  double size = 0.0;  ///< m, of the mesh's facets (spacing of its nodes) there
};

/// Finds such sums for the vertices of a mesh.
class PointFinder {
 public:
  virtual ~PointFinder() = default;
  /// For a point x [m] of a surface with this unit normal; no weights where the mesh has nothing
  /// that looks the same way.
  [[nodiscard]] virtual PointRow row(const Eigen::Vector3d& x,
                                     const Eigen::Vector3d& normal) const = 0;
};

/// Nearest projection onto the triangles of a mesh, linear in them: constant fields are reproduced,
/// linear ones where the point lies on the mesh. 2nd order.
[[nodiscard]] std::unique_ptr<PointFinder> make_projection(const link::InterfaceMesh& mesh);

/// Scattered nodes without triangles: interpolation by the radial basis r^3 and linear polynomials
/// in the tangent plane of the 20 nearest nodes (polyharmonic spline, Duchon 1977; local stencils
/// as in Fornberg and Flyer, A Primer on Radial Basis Functions, 2015). At least 2nd order.
[[nodiscard]] std::unique_ptr<PointFinder> make_radial_basis(const link::InterfaceMesh& mesh);

}  // namespace ocublast::coupler
