// Bodies in the flow: masks and batches from tags and cut lines.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "coupler/base/errors.hpp"
#include "flow_solver/flow_core.hpp"
#include "flow_solver/ranks/gather.hpp"

namespace ocublast::flow::inline OCU_PRECISION {
namespace {

bool is_mirrored(BoundaryKind kind) {
  return kind == BoundaryKind::symmetry || kind == BoundaryKind::wall;
}

}  // namespace

SegmentBatch Flow::Core::batch_of(int axis, std::span<const Segment> group) const {
  const auto a = static_cast<std::size_t>(axis);
  const std::size_t b_of = axis == 0 ? 1 : 0, c_of = axis == 2 ? 1 : 2;
  SegmentBatch batch;
  for (const Segment& s : group) {
    const int l = batch.lanes++;
    // Indices within the box.
    batch.length[l] = s.end - s.begin;
    batch.begin[l] = s.begin - lo[a];
    batch.b[l] = s.b - lo[b_of];
    batch.c[l] = s.c - lo[c_of];
    batch.wall_low[l] = s.wall_low;
    batch.wall_high[l] = s.wall_high;
  }
  return batch;
}

void Flow::Core::add_aligned_batches(int axis, std::vector<Segment>& group,
                                     SegmentBatches& out) const {
  const auto a = static_cast<std::size_t>(axis);
  const auto ghosted = [&](const Segment& s) {
    const auto open = [&](std::size_t face, bool inner) {
      const BoundaryKind kind = boundaries[face].kind;
      return inner || (!is_mirrored(kind) && kind != BoundaryKind::periodic &&
                       kind != BoundaryKind::neighbour);
    };
    return (s.wall_low >= 0 || open(2 * a, lo[a] > 0)) &&
           (s.wall_high >= 0 || open(2 * a + 1, hi[a] < grid.axis[a].n));
  };
  const auto rest = std::stable_partition(group.begin(), group.end(), ghosted);
  std::stable_sort(group.begin(), rest, [](const Segment& l, const Segment& r) {
    return std::tuple(l.b / tile_width, l.begin) < std::tuple(r.b / tile_width, r.begin);
  });
  std::vector<Segment> lanes;
  const auto close = [&] {
    if (lanes.empty()) return;
    out.batch.push_back(batch_of(axis, lanes));
    out.batch.back().aligned = true;
    lanes.clear();
  };
  for (auto s = group.begin(); s != rest; ++s) {
    // Lanes that do not overlap would solve the gap between them.
    const bool joins =
        !lanes.empty() && lanes.front().b / tile_width == s->b / tile_width &&
        s->begin < lanes.front().end &&
        std::none_of(lanes.begin(), lanes.end(), [&](const Segment& l) { return l.b == s->b; });
    if (!joins) close();
    lanes.push_back(*s);
  }
  close();
  group.erase(group.begin(), rest);
}

bool Flow::Core::cut_to_block(int axis, Segment& s) const {
  if (!ranks) return true;
  const auto& begin = ranks->part.begin;
  const std::size_t a = static_cast<std::size_t>(axis), b_of = axis == 0 ? 1 : 0,
                    c_of = axis == 2 ? 1 : 2;
  s.b -= begin[b_of];
  s.c -= begin[c_of];
  s.begin -= begin[a];
  s.end -= begin[a];
  if (s.b < 0 || s.b >= ctx.n[b_of] || s.c < 0 || s.c >= ctx.n[c_of]) return false;
  if (s.begin < 0) {
    s.begin = 0;
    s.wall_low = -1;
  }
  if (s.end > ctx.n[a]) {
    s.end = ctx.n[a];
    s.wall_high = -1;
  }
  return s.end > s.begin;
}

void Flow::Core::set_segments(int axis) {
  const auto a = static_cast<std::size_t>(axis);
  const CutLines& lines = bodies->lines(axis);
  // Axes across in ascending order: lines are addressed (b, c).
  const int b_axis = axis == 0 ? 1 : 0, c_axis = axis == 2 ? 1 : 2;
  const int n_b = ctx.n[b_axis], n_c = ctx.n[c_axis];
  std::fill(cut[a].begin(), cut[a].end(), LaneBits{0});
  const auto stride = static_cast<std::size_t>(axis == 0 ? ctx.row_groups : ctx.tiles);
  const auto group_of = [&](int b, int c) -> LaneBits& {
    return cut[a][static_cast<std::size_t>(c) * stride + static_cast<std::size_t>(b / tile_width)];
  };
  const std::array<int, 3> first = ranks ? ranks->part.begin : std::array<int, 3>{};
  const int whole_b = ranks ? ranks->part.whole.axis[static_cast<std::size_t>(b_axis)].n : n_b;
  for (int c = 0; c < n_c; ++c) {
    for (int b = 0; b < n_b; ++b) {
      const std::size_t line =
          static_cast<std::size_t>(c + first[static_cast<std::size_t>(c_axis)]) *
              static_cast<std::size_t>(whole_b) +
          static_cast<std::size_t>(b + first[static_cast<std::size_t>(b_axis)]);
      if (lines.cut[line] == 0) continue;
      LaneBits& group = group_of(b, c);
      group = static_cast<LaneBits>(group | 1U << (b % tile_width));
    }
  }
  if (ranks && ranks->flux[a]) {
    ranks->cut_flux[a]->take(lines, ranks->flux[a]->borders_of_sums());
    if (ranks->filter[a]) ranks->cut_filter[a]->take(lines, ranks->filter[a]->borders_of_sums());
  }
  const std::vector<Segment>& pieces = lines.segments;
  const auto b_of = static_cast<std::size_t>(b_axis), c_of = static_cast<std::size_t>(c_axis);
  const bool mirror_low = is_mirrored(boundaries[2 * a].kind) && lo[a] == 0;
  const bool known_low = boundaries[2 * a].kind == BoundaryKind::neighbour;
  const bool known_high = boundaries[2 * a + 1].kind == BoundaryKind::neighbour;
  SegmentBatches& out = segments[a];
  out.batch.clear();
  out.begin.assign(static_cast<std::size_t>(hi[c_of] - lo[c_of]) + 1, 0);
  std::vector<Segment> group;
  std::size_t next = 0;
  const int first_c = first[c_of];
  while (next < pieces.size() && pieces[next].c < first_c) ++next;
  for (int c = 0; c < n_c; ++c) {
    if (c >= lo[c_of] && c < hi[c_of])
      out.begin[static_cast<std::size_t>(c - lo[c_of])] = out.batch.size();
    group.clear();
    for (; next < pieces.size() && pieces[next].c == c + first_c; ++next) {
      Segment s = pieces[next];
      if (!cut_to_block(axis, s)) continue;
      if (ranks && s.begin == 0 && s.end == ctx.n[axis] && s.wall_low < 0 && s.wall_high < 0) {
        // Within this block the line is whole.
        LaneBits& bits = group_of(s.b, c);
        bits = static_cast<LaneBits>(bits & ~(1U << (s.b % tile_width)));
        continue;
      }
      if (c < lo[c_of] || c >= hi[c_of] || s.b < lo[b_of] || s.b >= hi[b_of]) continue;
      if (s.begin < lo[a]) {
        s.begin = lo[a];
        s.wall_low = -1;
      }
      if (s.end > hi[a]) {
        s.end = hi[a];
        s.wall_high = -1;
      }
      if (s.end > s.begin) group.push_back(s);
    }
    // Lanes of a batch start in the same way, and go on beyond the block or do not.
    const auto kind_of = [&](const Segment& s) {
      const int start = s.wall_low >= 0 ? 0 : (mirror_low ? 1 : (known_low ? 2 : 0));
      return 2 * start + (s.wall_high < 0 && known_high ? 1 : 0);
    };
    add_aligned_batches(axis, group, out);
    // Lanes of a batch share the elimination from their start and should have like lengths.
    std::stable_sort(group.begin(), group.end(), [&](const Segment& l, const Segment& r) {
      return std::pair(kind_of(l), l.end - l.begin) < std::pair(kind_of(r), r.end - r.begin);
    });
    for (std::size_t s = 0; s < group.size();) {
      std::size_t end = s + 1;
      while (end < group.size() && end - s < tile_width && kind_of(group[end]) == kind_of(group[s]))
        ++end;
      out.batch.push_back(batch_of(axis, std::span(group).subspan(s, end - s)));
      s = end;
    }
  }
  out.begin.back() = out.batch.size();
}

void Flow::Core::add_wall_nodes(int axis) {
  const int b_axis = axis == 0 ? 1 : 0, c_axis = axis == 2 ? 1 : 2;
  for (Segment s : bodies->lines(axis).segments) {
    if (!cut_to_block(axis, s)) continue;
    for (int side = -1; side <= 1; side += 2) {
      const int wall = side < 0 ? s.wall_low : s.wall_high;
      if (wall < 0) continue;
      int at[3] = {};
      at[axis] = side < 0 ? s.begin : s.end - 1;
      at[b_axis] = s.b;
      at[c_axis] = s.c;
      wall_nodes[static_cast<std::size_t>(at[2])].push_back(
          {.i = at[0], .j = at[1], .axis = axis, .side = side, .wall = wall});
      std::uint8_t& sides = wall_sides[mark_index(at[0], at[1], at[2])];
      sides = static_cast<std::uint8_t>(sides | (1U << (2 * axis + (side > 0 ? 1 : 0))));
    }
  }
}

double Flow::Core::wall_dilatation(const WallNode& node, int k) const {
  const Block& w = ctx.W;
  const std::ptrdiff_t stride = node.axis == 0 ? 1 : (node.axis == 1 ? w.sj : w.sk);
  const int along = node.axis == 0 ? node.i : (node.axis == 1 ? node.j : k);
  const Real* beyond = w.data + node.i + node.j * w.sj + k * w.sk + node.side * stride;
  const double ghost =
      ctx.wall_ghost[node.axis][node.wall * n_ghost * n_primitive + prim_u + node.axis];
  return node.side * 0.5 * ctx.line[node.axis].inverse_jacobian[along] *
         (ghost - beyond[(prim_u + node.axis) * w.sf]);
}

void Flow::Core::correct_dilatation(int k) {
  if (!bodies) return;
  for (const WallNode& node : wall_nodes[static_cast<std::size_t>(k)]) {
    ctx.R.data[node.i + node.j * ctx.R.sj + k * ctx.R.sk] +=
        static_cast<Real>(wall_dilatation(node, k));
  }
}

void Flow::Core::correct_bulk(int k, int j_begin, int j_end) {
  if (!bodies) return;
  const Block& w = ctx.W;
  // A mirrored ghost repeats the layer of its distance, another one the last node.
  const auto spread = [&](int axis, int along, std::ptrdiff_t stride, Real* at) {
    const LineView& line = ctx.line[axis];
    const int n = ctx.n[axis];
    if (line.periodic || !ctx.present[axis]) return;
    for (int g = 0; g < n_ghost; ++g) {
      if (along == (line.low == LaneEnd::domain_ghost ? 0 : g)) at[(-1 - g - along) * stride] = *at;
      if (along == n - 1 - (line.high == LaneEnd::domain_ghost ? 0 : g))
        at[(n + g - along) * stride] = *at;
    }
  };
  const auto& nodes = wall_nodes[static_cast<std::size_t>(k)];
  const auto above = [](const WallNode& node, int j) { return node.j < j; };
  const auto begin = std::lower_bound(nodes.begin(), nodes.end(), j_begin, above);
  for (auto n = begin; n != nodes.end() && n->j < j_end; ++n) {
    const WallNode& node = *n;
    Real* at = w.data + node.i + node.j * w.sj + k * w.sk;
    at[field_bulk * w.sf] -= at[field_beta * w.sf] * static_cast<Real>(wall_dilatation(node, k));
    spread(0, node.i, 1, at + field_bulk * w.sf);
    spread(1, node.j, w.sj, at + field_bulk * w.sf);
  }
}

void Flow::Core::take_topology(bool convert) {
  const std::span<const std::uint8_t> tags = bodies->tags();
  const Gas& gas = options.gas;
  constexpr std::array<std::uint8_t, tile_width> all_fluid{};
  static_assert(tag_fluid == 0);
  const Grid& whole = ranks ? ranks->part.whole : grid;
  const std::array<int, 3> first = ranks ? ranks->part.begin : std::array<int, 3>{};
#pragma omp parallel for schedule(dynamic) num_threads(options.threads)
  for (int k = 0; k < ctx.n[2]; ++k) {
    for (int j = 0; j < ctx.n[1]; ++j) {
      std::size_t node = place_of(whole, first[0], j + first[1], k + first[2]);
      for (int t = 0; t < ctx.tiles; ++t) {
        LaneBits bits = 0;
        const int count = std::min(tile_width, ctx.n[0] - t * tile_width);
        if (count == tile_width && std::memcmp(&tags[node], all_fluid.data(), tile_width) == 0) {
          bits = static_cast<LaneBits>(all_lanes);
        } else {
          for (int l = 0; l < count; ++l) {
            if (tags[node + static_cast<std::size_t>(l)] == tag_fluid)
              bits = static_cast<LaneBits>(bits | (1 << l));
          }
        }
        node += static_cast<std::size_t>(count);
        LaneBits& old = fluid[static_cast<std::size_t>((k * ctx.n[1] + j) * ctx.tiles + t)];
        // What a body goes on holding is no state of the flow; its primitives are the ghosts'.
        const auto changed = static_cast<unsigned>(old ^ bits);
        old = bits;
        if (!convert || changed == 0) continue;
        for (int l = 0; l < count; ++l) {
          if (((changed >> l) & 1u) == 0) continue;
          const int i = t * tile_width + l;
          const Real* w = ctx.W.data + i + j * ctx.W.sj + k * ctx.W.sk;
          const double rho = w[0], T = w[4 * ctx.W.sf];
          store_state(i, j, k,
                      {rho, w[ctx.W.sf], w[2 * ctx.W.sf], w[3 * ctx.W.sf], pressure(gas, rho, T)});
        }
      }
    }
  }
  ctx.bodies = true;
  if (wall_nodes.empty()) wall_nodes.resize(static_cast<std::size_t>(ctx.n[2]));
  wall_sides.resize(mark.size(), 0);
  for (int k = 0; k < ctx.n[2]; ++k) {
    auto& nodes = wall_nodes[static_cast<std::size_t>(k)];
    for (const WallNode& n : nodes) wall_sides[mark_index(n.i, n.j, k)] = 0;
    nodes.clear();
  }
  for (int axis = 0; axis < 3; ++axis) {
    if (!ctx.present[axis]) continue;
    set_segments(axis);
    add_wall_nodes(axis);
  }
  for (auto& nodes : wall_nodes)
    std::stable_sort(nodes.begin(), nodes.end(),
                     [](const WallNode& a, const WallNode& b) { return a.j < b.j; });
}

void Flow::immerse(std::unique_ptr<BodiesInFlow> bodies) {
  Core& c = *core_;
  c.bodies = std::move(bodies);
  c.segments = {};
  c.wall_nodes.clear();
  c.wall_sides.clear();
  c.prepared = c.ghosts_filled = false;
  c.set_masks_without_bodies();
  if (!c.bodies) return;
  if (c.ranks) c.require_bodies_on_ranks();
  if (c.radial.power > 0)
    throw CaseError("flow.body: bodies need flow.grid.geometry = \"cartesian\"");
  if (c.ctx.nodal_stress) {
    // Cut lines form their stress from velocity gradients.
    c.G = FieldMemory(c.grid, n_stresses + n_gradients, true);
    const std::span<Real> all = c.G.all();
    std::fill(all.begin(), all.end(), Real{0});
    c.ctx.G = c.G.block();
  }
  c.take_topology(true);
  c.find_box();
}

}  // namespace ocublast::flow
