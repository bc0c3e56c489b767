#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "solid_solver/mesh/solid_mesh.hpp"

namespace ocublast::solid {

/// A kinematic condition between nodal unknowns, kept exactly in every step.
class Constraint {
 public:
  virtual ~Constraint() = default;
  /// Moves the mass (kg) of dependent nodes to those that carry them.
  virtual void move_mass(std::span<double> /*mass*/) const {}
  /// Moves forces [n, 4] (N) on dependent unknowns to those that carry them; no work is lost.
  virtual void reduce(std::span<double> forces) const = 0;
  /// Sets dependent values [n, 4] of a displacement, velocity or acceleration.
  virtual void expand(std::span<double> field) const = 0;
};

/// Nodes that move in a plane only (symmetry, frictionless flat support of any direction).
class SlidingPlane : public Constraint {
 public:
  /// `normal` need not have unit length.
  SlidingPlane(std::vector<std::int32_t> nodes, const std::array<double, 3>& normal);
  void reduce(std::span<double> forces) const override { project(forces); }
  void expand(std::span<double> field) const override { project(field); }

 private:
  void project(std::span<double> field) const;
  std::vector<std::int32_t> nodes_;
  std::array<double, 3> normal_{};
};

/// Nodes tied to the facets nearest to them in the reference state: they move as the point of the
/// facet that lies nearest, initial distances kept. Forces and mass go to the facet's nodes by the
/// same weights, so linear momentum is kept exactly.
class TiedNodes : public Constraint {
 public:
  /// Ties those of `nodes` that lie within `reach` m of a facet and are not nodes of one.
  TiedNodes(const SolidMesh& mesh, const std::vector<std::int32_t>& nodes,
            const std::vector<Facet>& facets, double reach);
  [[nodiscard]] std::size_t n_tied() const { return ties_.size(); }
  [[nodiscard]] double largest_gap() const { return largest_gap_; }  ///< m, of the tied ones
  [[nodiscard]] std::vector<std::int32_t> tied() const;
  void move_mass(std::span<double> mass) const override;
  void reduce(std::span<double> forces) const override;
  void expand(std::span<double> field) const override;

 private:
  struct Tie {
    std::int32_t node;
    std::array<std::int32_t, 3> carriers;
    std::array<double, 3> weights;
  };
  std::vector<Tie> ties_;
  double largest_gap_ = 0.0;
};

}  // namespace ocublast::solid
