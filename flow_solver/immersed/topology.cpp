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

/// What of the old topology still holds.
class Reuse {
 public:
  Reuse(const Grid& grid, const Bodies& bodies, const FluidNodes& nodes, const Topology& old,
        const CutGrid& cut)
      : grid_(grid), bodies_(bodies), old_(old), state_(old.ghosts.point.size()) {
    for (std::size_t b = 0; b < bodies.size(); ++b) {
      const auto& stale = bodies[b].stale;
      any_stale_.push_back(std::find(stale.begin(), stale.end(), 1) != stale.end());
    }
    find_changed_cuts(cut);
    const auto n = static_cast<std::ptrdiff_t>(state_.size());
#pragma omp parallel for schedule(static) if (n > 2000)
    for (std::ptrdiff_t p = 0; p < n; ++p)
      state_[p] = state_of(old.ghosts.point[p], old.ghosts.node[p], nodes);
  }

  /// Number of the same wall end in the old topology, -1: new. `hint` moves along with the caller's
  /// walls, which are sorted like the old ones.
  [[nodiscard]] std::int32_t old_wall(int axis, const WallEnd& wall, std::size_t& hint) const {
    const auto& walls = old_.cut.walls[axis];
    constexpr int most_steps = 8;
    for (int step = 0; step < most_steps && hint < walls.size() && comes_before(walls[hint], wall);
         ++step)
      ++hint;
    const bool passed = hint > walls.size() || (hint > 0 && !comes_before(walls[hint - 1], wall));
    if (passed || (hint < walls.size() && comes_before(walls[hint], wall))) {
      hint = static_cast<std::size_t>(
          std::lower_bound(walls.begin(), walls.end(), wall, comes_before) - walls.begin());
    }
    if (hint >= walls.size() || wall.facet < 0) return -1;
    const WallEnd& at = walls[hint];
    const bool is_it = at.line == wall.line && at.node == wall.node && at.side == wall.side &&
                       at.body == wall.body && at.facet == wall.facet;
    return is_it ? static_cast<std::int32_t>(hint) : -1;
  }
  /// May the foot of an old ghost stay, for this wall?
  [[nodiscard]] bool foot_holds(const WallEnd& wall, std::int32_t point) const {
    return (state_[static_cast<std::size_t>(point)] & foot_stays) != 0 &&
           bodies_[wall.body].stale[wall.facet] == 0;
  }
  /// Is it where the body is: has that not moved since the topology before, or since its ghosts
  /// were filled?
  [[nodiscard]] bool is_there(std::int32_t point) const {
    return (state_[static_cast<std::size_t>(point)] & foot_is_there) != 0;
  }
  /// Are all nodes of its stencil still fluid?
  [[nodiscard]] bool nodes_hold(std::int32_t point) const {
    return (state_[static_cast<std::size_t>(point)] & nodes_stay) != 0;
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
  enum State : std::uint8_t { foot_stays = 1, foot_is_there = 2, nodes_stay = 4 };
  [[nodiscard]] std::uint8_t state_of(const GhostPoint& ghost, const NodeIndex& node,
                                      const FluidNodes& nodes) const {
    const Foot& foot = ghost.foot;
    if (foot.body < 0) return 0;
    const BodyState& body = bodies_[foot.body];
    int state = foot_stays;
    if (body.stale[foot.facet] != 0) state = 0;
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
      if (any_stale_[b] && static_cast<std::int32_t>(b) != foot.body &&
          bodies_[b].tree.box().contains(foot.point, norm(place(grid_, node) - foot.point))) {
        state = 0;
      }
    }
    if (!body.moved_since_topology || !body.moved_since_ghosts) state |= foot_is_there;
    if (nodes.holds(ghost.stencil)) state |= nodes_stay;
    return static_cast<std::uint8_t>(state);
  }
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
  std::vector<std::uint8_t> state_;  ///< per old ghost
  std::vector<bool> any_stale_;
  NodeIndex changed_low_{1 << 30, 1 << 30, 1 << 30};
  NodeIndex changed_high_{-(1 << 30), -(1 << 30), -(1 << 30)};
};

