#include "flow_solver/immersed/topology.hpp"

#include <algorithm>
#include <cmath>

namespace ocublast::flow::inline OCU_PRECISION {
namespace {

NodeIndex node_on_line(const Grid& grid, int axis, std::int32_t line, std::int32_t i) {
  const auto [b, c] = across(axis);
  const int n_b = grid.axis[static_cast<std::size_t>(b)].n;
  NodeIndex node{};
  node[axis] = i;
  node[b] = line % n_b;
  node[c] = line / n_b;
  return node;
}

Vec3 place(const Grid& grid, const NodeIndex& node) {
  return {{grid.axis[0].x(node[0]), grid.axis[1].x(node[1]), grid.axis[2].x(node[2])}};
}

/// Foot on the mouth of a blocked gap: the plane across the line, moving as the nearest body does.
Foot mouth_foot(const Grid& grid, const Bodies& bodies, int axis, const WallEnd& wall,
                const Vec3& x) {
  Vec3 mouth = x;
  mouth[axis] = wall.position;
  constexpr double reach = 4.0;  // cells: a blocked gap is narrower than one
  const double h = grid.axis[static_cast<std::size_t>(axis)].h(wall.node);
  Foot foot = nearest_foot(bodies, mouth, reach * h);
  foot.point = mouth;
  foot.normal = Vec3{};
  foot.normal[axis] = -wall.side;
  foot.depth = wall.side * (x[axis] - wall.position);
  return foot;
}

Foot search_foot(const Grid& grid, const Bodies& bodies, int axis, const WallEnd& wall, int layer,
                 const Foot* near) {
  const Vec3 x = place(grid, ghost_node(grid, axis, wall, layer));
  if (wall.facet < 0) return mouth_foot(grid, bodies, axis, wall, x);
  Vec3 crossing = x;
  crossing[axis] = wall.position;
  return find_foot(bodies, x, crossing, wall.body, wall.facet, near);
}

/// What of the old topology still holds.
class Reuse {
 public:
  Reuse(const Grid& grid, const Bodies& bodies, const Topology& old, const CutGrid& cut)
      : grid_(grid), bodies_(bodies), old_(old) {
    for (std::size_t b = 0; b < bodies.size(); ++b) {
      const auto& stale = bodies[b].stale;
      any_stale_.push_back(std::find(stale.begin(), stale.end(), 1) != stale.end());
    }
    find_changed_cuts(cut);
  }

  /// Number of the same wall end in the old topology, -1: new. `hint` moves along with the caller's
  /// walls, which are sorted like the old ones.
  [[nodiscard]] std::int32_t old_wall(int axis, const WallEnd& wall) const {
    const auto& walls = old_.cut.walls[axis];
    const auto at = std::lower_bound(walls.begin(), walls.end(), wall, comes_before);
    if (at == walls.end() || at->line != wall.line || at->node != wall.node ||
        at->side != wall.side || at->body != wall.body || at->facet != wall.facet ||
        wall.facet < 0) {
      return -1;
    }
    return static_cast<std::int32_t>(at - walls.begin());
  }
  [[nodiscard]] bool foot_holds(const WallEnd& wall, const Foot& foot, const Vec3& x) const {
    if (bodies_[wall.body].stale[wall.facet] != 0 || bodies_[foot.body].stale[foot.facet] != 0) {
      return false;
    }
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
      if (any_stale_[b] && static_cast<std::int32_t>(b) != foot.body &&
          bodies_[b].tree.box().contains(foot.point, norm(x - foot.point))) {
        return false;
      }
    }
    return true;
  }
  [[nodiscard]] bool stands_still(const Foot& foot) const {
    return !bodies_[foot.body].moved_since_topology;
  }
  /// Are no thin cuts gone or come among the nodes an image may use (ghost layers and the ladder:
  /// within 8)?
  [[nodiscard]] bool cuts_hold(const NodeIndex& node) const {
    constexpr int reach = 8;
    for (std::size_t a = 0; a < 3; ++a) {
      if (node[a] + reach < changed_low_[a] || node[a] - reach > changed_high_[a]) return true;
    }
    return false;
  }

