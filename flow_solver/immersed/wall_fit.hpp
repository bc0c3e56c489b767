#pragma once

#include <array>

#include "flow_solver/immersed/ghost_stencil.hpp"

namespace ocublast::flow {

/// Nodes in front of a wall whose weighted sum is the value at one of its points.
struct WallFit {
  struct Node {
    NodeIndex at{};
    double weight = 0.0;
    double distance = 0.0;  ///< m, from the wall's plane
  };
  std::array<Node, 64> node;
  int n = 0;  ///< 0: too few nodes within reach
};

/// Weights, sum 1, of the fluid nodes within 1.75 spacings of `point` and in front of the plane (point,
/// normal) for a field that is linear along the wall: moving least squares (Lancaster and Salkauskas 1981,
/// doi:10.2307/2007507) with a weight that vanishes at the rim of the reach and at the wall. A node thus
/// comes and goes with weight zero, so that the value does not jump when a moving wall passes nodes;
/// along the normal the caller takes each value to the wall. `from`: see FluidNodes::usable.
[[nodiscard]] WallFit fit_at_wall(const FluidNodes& nodes, const Vec3& point, const Vec3& normal,
                                  const NodeIndex* from);

/// Mean of the fields over the nodes of a fit (pressure and temperature; density follows), and of their
/// distance from the wall, m.
struct FitSample {
  Sample gas;
  double distance = 0.0;
};
[[nodiscard]] FitSample sample(const WallFit& fit, const GasNodes& W, const Gas& gas) noexcept;
/// Mean of momentum_transport over them.
[[nodiscard]] double momentum_transport(const WallFit& fit, const GasNodes& W, const Vec3& velocity,
                                        const Vec3& normal, const Gas& gas) noexcept;

}  // namespace ocublast::flow
