#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "solid_solver/boundary/facet_search.hpp"
#include "solid_solver/boundary/nodal_force.hpp"

namespace ocublast::solid {

/// A rigid plane that nodes cannot pass, with Coulomb friction.
struct WallKeys {
  std::vector<std::int32_t> nodes;
  double penalty = 0.1;            ///< stiffness over m (c/L)^2 of a node
  std::vector<double> stiffness;   ///< [nodes] N/m; the run sets it from the penalty
  std::array<double, 3> point{};   ///< m
  std::array<double, 3> normal{};  ///< out of the wall, towards the body
  double friction = 0.0;           ///< Coulomb coefficient
};

/// Contact of two surfaces of one mesh: nodes of each against facets of the other.
struct ContactKeys {
  std::vector<Facet> first;
  std::vector<Facet> second;
  double penalty = 0.1;           ///< stiffness over m (c/L)^2 of a node
  std::vector<double> stiffness;  ///< [n_nodes] N/m (halved in each pass); set by the run
  double friction = 0.0;
  double reach = 0.0;  ///< m: deeper a node counts as being elsewhere; 0: the smallest length
};

/// Coulomb friction by a tangential spring that slips (return mapping), one per node.
struct FrictionState {
  Vec3 spring{};  ///< m, tangential
  Vec3 force{};   ///< N, on the node
};

class RigidWall : public NodalForce {
 public:
  RigidWall(WallKeys keys, std::span<const double> reference);
  ForceWork apply(const StepMotion& motion, std::span<double> residual) override;
  void add_stiffness(std::span<const double> x, std::span<double> y) const override;
  [[nodiscard]] std::span<double> state() override { return friction_; }

 private:
  WallKeys keys_;
  std::vector<double> reference_;  ///< [nodes, 3] m
  std::vector<double> friction_;   ///< [nodes, 6] FrictionState
};

/// Penalty contact, frictionless or Coulomb. A node below the nearest facet is pushed out along the
/// facet's normal with stiffness times depth; the facet's nodes get the opposite force by the
/// weights of the nearest point: linear momentum is kept exactly, angular momentum for frictionless
/// contact as well (the force acts along the line between node and point). Facets are searched anew
/// when the surfaces may have come nearer by half the reach.
class SurfaceContact : public NodalForce {
 public:
  SurfaceContact(ContactKeys keys, std::span<const double> reference);
  ForceWork apply(const StepMotion& motion, std::span<double> residual) override;
  void add_stiffness(std::span<const double> x, std::span<double> y) const override;
  [[nodiscard]] std::span<double> state() override { return friction_; }
  /// Force (N) of the second surface on the first, at the last step.
  [[nodiscard]] const Vec3& force_on_first() const { return total_; }
  [[nodiscard]] std::size_t n_closed() const { return n_closed_; }

 private:
  struct Pass {
    FacetSearch nodes;   ///< whose nodes are tested
    FacetSearch facets;  ///< against these
    double sign;         ///< of the force on the first surface
    std::size_t first_state;
  };
  struct Hit {
    std::int32_t triangle = -1;
    double depth = 0.0;  ///< m, positive inside
    Vec3 normal{};
    Vec3 weights{};
  };
  void move(const StepMotion& motion);
  [[nodiscard]] Hit find(const Pass& pass, std::int32_t node) const;
  void push(const Pass& pass, std::size_t k, const StepMotion& motion, std::span<double> residual,
            ForceWork& work);

  ContactKeys keys_;
  std::vector<double> reference_;  ///< [n, 3] m
  std::vector<double> positions_;  ///< [n, 3] m, now (of the surfaces' nodes)
  std::vector<double> searched_;   ///< where they were at the last search
  std::vector<Pass> passes_;
  std::vector<double> friction_;  ///< [nodes of both passes, 6] FrictionState
  Vec3 total_{};
  std::size_t n_closed_ = 0;
};

}  // namespace ocublast::solid
