#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "solid_solver/mesh/solid_mesh.hpp"

namespace ocublast::solid {

/// Pressure on the current facets of a surface, given at its nodes and linear in each triangle; a
/// positive pressure pushes against the outward normal. Consistent nodal forces: over a triangle
/// with area vector S, f_a = -S (2 p_a + p_b + p_c) / 12. A quad is the mean of its two
/// triangulations, so that a uniform pressure loads its corners alike; both have the quad's area
/// vector.
/// Edges of a plane mesh stand for strips of 1 m, or for rings about the y axis.
class FollowerPressure {
 public:
  enum class Edges { strips, rings };
  FollowerPressure(const SolidMesh& mesh, const std::vector<Facet>& facets,
                   Edges edges = Edges::strips);

  /// Nodes of the surface, ascending; loads and forces are given in this order.
  [[nodiscard]] const std::vector<std::int32_t>& nodes() const { return nodes_; }
  /// Forces [n_nodes(), 3] (N) of the pressure [n_nodes()] (Pa) at displacement [n, 4] (m).
  void compute_forces(std::span<const double> displacement, std::span<const double> pressure,
                      std::span<double> forces) const;
  /// Reference area that belongs to each node, m^2 (sum = area of the surface).
  [[nodiscard]] std::vector<double> nodal_areas() const;
  /// Area vector of the surface, m^2; zero for a closed one.
  [[nodiscard]] std::array<double, 3> area_vector(std::span<const double> displacement) const;

 private:
  struct Triangle {
    std::array<std::int32_t, 3> vertices;  ///< index into nodes_
    double share;                          ///< 1 for a triangle, 1/2 for those of a quad
  };
  [[nodiscard]] std::array<double, 3> triangle_area(const Triangle& t,
                                                    std::span<const double> displacement) const;

  using Edge = std::array<std::int32_t, 2>;  ///< index into nodes_
  /// At a point of an edge: shares of its ends, and the area vector that belongs to it, m^2.
  struct EdgePoint {
    std::array<double, 2> shape;
    std::array<double, 2> area;
  };
  [[nodiscard]] std::array<EdgePoint, 2> edge_points(const Edge& edge,
                                                     std::span<const double> displacement) const;

  const SolidMesh& mesh_;
  Edges kind_;
  std::vector<std::int32_t> nodes_;
  std::vector<Triangle> triangles_;
  std::vector<Edge> edges_;
};

}  // namespace ocublast::solid