 private:
  static bool comes_before(const WallEnd& a, const WallEnd& b) {
    if (a.line != b.line) return a.line < b.line;
    return a.node != b.node ? a.node < b.node : a.side < b.side;
  }
  void find_changed_cuts(const CutGrid& cut) {
    if (old_.cut.tag.size() != cut.tag.size()) {
      changed_low_ = {-n_ghost, -n_ghost, -n_ghost};
      changed_high_ = {grid_.axis[0].n + n_ghost, grid_.axis[1].n + n_ghost,
                       grid_.axis[2].n + n_ghost};
      return;
    }
    if (old_.cut.n_thin == 0 && cut.n_thin == 0) return;
    std::size_t n = 0;
    for (int k = 0; k < grid_.axis[2].n; ++k) {
      for (int j = 0; j < grid_.axis[1].n; ++j) {
        for (int i = 0; i < grid_.axis[0].n; ++i, ++n) {
          if (old_.cut.thin_cut[n] == cut.thin_cut[n]) continue;
          const NodeIndex node = {i, j, k};
          for (std::size_t a = 0; a < 3; ++a) {
            changed_low_[a] = std::min(changed_low_[a], node[a]);
            changed_high_[a] = std::max(changed_high_[a], node[a]);
          }
        }
      }
    }
  }

  const Grid& grid_;
  const Bodies& bodies_;
  const Topology& old_;
  std::vector<bool> any_stale_;
  NodeIndex changed_low_{1 << 30, 1 << 30, 1 << 30};
  NodeIndex changed_high_{-(1 << 30), -(1 << 30), -(1 << 30)};
};

void find_ghosts(const Grid& grid, const Bodies& bodies, const FluidNodes& nodes, const FarNodes* far, int axis,
                 const Topology& old, const Reuse& reuse, Topology& topology) {
  const auto& walls = topology.cut.walls[axis];
  auto& ghosts = topology.ghosts[axis];
  ghosts.resize(walls.size() * n_ghost);
  const auto n = static_cast<std::ptrdiff_t>(walls.size());
#pragma omp parallel for schedule(dynamic, 64) if (n > 500)
  for (std::ptrdiff_t w = 0; w < n; ++w) {
    const WallEnd& wall = walls[w];
    if (!is_mine(grid, far, axis, wall)) {
      std::fill_n(ghosts.begin() + w * n_ghost, n_ghost, GhostPoint{});
      continue;
    }
    const NodeIndex end = end_node(grid, axis, wall);
    const std::int32_t before = reuse.old_wall(axis, wall);
    for (int layer = 0; layer < n_ghost; ++layer) {
      GhostPoint& ghost = ghosts[w * n_ghost + layer];
      const Foot* near = layer > 0 ? &ghosts[w * n_ghost + layer - 1].foot : nullptr;
      const Vec3 x = place(grid, ghost_node(grid, axis, wall, layer));
      if (before >= 0) {
        ghost = old.ghosts[axis][static_cast<std::size_t>(before) * n_ghost + layer];
        if (reuse.foot_holds(wall, ghost.foot, x)) {
          const bool nodes_changed = !reuse.cuts_hold(end) || !nodes.holds(ghost.stencil);
          if (reuse.stands_still(ghost.foot)) {
            if (nodes_changed) ghost.stencil = nodes.image(ghost.foot, end);
          } else {
            follow_ghost(grid, bodies, nodes, axis, wall, layer, nodes_changed, ghost);
          }
          continue;
        }
      }
      const Foot last = ghost.foot;
      if (before >= 0) near = &last;
      ghost.foot = search_foot(grid, bodies, axis, wall, layer, near);
      ghost.stencil = nodes.image(ghost.foot, end);
    }
  }
}

}  // namespace

NodeIndex ghost_node(const Grid& grid, int axis, const WallEnd& wall, int layer) {
  return node_on_line(grid, axis, wall.line, wall.node + wall.side * (layer + 1));
}

