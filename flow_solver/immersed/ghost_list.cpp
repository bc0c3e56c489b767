// Order of the ghosts: which node in a body holds whose value, and the list by place that the
// stages walk.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "flow_solver/immersed/topology.hpp"

namespace ocublast::flow::inline OCU_PRECISION {
namespace {

/// A ghost before it is in the list.
const GhostPoint& found(const Topology& old, const Topology& topology, const GhostUse& u) {
  const std::int32_t kept = topology.kept[u.axis][u.ghost];
  return kept >= 0 ? old.ghosts.point[kept] : topology.searched[u.axis][u.ghost];
}

/// Forgets the band that the memory still holds; nodes outside it are not touched.
void clear_band(const FluidNodes& nodes, Topology& topology) {
  if (topology.band_of_node.size() == topology.cut.tag.size()) {
    for (const BandNode& b : topology.band) topology.band_of_node[nodes.offset(b.node)] = -1;
  } else {
    topology.band_of_node.assign(topology.cut.tag.size(), -1);
  }
  topology.band.clear();
}

/// The band: every body node that is a ghost of some wall end, with the ghost whose foot is
/// nearest.
void find_band(const Grid& grid, const FluidNodes& nodes, const FarNodes* far, const Topology& old,
               Topology& topology) {
  clear_band(nodes, topology);
  for (int axis = 0; axis < 3; ++axis) {
    const auto& walls = topology.cut.walls[axis];
    for (std::size_t w = 0; w < walls.size(); ++w) {
      const bool mine = is_mine(grid, far, axis, walls[w]);
      NodeIndex node = end_node(grid, axis, walls[w]);
      for (int layer = 0; layer < n_ghost; ++layer) {
        node[axis] += walls[w].side;
        if (node[axis] < 0 || node[axis] >= grid.axis[static_cast<std::size_t>(axis)].n) break;
        const std::size_t at = nodes.offset(node);
        std::uint8_t& tag = topology.cut.tag[at];
        if (tag == tag_fluid) continue;
        if (tag == tag_body) tag = tag_band;
        if (!mine) continue;
        const auto number = static_cast<std::int32_t>(w * n_ghost) + layer;
        const Foot& foot = found(old, topology, {axis, number}).foot;
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

bool same(const Foot& a, const Foot& b) {
  return a.body == b.body && a.facet == b.facet && a.depth == b.depth && a.point.c == b.point.c &&
         a.weight == b.weight && a.normal.c == b.normal.c && a.curvature == b.curvature;
}
bool same(const Stencil& a, const Stencil& b) {
  return a.base == b.base && a.own_state == b.own_state && a.weight == b.weight &&
         a.place.c == b.place.c && a.distance == b.distance && a.built_depth == b.built_depth;
}

/// Would the two walls of one ghost follow a moving body alike? Facets they may go on to must lie
/// on the side of both.
bool same_side(const Bodies& bodies, const WallEnd& a, const WallEnd& b) {
  if (a.facet < 0 || b.facet < 0) return a.facet == b.facet;
  constexpr double alike =
      0.7;  // between 45 degrees and the 78 of another side lies what a foot can turn
  return dot(bodies[a.body].geometry.normal[a.facet], bodies[b.body].geometry.normal[b.facet]) >
         alike;
}

/// Numbers of rows of nodes with four ghost rows on either side, and of nodes on them.
struct GhostRows {
  std::ptrdiff_t n_j, n_k;
  explicit GhostRows(const Grid& grid)
      : n_j(grid.axis[1].n + 2 * n_ghost), n_k(grid.axis[2].n + 2 * n_ghost) {}
  [[nodiscard]] std::size_t size() const { return static_cast<std::size_t>(n_j * n_k); }
  [[nodiscard]] std::size_t of(const NodeIndex& node) const {
    return static_cast<std::size_t>((node[2] + n_ghost) * n_j + node[1] + n_ghost);
  }
};

struct PlacedUse {
  std::int32_t i = 0;
  GhostUse use;
};

/// This rank's ghosts by place.
void sort_uses(const Grid& grid, const FarNodes* far, const Topology& topology,
               std::vector<std::uint32_t>& first, std::vector<PlacedUse>& placed) {
  const GhostRows rows(grid);
  first.assign(rows.size() + 1, 0);
  const auto for_ghosts = [&](const auto& call) {
    for (int axis = 0; axis < 3; ++axis) {
      const auto& walls = topology.cut.walls[axis];
      for (std::size_t w = 0; w < walls.size(); ++w) {
        if (!is_mine(grid, far, axis, walls[w])) continue;
        NodeIndex node = end_node(grid, axis, walls[w]);
        for (int layer = 0; layer < n_ghost; ++layer) {
          node[axis] += walls[w].side;
          call(node, GhostUse{axis, static_cast<std::int32_t>(w * n_ghost) + layer});
        }
      }
    }
  };
  for_ghosts([&](const NodeIndex& node, const GhostUse&) { ++first[rows.of(node) + 1]; });
  std::partial_sum(first.begin(), first.end(), first.begin());
  placed.resize(first.back());
  for_ghosts([&](const NodeIndex& node, const GhostUse& use) {
    placed[first[rows.of(node)]++] = {node[0], use};
  });
  // `first` has become the end of each row.
  std::size_t begin = 0;
  for (const std::uint32_t end : first) {
    const auto from = placed.begin() + static_cast<std::ptrdiff_t>(begin);
    std::stable_sort(from, placed.begin() + end,
                     [](const PlacedUse& a, const PlacedUse& b) { return a.i < b.i; });
    begin = std::max<std::size_t>(begin, end);
  }
}

void list_ghosts(const Grid& grid, const Bodies& bodies, const FarNodes* far, const Topology& old,
                 Topology& topology) {
  GhostList& list = topology.ghosts;
  std::vector<std::uint32_t> row_end;
  std::vector<PlacedUse> placed;
  sort_uses(grid, far, topology, row_end, placed);
  list.point.clear();
  list.node.clear();
  list.first.clear();
  list.use.clear();
  for (std::size_t a = 0; a < 3; ++a) list.of[a].assign(topology.searched[a].size(), -1);
  const auto kept = [&](const GhostUse& u) { return topology.kept[u.axis][u.ghost]; };
  const auto wall = [&](const GhostUse& u) -> const WallEnd& {
    return topology.cut.walls[u.axis][u.ghost / n_ghost];
  };
  const auto node_of = [&](const GhostUse& u) {
    return ghost_node(grid, u.axis, wall(u), u.ghost % n_ghost);
  };
  std::size_t begin = 0;
  for (const std::uint32_t end : row_end) {
    while (begin < end) {
      std::size_t next = begin;  // the uses of one node
      while (next < end && placed[next].i == placed[begin].i) ++next;
      for (std::size_t u = begin; u < next; ++u) {
        const GhostUse& first = placed[u].use;
        if (list.of[first.axis][first.ghost] >= 0) continue;
        const auto number = static_cast<std::int32_t>(list.point.size());
        const GhostPoint& point = found(old, topology, first);
        list.point.push_back(point);
        list.node.push_back(node_of(first));
        list.first.push_back(static_cast<std::int32_t>(list.use.size()));
        for (std::size_t o = u; o < next; ++o) {
          const GhostUse& other = placed[o].use;
          std::int32_t& of = list.of[other.axis][other.ghost];
          if (of >= 0) continue;
          if (o != u) {  // by what they are, not by what they were, so that a resumed run shares
                         // the same
            const bool same_point = kept(other) >= 0 && kept(other) == kept(first);
            const GhostPoint& there = found(old, topology, other);
            if (!same_point &&
                !(same(point.foot, there.foot) && same(point.stencil, there.stencil)))
              continue;
            if (!same_side(bodies, wall(first), wall(other))) continue;
          }
          of = number;
          list.use.push_back(other);
        }
      }
      begin = next;
    }
  }
  list.first.push_back(static_cast<std::int32_t>(list.use.size()));
  list.in_band.assign(list.point.size(), 0);
  for (const BandNode& b : topology.band) {
    const std::int32_t point = list.of[b.axis][b.ghost];
    if (point >= 0 && (far == nullptr || far->near_own(b.node, 0))) list.in_band[point] = 1;
  }
}

}  // namespace

void arrange_ghosts(const Grid& grid, const Bodies& bodies, const FluidNodes& nodes,
                    const FarNodes* far, const Topology& old, Topology& topology) {
  find_band(grid, nodes, far, old, topology);
  list_ghosts(grid, bodies, far, old, topology);
}

}  // namespace ocublast::flow