/// Ghosts that other directions found at the same nodes in this topology.
class FoundBefore {
 public:
  FoundBefore(const Grid& grid, const Bodies& bodies, const FluidNodes& nodes, Topology& topology)
      : grid_(grid), bodies_(bodies), nodes_(nodes), topology_(topology) {
    if (topology.found_at.size() != topology.cut.tag.size())
      topology.found_at.assign(topology.cut.tag.size(), -1);
    for (std::size_t a = 0; a < 3; ++a) alone_[a].assign(topology.cut.walls[a].size() * n_ghost, 0);
  }
  /// Takes over the foot if a search would find the same, and the stencil if it would be the same
  /// too. Returns 0: neither, 1: the foot, 2: both.
  [[nodiscard]] int take(const WallEnd& wall, const NodeIndex& node, const NodeIndex& end,
                         const Vec3& x, const Vec3& crossing, GhostPoint& ghost) const {
    if (!nodes_.contains(node)) return 0;
    const std::int32_t code = topology_.found_at[nodes_.offset(node)];
    if (code < 0) return 0;
    const GhostPoint& there = topology_.searched[code % 3][code / 3];
    if (!is_foot_of(bodies_, there.foot, x, crossing, wall.body, wall.facet)) return 0;
    ghost.foot = there.foot;
    const WallEnd& other = topology_.cut.walls[code % 3][code / 3 / n_ghost];
    if (!nodes_.sees_alike(there.stencil, end_node(grid_, code % 3, other), end)) return 1;
    ghost.stencil = there.stencil;
    return 2;
  }
  /// A ghost whose foot stands alone; for the directions after this one.
  void note(int axis, std::ptrdiff_t number) { alone_[axis][number] = 1; }
  void close(int axis) {
    for_alone(axis, [&](std::int32_t& at, std::int32_t code) {
      if (at < 0) at = code;
    });
  }
  ~FoundBefore() {
    for (int axis = 0; axis < 3; ++axis)
      for_alone(axis, [](std::int32_t& at, std::int32_t) { at = -1; });
  }
  FoundBefore(const FoundBefore&) = delete;
  FoundBefore& operator=(const FoundBefore&) = delete;

 private:
  template <class Call>
  void for_alone(int axis, const Call& call) {
    const auto& walls = topology_.cut.walls[axis];
    for (std::size_t w = 0; w < walls.size(); ++w) {
      for (int layer = 0; layer < n_ghost; ++layer) {
        const std::size_t number = w * n_ghost + static_cast<std::size_t>(layer);
        if (alone_[axis][number] == 0) continue;
        const NodeIndex node = ghost_node(grid_, axis, walls[w], layer);
        if (nodes_.contains(node))
          call(topology_.found_at[nodes_.offset(node)],
               static_cast<std::int32_t>(3 * number) + axis);
      }
    }
  }
  const Grid& grid_;
  const Bodies& bodies_;
  const FluidNodes& nodes_;
  Topology& topology_;
  std::array<std::vector<std::uint8_t>, 3> alone_;
};

/// Searches the ghosts of one direction.
class GhostSearch {
 public:
  GhostSearch(const Grid& grid, const Bodies& bodies, const FluidNodes& nodes, const FarNodes* far,
              const Topology& old, const Reuse& reuse, FoundBefore& before, Topology& topology)
      : grid_(grid),
        bodies_(bodies),
        nodes_(nodes),
        far_(far),
        old_(old),
        reuse_(reuse),
        before_(before),
        topology_(topology) {}

  void search(int axis) {
    const auto& walls = topology_.cut.walls[axis];
    topology_.searched[axis].resize(walls.size() * n_ghost);
    topology_.kept[axis].assign(walls.size() * n_ghost, -1);
    const auto n = static_cast<std::ptrdiff_t>(walls.size());
    constexpr std::ptrdiff_t few = 64;
#pragma omp parallel for schedule(dynamic) if (n > 500)
    for (std::ptrdiff_t begin = 0; begin < n; begin += few) {
      std::size_t hint = 0;
      for (std::ptrdiff_t w = begin; w < std::min(n, begin + few); ++w) {
        if (is_mine(grid_, far_, axis, walls[w])) search_wall(axis, w, hint);
      }
    }
    before_.close(axis);
  }

