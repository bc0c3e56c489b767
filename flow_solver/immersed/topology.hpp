#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "flow_solver/immersed/ghost_stencil.hpp"
#include "flow_solver/immersed/line_cutting.hpp"

namespace ocublast::flow::inline OCU_PRECISION {

/// One ghost node of a wall end.
struct GhostPoint {
  Foot foot;
  Stencil stencil;
};

/// A node in a body that holds the value of the ghost whose foot is nearest.
struct BandNode {
  NodeIndex node{};
  std::int32_t axis = 0;
  std::int32_t ghost = 0;  ///< wall end * n_ghost + layer
  Vec3 normal;             ///< of the wall its value comes from
  double depth = 0.0;      ///< m, below that wall, not negative
};

/// Where a ghost's value goes: number `ghost` (wall end * n_ghost + layer) of the lines along
/// `axis`.
struct GhostUse {
  std::int32_t axis = 0;
  std::int32_t ghost = 0;
};

/// The ghosts in the order of their nodes, so that the gas around them is read as it lies in
/// memory. Wall ends of several directions share a ghost where node, foot and stencil are the same.
struct GhostList {
  std::vector<GhostPoint> point;
  std::vector<NodeIndex> node;
  std::vector<std::int32_t> first;    ///< [points + 1] into `use`
  std::vector<GhostUse> use;          ///< the first one stands for the others when the wall moves
  std::vector<std::uint8_t> in_band;  ///< per point: the node itself holds the value
  std::array<std::vector<std::int32_t>, 3> of;  ///< point of [n_walls, n_ghost]; -1: another rank's
};

/// Everything that depends on where the walls lie among the nodes.
struct Topology {
  CutGrid cut;
  /// Ghosts as they were found, [n_walls, n_ghost] per direction, and the points of the topology
  /// before that still hold; -1: see `searched`.
  std::array<std::vector<GhostPoint>, 3> searched;
  std::array<std::vector<std::int32_t>, 3> kept;
  /// While ghosts are searched: the one found at a node for a direction before, as 3 number + axis;
  /// -1: none.
  std::vector<std::int32_t> found_at;
  GhostList ghosts;  ///< as they are now
  std::vector<BandNode> band;
  std::vector<std::int32_t> band_of_node;  ///< entry of `band` per node, -1: none

  /// A ghost of this rank as it is now.
  [[nodiscard]] const GhostPoint& ghost(int axis, std::size_t number) const {
    return ghosts
        .point[static_cast<std::size_t>(ghosts.of[static_cast<std::size_t>(axis)][number])];
  }
};

/// Node of the grid at ghost layer 0 .. 3 of a wall end (may lie beyond the domain's face).
[[nodiscard]] NodeIndex ghost_node(const Grid& grid, int axis, const WallEnd& wall, int layer);
/// The fluid node the wall end belongs to.
[[nodiscard]] NodeIndex end_node(const Grid& grid, int axis, const WallEnd& wall);

/// Renews the foot of a ghost after its body moved, with the topology as it is. The stencil keeps
/// its nodes while the wall has moved by less than a twentieth of a cell under it (the wall
/// condition takes the new distances all the same), unless `nodes_changed`.
void follow_ghost(const Grid& grid, const Bodies& bodies, const FluidNodes& nodes, int axis,
                  const WallEnd& wall, int layer, bool nodes_changed, GhostPoint& ghost);

/// Whether this rank looks after a wall end: its ghosts reach into the rank's block. Without ranks:
/// yes.
[[nodiscard]] bool is_mine(const Grid& grid, const FarNodes* far, int axis, const WallEnd& wall);

/// Band and list of ghosts of a topology whose feet are known (`searched`, or `kept` from `old`);
/// with ranks of this one's wall ends.
void arrange_ghosts(const Grid& grid, const Bodies& bodies, const FluidNodes& nodes,
                    const FarNodes* far, const Topology& old, Topology& topology);

/// Cuts the grid for the bodies' current place, with the gap rule of `options`. Feet of `old` are
/// kept where neither their facet nor a body near them moved, so that static walls are searched
/// once. Uses the memory of what `topology` held before. With ranks (`far`) every one cuts the
/// whole grid, which is cheap and the same everywhere; feet are searched by those that need them.
void make_topology(const Grid& grid, const Bodies& bodies, const ImmersedOptions& options,
                   const FarNodes* far, const Topology& old, Topology& topology);

}  // namespace ocublast::flow
