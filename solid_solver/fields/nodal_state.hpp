#pragma once

#include <cstddef>

#include "solid_solver/fields/aligned.hpp"

namespace ocublast::solid {

/// Doubles per node in nodal arrays: x, y, z and one unused, so that a node is one 32-byte load and
/// the element kernels transpose whole rows instead of fetching single numbers.
inline constexpr std::size_t node_stride = 4;

/// Unknowns of the displacement field at one time, each [n_nodes, node_stride].
struct NodalState {
  AlignedVector<double> displacement;  ///< m
  AlignedVector<double> velocity;      ///< m/s
  AlignedVector<double> acceleration;  ///< m/s^2
  double time = 0.0;                   ///< s

  explicit NodalState(std::size_t n_nodes = 0)
      : displacement(n_nodes * node_stride),
        velocity(n_nodes * node_stride),
        acceleration(n_nodes * node_stride) {}
  [[nodiscard]] std::size_t n_nodes() const { return displacement.size() / node_stride; }
};

}  // namespace ocublast::solid
