#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "flow_solver/gas/gas.hpp"
#include "flow_solver/grid/fields.hpp"
#include "flow_solver/immersed/far_nodes.hpp"
#include "flow_solver/immersed/foot.hpp"

namespace ocublast::flow {

using NodeIndex = std::array<std::int32_t, 3>;

/// Weights of the corners of one grid cell: corner c is base + (c & 1, c >> 1 & 1, c >> 2).
struct Stencil {
  NodeIndex base{};
  std::array<double, 8> weight{};  ///< sum 1; 0 where a corner may not be used
  Vec3 place;                      ///< m, weighted mean place of the corners
  double distance = 0.0;           ///< m, of `place` from the foot's plane
  double built_depth = 0.0;        ///< m, depth of the ghost the stencil was made for
  bool own_state = false;          ///< nothing usable near: the end node alone
  bool all_seen = false;  ///< as made: the first choice, no corner left out as out of sight
};

/// State interpolated by a stencil.
struct Sample {
  double p = 0.0;  ///< Pa
  double T = 0.0;  ///< K
  Vec3 u;          ///< m/s
};

/// What decides which nodes a wall may look at.
class FluidNodes {
 public:
  FluidNodes(const Grid& grid, const std::vector<std::uint8_t>& tag,
             const std::vector<std::uint8_t>& thin_cut, bool narrow_gaps = false)
      : grid_(grid), tag_(tag), thin_cut_(thin_cut), narrow_gaps_(narrow_gaps) {}

  /// Do thin bodies stand so close together that a wall's neighbour nodes may lie behind another?
  [[nodiscard]] bool narrow_gaps() const { return narrow_gaps_; }

  /// Multilinear weights at x over the fluid nodes in front of the plane (point, normal) that are
  /// reached from node `from` without passing a body (null: not asked), renormalised. Returns the
  /// share of weight that was usable; below `least` the stencil is not changed.
  double weigh(const Vec3& x, const Vec3& point, const Vec3& normal, const NodeIndex* from,
               double least, Stencil& stencil) const;
  /// Stencil for the image of a ghost: at min(depth, 3.45 spacings) in front of the foot; where no
  /// fluid node is in reach farther out, then closer, at last the end node itself.
  [[nodiscard]] Stencil image(const Foot& foot, const NodeIndex& end_node) const;
  /// May a wall at (point, normal) look at a node: is it fluid, in front of the plane (its mirror
  /// image in a face of the domain too), and reached from node `from` (null: not asked)?
  [[nodiscard]] bool usable(const NodeIndex& node, const Vec3& point, const Vec3& normal,
                            const NodeIndex* from) const;

  /// Would `image` make the same stencil, as it was made for end node `from`, for another end node?
  [[nodiscard]] bool sees_alike(const Stencil& stencil, const NodeIndex& from,
                                const NodeIndex& other) const;

  /// Are all nodes of a stencil still fluid? (One that looks at its own end node alone: no.)
  [[nodiscard]] bool holds(const Stencil& stencil) const;
  /// Fluid node in front of the plane nearest to it, among those around x; false: none.
  [[nodiscard]] bool nearest_in_front(const Vec3& x, const Vec3& point, const Vec3& normal,
                                      NodeIndex& node) const;
  /// Node spacing [m] met along direction `normal` at a node.
  [[nodiscard]] double spacing(const Vec3& normal, const NodeIndex& node) const;
  [[nodiscard]] Vec3 place(const NodeIndex& node) const;
  /// Cell [base, base + 1] around x; absent directions: 0.
  [[nodiscard]] NodeIndex cell(const Vec3& x) const;
  /// The same, moved to nodes of the grid.
  [[nodiscard]] NodeIndex cell_inside(const Vec3& x) const;
  [[nodiscard]] bool is_fluid(const NodeIndex& node) const {
    return tag_[offset(node)] == tag_fluid;
  }
  /// Is it a node of the grid (none of the ghosts beyond its faces)?
  [[nodiscard]] bool contains(const NodeIndex& node) const {
    for (std::size_t a = 0; a < 3; ++a) {
      if (node[a] < 0 || node[a] >= grid_.axis[a].n) return false;
    }
    return true;
  }
  [[nodiscard]] std::size_t offset(const NodeIndex& node) const {
    return static_cast<std::size_t>(node[0]) +
           static_cast<std::size_t>(grid_.axis[0].n) *
               (static_cast<std::size_t>(node[1]) +
                static_cast<std::size_t>(grid_.axis[1].n) * static_cast<std::size_t>(node[2]));
  }
  [[nodiscard]] const Grid& grid() const { return grid_; }

 private:
  [[nodiscard]] bool mirrored(NodeIndex& node) const;
  [[nodiscard]] bool visible(const NodeIndex& from, const NodeIndex& to) const;
  const Grid& grid_;
  const std::vector<std::uint8_t>& tag_;
  const std::vector<std::uint8_t>& thin_cut_;
  bool narrow_gaps_;
};

/// Interpolated state of W; pressure and temperature are interpolated, density follows.
[[nodiscard]] Sample sample(const Stencil& stencil, const GasNodes& W, const Gas& gas) noexcept;

/// Momentum [Pa] that goes along `normal` through the place of a stencil beside the pressure, seen
/// from a wall moving with `velocity`: rho u_n^2 and the scheme's artificial pressure where W
/// carries it. Falls with the square of the distance from the wall in smooth flow. While a shock is
/// reflected it holds what the gas between the nodes and the wall takes up and gives back: without
/// it the wall misses the pressure of the time that the shock needs from the wall to the nodes and
/// back, an error of first order in the impulse. At most what makes the pressure that of gas
/// stopped by a shock, so that no reading exceeds a reflection's; none where the gas leaves the
/// wall.
[[nodiscard]] double momentum_transport(const Stencil& stencil, const GasNodes& W,
                                        const Vec3& velocity, const Vec3& normal,
                                        const Gas& gas) noexcept;

/// State and motion of the wall at a foot.
struct WallState {
  Vec3 velocity;              ///< m/s
  double acceleration = 0.0;  ///< m/s^2, along the normal
  WallSlip slip = WallSlip::slip;
  double temperature = 0.0;  ///< K, 0: adiabatic
};

/// Pressure [Pa] at the wall, or a distance `apart` (m) below the sample, that belongs to a sample
/// in front of it: slope -rho a_n of the accelerated wall and rho u_t . grad n . u_t of gas that
/// turns with a curved wall.
[[nodiscard]] double pressure_towards_wall(const Foot& foot, const Sample& sample,
                                           const WallState& wall, double apart,
                                           const Gas& gas) noexcept;

/// Primitive state at the ghost node of a foot: velocity linear between wall and image (its normal
/// part only for a slip wall), pressure with the slope -rho a_n, temperature even or linear through
/// the wall's.
[[nodiscard]] std::array<double, n_primitive> ghost_state(const Foot& foot, const Stencil& stencil,
                                                          const Sample& image,
                                                          const WallState& wall,
                                                          const Gas& gas) noexcept;

}  // namespace ocublast::flow
