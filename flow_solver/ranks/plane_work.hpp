#pragma once

#include <array>
#include <vector>

namespace ocublast::flow {

/// How the work of a step is spread over the planes of nodes across each axis, in units of the work
/// of one node of gas. Empty: all nodes alike.
struct PlaneWork {
  std::array<std::vector<double>, 3> of_plane;  ///< [n] of the nodes in a plane
  std::array<std::vector<double>, 3>
      of_border;  ///< [n] added by a border between ranks below a plane
};

}  // namespace ocublast::flow
