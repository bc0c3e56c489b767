#pragma once

#include <string>
#include <vector>

#include "solid_solver/mesh/wet_surface.hpp"
#include "solid_solver/step.hpp"

namespace ocublast::solid {

/// The coupled surface among the ranks: the root knows all of it, each rank has the nodes of its
/// own facets. Operations are collective; alone they copy.
class WetShare {
 public:
  /// `whole` is the mesh before it was cut, on the root; elsewhere it may be null.
  WetShare(const SolidMesh* whole, const std::string& face_set, const SolidRun& run);

  /// On the root.
  [[nodiscard]] const WetSurface& surface() const { return surface_; }
  /// The root's values at all vertices, Pa, to the order of this rank's interface nodes; the span
  /// stays valid until the next call.
  [[nodiscard]] std::span<const double> scatter_pressure(std::span<const double> whole);
  /// The same of forces [n_vertices, 3], N; each goes to one rank, the others get zero for it.
  [[nodiscard]] std::span<const double> scatter_forces(std::span<const double> whole);
  /// A nodal field [n, 4] at all vertices, [n_vertices, 3], on the root.
  void gather(std::span<const double> field, std::span<double> whole) const;
  /// Current positions, m.
  void gather_positions(const SolidRun& run, std::span<double> whole) const;

 private:
  [[nodiscard]] std::vector<double> pick(std::span<const double> field) const;
  void put(std::vector<double> mine, std::span<double> whole) const;

  const Team& team_;
  const std::vector<std::int32_t>& nodes_;  ///< this rank's
  WetSurface surface_;
  std::vector<std::vector<std::size_t>> vertices_;  ///< on the root: per rank, of its nodes
  std::vector<double> pressure_;
  std::vector<double> forces_;
};

}  // namespace ocublast::solid
