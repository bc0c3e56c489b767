#pragma once

#include <array>
#include <cstddef>
#include <vector>

namespace ocublast::flow {

/// Ghost nodes beyond each end of a present direction.
inline constexpr int n_ghost = 4;

/// One direction of a Cartesian grid. Nodes are cell centres; faces lie half-way in index space.
/// Entry i + n_ghost of a vector belongs to node i, i = -n_ghost .. n + n_ghost - 1 (an absent
/// direction has n = 1 and no ghosts: entry 0).
struct Axis {
  int n = 1;
  bool present = false;
  double min = 0.0;                ///< m, first domain face
  double max = 0.0;                ///< m, last domain face
  std::vector<double> node;        ///< m
  std::vector<double> jacobian;    ///< m, dx/dxi at the nodes, from the same face solve as the fluxes
  std::vector<double> inverse;     ///< 1/m, 1/jacobian
  [[nodiscard]] int ghosts() const { return present ? n_ghost : 0; }
  [[nodiscard]] double x(int i) const { return node[static_cast<std::size_t>(i + ghosts())]; }
  [[nodiscard]] double h(int i) const { return jacobian[static_cast<std::size_t>(i + ghosts())]; }
};

/// Non-uniform Cartesian grid in one to three directions.
struct Grid {
  std::array<Axis, 3> axis;
  [[nodiscard]] std::size_t n_cells() const {
    return static_cast<std::size_t>(axis[0].n) * static_cast<std::size_t>(axis[1].n) *
           static_cast<std::size_t>(axis[2].n);
  }
};

}  // namespace ocublast::flow