 private:
  void search_wall(int axis, std::ptrdiff_t w, std::size_t& hint) {
    const WallEnd& wall = topology_.cut.walls[axis][w];
    const NodeIndex end = end_node(grid_, axis, wall);
    const std::int32_t before = reuse_.old_wall(axis, wall, hint);
    const std::int32_t* points =
        before < 0 ? nullptr : &old_.ghosts.of[axis][static_cast<std::size_t>(before) * n_ghost];
    const bool cuts_hold = reuse_.cuts_hold(end);
    const Foot* near = nullptr;
    for (int layer = 0; layer < n_ghost; ++layer) {
      const std::ptrdiff_t g = w * n_ghost + layer;
      GhostPoint& ghost = topology_.searched[axis][g];
      if (points != nullptr && points[layer] >= 0) {
        const std::int32_t point = points[layer];
        const GhostPoint& there = old_.ghosts.point[point];
        near = &there.foot;
        if (reuse_.foot_holds(wall, point)) {
          const bool nodes_changed = !cuts_hold || !reuse_.nodes_hold(point);
          if (reuse_.is_there(point) && !nodes_changed) {
            topology_.kept[axis][g] = point;
            continue;
          }
          ghost = there;
          if (reuse_.is_there(point))
            ghost.stencil = nodes_.image(ghost.foot, end);
          else
            follow_ghost(grid_, bodies_, nodes_, axis, wall, layer, nodes_changed, ghost);
          near = &ghost.foot;
          continue;
        }
      }
      find(axis, g, wall, layer, end, near, ghost);
      near = &ghost.foot;
    }
  }
  void find(int axis, std::ptrdiff_t number, const WallEnd& wall, int layer, const NodeIndex& end,
            const Foot* near, GhostPoint& ghost) {
    const NodeIndex node = ghost_node(grid_, axis, wall, layer);
    const Vec3 x = place(grid_, node);
    int taken = 0;
    if (wall.facet < 0) {
      ghost.foot = mouth_foot(grid_, bodies_, axis, wall, x);
    } else {
      Vec3 crossing = x;
      crossing[axis] = wall.position;
      taken = before_.take(wall, node, end, x, crossing, ghost);
      bool alone = false;
      if (taken == 0)
        ghost.foot = find_foot(bodies_, x, crossing, wall.body, wall.facet, near, &alone);
      if (alone) before_.note(axis, number);
    }
    if (taken < 2) ghost.stencil = nodes_.image(ghost.foot, end);
  }

  const Grid& grid_;
  const Bodies& bodies_;
  const FluidNodes& nodes_;
  const FarNodes* far_;
  const Topology& old_;
  const Reuse& reuse_;
  FoundBefore& before_;
  Topology& topology_;
};

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

void make_topology(const Grid& grid, const Bodies& bodies, const ImmersedOptions& options,
                   const FarNodes* far, const Topology& old, Topology& topology) {
  cut_grid(grid, bodies, options.gap_block, options.domain_wall, topology.cut);
  const FluidNodes nodes(grid, topology.cut.tag, topology.cut.thin_cut);
  const Reuse reuse(grid, bodies, nodes, old, topology.cut);
  FoundBefore before(grid, bodies, nodes, topology);
  GhostSearch search(grid, bodies, nodes, far, old, reuse, before, topology);
  for (int axis = 0; axis < 3; ++axis) {
    search.search(axis);
    // Taken here, not at the first stage: the flow keeps the place of the values.
    topology.cut.lines[axis].ghost.assign(topology.searched[axis].size() * n_primitive, 0.0);
    topology.cut.lines[axis].wall_motion.assign(topology.cut.walls[axis].size() * 6, 0.0);
  }
  arrange_ghosts(grid, bodies, nodes, far, old, topology);
}

}  // namespace ocublast::flow
