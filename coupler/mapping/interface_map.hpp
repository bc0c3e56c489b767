#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "coupler/link/participant.hpp"

namespace ocublast::coupler {

class PointFinder;

/// How values pass between two interface meshes that differ.
enum class MappingKind { automatic, nearest_projection, radial_basis };

struct MappingOptions {
  MappingKind kind =
      MappingKind::automatic;  ///< automatic: projection, radial basis where there are no triangles
  double largest_gap = 0.5;    ///< between the meshes, in facet sizes; beyond: refused
};

/// Carries motion from the solid's interface mesh to the flow's and load back, where they differ.
///
/// Motion is consistent: x_f = X_f + H (x_s - X_s), u_f = H u_s, where the rows of H interpolate in
/// the solid's mesh. A term of rank 4 adds, over the gap between the meshes, the linear field that
/// fits u_s best, so that H reproduces constant and linear fields (rigid motions) to round-off
/// whatever the gap; it vanishes with the gap.
///
/// Force is conservative: the flow's overpressure, linear on its facets, is integrated over them as
/// they stand, and each piece is handed to the nodes of the solid by the same interpolation at its
/// points of quadrature (dense enough that no facet of the solid is left out). That keeps the total
/// force to round-off; a force field (a + b x r) over the nodes, weighted by their share, mends the
/// rest of the total moment that the gap leaves. Where the solid takes no forces it is given the
/// overpressure at its vertices instead, interpolated on the flow's mesh: 2nd order, not
/// conservative.
class InterfaceMap {
 public:
  /// Throws LinkError that names the place where the meshes do not belong together.
  InterfaceMap(link::InterfaceMesh flow, link::InterfaceMesh solid, const MappingOptions& options);

  [[nodiscard]] std::size_t n_flow() const { return flow_.n_vertices(); }
  [[nodiscard]] std::size_t n_solid() const { return solid_.n_vertices(); }
  [[nodiscard]] const link::InterfaceMesh& flow_mesh() const { return flow_; }
  [[nodiscard]] double largest_gap() const { return gap_; }  ///< m
  [[nodiscard]] const std::string& method() const { return method_; }

  /// Positions [n, 3] m of the solid's vertices to those of the flow's.
  void map_position(std::span<const double> solid, std::span<double> flow) const;
  /// Velocities [n, 3] (or any vectors) of the solid to those of the flow.
  void map_vectors(std::span<const double> solid, std::span<double> flow) const;
  /// Nodal forces [n_solid, 3] N of overpressure [n_flow] Pa on the flow's mesh at x_flow [n_flow,
  /// 3], on the solid's nodes at x_solid [n_solid, 3], both m.
  void map_force(std::span<const double> overpressure, std::span<const double> x_flow,
                 std::span<const double> x_solid, std::span<double> force) const;
  /// Overpressure [n_flow] Pa to the solid's vertices [n_solid].
  void map_pressure(std::span<const double> overpressure, std::span<double> solid) const;

 private:
  /// Sparse rows: row r holds entries begin[r] .. begin[r + 1].
  struct Rows {
    std::vector<std::size_t> begin{0};
    std::vector<std::int32_t> column;
    std::vector<double> weight;
  };
  /// Share of a solid node in the integrals of the three corners' values over a facet of the flow.
  struct FacetShare {
    std::int32_t node;
    std::array<double, 3> corner;
  };

  void build_motion(const PointFinder& finder, const MappingOptions& options);
  void build_pressure(const MappingOptions& options);
  void build_force(const PointFinder& finder);
  void build_fit();
  void balance_force(const Eigen::Vector3d& force, const Eigen::Vector3d& moment_about_origin,
                     std::span<const double> x_solid, std::span<double> nodal) const;

  link::InterfaceMesh flow_, solid_;
  std::string method_;
  double gap_ = 0.0;
  Rows motion_, pressure_;
  std::vector<std::size_t> facet_begin_;
  std::vector<FacetShare> facet_share_;
  std::vector<double> share_;            ///< [n_solid] of the whole surface, sum 1
  std::vector<Eigen::Vector3d> offset_;  ///< [n_flow] X_f - H X_s, m; empty where it is rounding
  std::vector<Eigen::Vector3d> fit_;     ///< [n_solid] 1/m: gradient of a field = sum fit_j u_j
};

}  // namespace ocublast::coupler