NodeIndex end_node(const Grid& grid, int axis, const WallEnd& wall) {
  return node_on_line(grid, axis, wall.line, wall.node);
}

void follow_ghost(const Grid& grid, const Bodies& bodies, const FluidNodes& nodes, int axis,
                  const WallEnd& wall, int layer, bool nodes_changed, GhostPoint& ghost) {
  if (wall.facet < 0) return;  // the mouth of a gap stays where it is until the next topology
  const Vec3 x = place(grid, ghost_node(grid, axis, wall, layer));
  ghost.foot = follow_foot(bodies, x, ghost.foot, bodies[wall.body].geometry.normal[wall.facet]);
  const double shift = std::abs(ghost.foot.depth - ghost.stencil.built_depth);
  constexpr double small_shift = 0.05;  // cells: more costs moving walls their second order
  const bool keep = !nodes_changed && !ghost.stencil.own_state &&
                    shift < small_shift * grid.axis[static_cast<std::size_t>(axis)].h(wall.node);
  if (!keep) {
    ghost.stencil = nodes.image(ghost.foot, end_node(grid, axis, wall));
    return;
  }
  ghost.stencil.distance = dot(ghost.stencil.place - ghost.foot.point, ghost.foot.normal);
}

bool is_mine(const Grid& grid, const FarNodes* far, int axis, const WallEnd& wall) {
  return far == nullptr || far->near_own(end_node(grid, axis, wall), n_ghost);
}

/// The band: every body node that is a ghost of some wall end, with the ghost whose foot is
/// nearest.
void find_band(const Grid& grid, const FluidNodes& nodes, const FarNodes* far, Topology& topology) {
  topology.band.clear();
  topology.band_of_node.assign(topology.cut.tag.size(), -1);
  for (int axis = 0; axis < 3; ++axis) {
    const auto& walls = topology.cut.walls[axis];
    for (std::size_t w = 0; w < walls.size(); ++w) {
      const bool mine = is_mine(grid, far, axis, walls[w]);
      for (int layer = 0; layer < n_ghost; ++layer) {
        const NodeIndex node = ghost_node(grid, axis, walls[w], layer);
        if (node[axis] < 0 || node[axis] >= grid.axis[static_cast<std::size_t>(axis)].n) break;
        const std::size_t at = nodes.offset(node);
        std::uint8_t& tag = topology.cut.tag[at];
        if (tag == tag_fluid) continue;
        if (tag == tag_body) tag = tag_band;
        if (!mine) continue;
        const auto number = static_cast<std::int32_t>(w * n_ghost) + layer;
        const Foot& foot = topology.ghosts[axis][number].foot;
        const BandNode candidate{.node = node,
                                 .axis = axis,
                                 .ghost = number,
                                 .normal = foot.normal,
                                 .depth = std::abs(foot.depth)};
        std::int32_t& entry = topology.band_of_node[at];
        if (entry < 0) {
          entry = static_cast<std::int32_t>(topology.band.size());
          topology.band.push_back(candidate);
          continue;
        }
        BandNode& held = topology.band[entry];
        if (candidate.depth < held.depth) held = candidate;
      }
    }
  }
}

void make_topology(const Grid& grid, const Bodies& bodies, const ImmersedOptions& options, const FarNodes* far,
                   const Topology& old, Topology& topology) {
  cut_grid(grid, bodies, options.gap_block, options.domain_wall, topology.cut);
  const FluidNodes nodes(grid, topology.cut.tag, topology.cut.thin_cut);
  const Reuse reuse(grid, bodies, old, topology.cut);
  for (int axis = 0; axis < 3; ++axis) {
    find_ghosts(grid, bodies, nodes, far, axis, old, reuse, topology);
    // Taken here, not at the first stage: the flow keeps the place of the values.
    topology.cut.lines[axis].ghost.assign(topology.ghosts[axis].size() * n_primitive, 0.0);
    topology.cut.lines[axis].wall_motion.assign(topology.cut.walls[axis].size() * 6, 0.0);
  }
  find_band(grid, nodes, far, topology);
}

}  // namespace ocublast::flow
