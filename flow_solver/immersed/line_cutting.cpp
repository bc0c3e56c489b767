// Lines, tags and segments from the crossings. The tag of a node is decided once, along the first
// present direction; lines of the others take the tags as given and look for the crossing beside
// each change of tag. So the three directions always agree on what is fluid, also where a facet
// lies exactly on nodes and the crossings of two directions differ by a rounding.
#include "flow_solver/immersed/line_cutting.hpp"

#include <omp.h>

#include <algorithm>
#include <cmath>

namespace ocublast::flow {
namespace {

/// A crossing this far (units of the snapped grid, 1.5e-5 of a cell) outside an interval still
/// belongs to it: covers the rounding of vertices and positions.
constexpr double interval_slack = 16.0;
constexpr int most_gap_passes = 4;

/// A place where the line enters or leaves the union of all bodies.
struct UnionCrossing {
  double position = 0.0;
  std::int32_t body = 0;
  std::int32_t facet = 0;
  bool enters = false;
};

class LineReader {
 public:
  LineReader(const Bodies& bodies, int a) : bodies_(bodies), a_(a), count_(bodies.size(), 0) {}

  /// Crossings of the union along a line, ascending. Empty where no body meets the line.
  const std::vector<UnionCrossing>& read(std::size_t line) {
    merged_.clear();
    found_.clear();
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
      const LineCrossings& crossings = bodies_[b].crossings[static_cast<std::size_t>(a_)];
      for (std::uint32_t n = crossings.first[line]; n < crossings.first[line + 1]; ++n) {
        merged_.push_back({crossings.list[n], static_cast<std::int32_t>(b)});
      }
    }
    if (merged_.empty()) return found_;
    if (bodies_.size() > 1) sort_merged();
    std::fill(count_.begin(), count_.end(), 0);
    int n_inside = 0;
    for (const Member& m : merged_) {
      const bool was_inside = n_inside > 0;
      int& count = count_[m.body];
      n_inside -= count != 0 ? 1 : 0;
      count += m.crossing.turn;
      n_inside += count != 0 ? 1 : 0;
      if (was_inside != (n_inside > 0)) {
        found_.push_back({.position = m.crossing.position,
                          .body = m.body,
                          .facet = m.crossing.facet,
                          .enters = n_inside > 0});
      }
    }
    return found_;
  }

 private:
  struct Member {
    Crossing crossing;
    std::int32_t body;
  };
  void sort_merged() {
    std::stable_sort(merged_.begin(), merged_.end(), [](const Member& x, const Member& y) {
      if (x.crossing.position != y.crossing.position)
        return x.crossing.position < y.crossing.position;
      return x.crossing.turn > y.crossing.turn;
    });
  }
  const Bodies& bodies_;
  int a_;
  std::vector<int> count_;
  std::vector<Member> merged_;
  std::vector<UnionCrossing> found_;
};

/// Strides and extents of the node arrays.
struct Layout {
  std::array<int, 3> n;
  std::array<std::ptrdiff_t, 3> stride;
  explicit Layout(const Grid& grid)
      : n{grid.axis[0].n, grid.axis[1].n, grid.axis[2].n},
        stride{1, n[0], static_cast<std::ptrdiff_t>(n[0]) * n[1]} {}
  [[nodiscard]] int n_b(int a) const { return n[across(a)[0]]; }
  [[nodiscard]] int n_c(int a) const { return n[across(a)[1]]; }
  [[nodiscard]] std::ptrdiff_t first_node(int a, std::ptrdiff_t line) const {
    const auto [b, c] = across(a);
    return (line % n[b]) * stride[b] + (line / n[b]) * stride[c];
  }
};

/// Lines of each direction that need cutting: they meet a body or hold a node that is not fluid.
using LineMarks = std::array<std::vector<std::uint8_t>, 3>;

/// Marks the lines of the two other directions through the nodes [begin, end) of a line of a.
void mark_lines_through(const Layout& layout, int a, std::ptrdiff_t line, int begin, int end,
                        const Grid& grid, LineMarks& marks) {
  const auto [b, c] = across(a);
  std::array<int, 3> at{};
  at[b] = static_cast<int>(line % layout.n[b]);
  at[c] = static_cast<int>(line / layout.n[b]);
  for (const int d : {0, 1, 2}) {
    if (d == a || !grid.axis[static_cast<std::size_t>(d)].present) continue;
    const auto [db, dc] = across(d);
    for (int i = begin; i < end; ++i) {
      at[a] = i;
      marks[d][static_cast<std::size_t>(at[dc]) * layout.n[db] + at[db]] = 1;
    }
  }
}

void mark_crossed_lines(const Bodies& bodies, int a, std::vector<std::uint8_t>& marks) {
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    const auto& first = bodies[b].crossings[static_cast<std::size_t>(a)].first;
    for (std::size_t l = 0; l < marks.size(); ++l) {
      if (first[l] != first[l + 1]) marks[l] = 1;
    }
  }
}

/// Tags the nodes inside the union along direction a: those with entry <= x < exit, which is the
/// same symbolic shift (towards larger coordinates) that decides ties across the line.
void tag_bodies(const Grid& grid, const Bodies& bodies, const Layout& layout, int a, CutGrid& cut,
                LineMarks& marks) {
  const auto& node = bodies.snapped_grid().node(a);
  LineReader reader(bodies, a);
  for (std::size_t line = 0; line < marks[a].size(); ++line) {
    if (marks[a][line] == 0) continue;
    const auto& crossings = reader.read(line);
    const std::ptrdiff_t first = layout.first_node(a, static_cast<std::ptrdiff_t>(line));
    for (std::size_t n = 0; n < crossings.size(); n += 2) {
      const auto from =
          std::lower_bound(node.begin(), node.end(), std::ceil(crossings[n].position));
      const auto to = n + 1 < crossings.size()
                          ? std::lower_bound(from, node.end(), std::ceil(crossings[n + 1].position))
                          : node.end();
      const int begin = static_cast<int>(from - node.begin());
      const int end = static_cast<int>(to - node.begin());
      for (int i = begin; i < end; ++i) cut.tag[first + i * layout.stride[a]] = tag_body;
      mark_lines_through(layout, a, static_cast<std::ptrdiff_t>(line), begin, end, grid, marks);
    }
  }
}

/// What one thread finds on its share of the lines of a direction.
struct Share {
  std::vector<Segment> segments;
  std::vector<WallEnd> walls;
  std::vector<std::ptrdiff_t> thin;  ///< nodes below a cut between two fluid nodes
};

class LineCutter {
 public:
  LineCutter(const Grid& grid, const Bodies& bodies, const Layout& layout, int a,
             const std::vector<std::uint8_t>& tag, Share& out)
      : axis_(grid.axis[static_cast<std::size_t>(a)]),
        snapped_(bodies.snapped_grid()),
        layout_(layout),
        a_(a),
        tag_(tag),
        out_(out),
        reader_(bodies, a) {}

  /// Segments of one line; false: it is fluid from end to end after all.
  bool cut(std::ptrdiff_t line) {
    line_ = line;
    first_ = layout_.first_node(a_, line);
    crossings_ = &reader_.read(static_cast<std::size_t>(line));
    const std::size_t before = out_.segments.size();
    for (int i = 0; i < axis_.n;) {
      if (tag_at(i) != tag_fluid) {
        ++i;
        continue;
      }
      i = add_segment(i);
    }
    if (out_.segments.size() != before + 1) return true;
    const Segment& s = out_.segments.back();
    if (s.begin > 0 || s.end < axis_.n || s.wall_low >= 0 || s.wall_high >= 0) return true;
    out_.segments.pop_back();
    return false;
  }

 private:
  [[nodiscard]] std::uint8_t tag_at(int i) const { return tag_[first_ + i * layout_.stride[a_]]; }
  [[nodiscard]] double units_at(int i) const {
    return static_cast<double>(snapped_.node(a_)[static_cast<std::size_t>(i)]);
  }

  /// First entry, or last exit, between two places on the line; null: none.
  [[nodiscard]] const UnionCrossing* first_entry(double low, double high) const {
    for (const UnionCrossing& c : *crossings_) {
      if (c.enters && c.position >= low && c.position <= high) return &c;
    }
    return nullptr;
  }
  [[nodiscard]] const UnionCrossing* last_exit(double low, double high) const {
    const UnionCrossing* found = nullptr;
    for (const UnionCrossing& c : *crossings_) {
      if (!c.enters && c.position >= low && c.position <= high) found = &c;
    }
    return found;
  }
  /// Does a body thinner than the spacing lie between the fluid nodes i and i + 1?
  [[nodiscard]] bool thin_body_behind(int i) const {
    if (crossings_->empty()) return false;
    const double low = units_at(i) - interval_slack;
    const double high = units_at(i + 1) + interval_slack;
    const UnionCrossing* entry = first_entry(low, high);
    if (entry == nullptr) return false;
    const UnionCrossing* exit = last_exit(low, high);
    return exit != nullptr && exit->position > entry->position;
  }

  int add_segment(int begin) {
    Segment s{.b = static_cast<int>(line_ % layout_.n_b(a_)),
              .c = static_cast<int>(line_ / layout_.n_b(a_)),
              .begin = begin};
    int end = begin + 1;
    while (end < axis_.n && tag_at(end) == tag_fluid && !thin_body_behind(end - 1)) ++end;
    if (end < axis_.n && tag_at(end) == tag_fluid) {
      out_.thin.push_back(first_ + (end - 1) * layout_.stride[a_]);
    }
    s.end = end;
    if (has_wall_below(begin)) s.wall_low = add_wall(begin, -1);
    if (has_wall_above(end - 1)) s.wall_high = add_wall(end - 1, 1);
    out_.segments.push_back(s);
    return end;
  }

  /// At the grid's ends a wall counts when it lies between the last node and the domain's face.
  [[nodiscard]] bool has_wall_below(int i) const {
    if (i > 0) return true;
    return last_exit(snapped_.to_units(a_, axis_.min) + interval_slack,
                     units_at(0) + interval_slack) != nullptr;
  }
  [[nodiscard]] bool has_wall_above(int i) const {
    if (i + 1 < axis_.n) return true;
    return first_entry(units_at(i) - interval_slack,
                       snapped_.to_units(a_, axis_.max) - interval_slack) != nullptr;
  }

  int add_wall(int i, int side) {
    const bool inner = side > 0 ? i + 1 < axis_.n : i > 0;
    const double here = units_at(i);
    const double there =
        inner ? units_at(i + side) : snapped_.to_units(a_, side > 0 ? axis_.max : axis_.min);
    const UnionCrossing* c = side > 0 ? first_entry(here - interval_slack, there + interval_slack)
                                      : last_exit(there - interval_slack, here + interval_slack);
    WallEnd wall{.line = static_cast<std::int32_t>(line_), .node = i, .side = side};
    // Without a crossing beside it the change of tag is the mouth of a blocked gap (or a facet that
    // grazes the line within the snapping): a wall half-way, square to the line.
    double position = 0.5 * (here + there);
    if (c != nullptr) {
      position = std::clamp(c->position, std::min(here, there), std::max(here, there));
      wall.body = c->body;
      wall.facet = c->facet;
    }
    wall.position = snapped_.to_metres(a_, position);
    out_.walls.push_back(wall);
    return static_cast<int>(out_.walls.size()) - 1;
  }

  const Axis& axis_;
  const SnappedGrid& snapped_;
  const Layout& layout_;
  int a_;
  const std::vector<std::uint8_t>& tag_;
  Share& out_;
  LineReader reader_;
  std::ptrdiff_t line_ = 0;
  std::ptrdiff_t first_ = 0;
  const std::vector<UnionCrossing>* crossings_ = nullptr;
};

/// Appends the shares in order; wall numbers shift by what came before.
void join(std::vector<Share>& shares, int a, CutGrid& cut) {
  CutLines& lines = cut.lines[a];
  std::vector<WallEnd>& walls = cut.walls[a];
  lines.segments.clear();
  walls.clear();
  for (Share& share : shares) {
    const int offset = static_cast<int>(walls.size());
    for (Segment& s : share.segments) {
      s.wall_low += s.wall_low >= 0 ? offset : 0;
      s.wall_high += s.wall_high >= 0 ? offset : 0;
    }
    lines.segments.insert(lines.segments.end(), share.segments.begin(), share.segments.end());
    walls.insert(walls.end(), share.walls.begin(), share.walls.end());
    for (const std::ptrdiff_t node : share.thin) {
      cut.thin_cut[node] = static_cast<std::uint8_t>(cut.thin_cut[node] | (1U << a));
    }
    cut.n_thin += share.thin.size();
  }
  lines.n_walls = static_cast<int>(walls.size());
  lines.wall_position.resize(walls.size());
  for (std::size_t w = 0; w < walls.size(); ++w) lines.wall_position[w] = walls[w].position;
}

void cut_direction(const Grid& grid, const Bodies& bodies, const Layout& layout, int a,
                   const std::vector<std::uint8_t>& marks, CutGrid& cut) {
  const auto n_lines = static_cast<std::ptrdiff_t>(marks.size());
  const int n_shares = omp_get_max_threads();
  std::vector<Share> shares(static_cast<std::size_t>(n_shares));
  cut.lines[a].cut = marks;
#pragma omp parallel for schedule(static, 1) if (n_lines > 1000)
  for (int share = 0; share < n_shares; ++share) {
    LineCutter cutter(grid, bodies, layout, a, cut.tag, shares[static_cast<std::size_t>(share)]);
    for (std::ptrdiff_t l = n_lines * share / n_shares; l < n_lines * (share + 1) / n_shares; ++l) {
      if (marks[l] != 0) cut.lines[a].cut[l] = cutter.cut(l) ? 1 : 0;
    }
  }
  join(shares, a, cut);
}

/// Where gaps are measured: lines of one direction, with the faces of the domain that are walls.
struct GapLines {
  const Axis& axis;
  const CutLines& lines;
  const std::vector<WallEnd>& walls;
  bool low_face, high_face;

  GapLines(const Grid& grid, const CutGrid& cut, const std::array<bool, 6>& domain_wall, int a)
      : axis(grid.axis[static_cast<std::size_t>(a)]),
        lines(cut.lines[a]),
        walls(cut.walls[a]),
        low_face(domain_wall[static_cast<std::size_t>(2 * a)]),
        high_face(domain_wall[static_cast<std::size_t>(2 * a + 1)]) {}

  /// Width of a segment between two walls, one of them at least a body's, in cells of its own
  /// place; HUGE_VAL: not a gap.
  [[nodiscard]] double width(const Segment& s) const {
    const bool is_gap =
        (s.wall_low >= 0 && (s.wall_high >= 0 || high_face)) || (s.wall_high >= 0 && low_face);
    if (!is_gap) return HUGE_VAL;
    double h = 0.0;
    for (int i = s.begin; i < s.end; ++i) h += axis.h(i);
    h /= s.end - s.begin;
    const double low = s.wall_low >= 0 ? walls[s.wall_low].position : axis.min;
    const double high = s.wall_high >= 0 ? walls[s.wall_high].position : axis.max;
    return (high - low) / h;
  }
};

/// Tags segments narrower than the rule allows; returns whether there were any.
bool block_gaps(const Grid& grid, const Layout& layout, double gap_block,
                const std::array<bool, 6>& domain_wall, CutGrid& cut, LineMarks& marks) {
  bool any = false;
  for (int a = 0; a < 3; ++a) {
    const GapLines gaps(grid, cut, domain_wall, a);
    for (const Segment& s : gaps.lines.segments) {
      if (gaps.width(s) >= gap_block) continue;
      any = true;
      ++cut.blocked_segments;
      const std::ptrdiff_t line = static_cast<std::ptrdiff_t>(s.c) * layout.n_b(a) + s.b;
      for (int i = s.begin; i < s.end; ++i) {
        cut.tag[layout.first_node(a, line) + i * layout.stride[a]] = tag_blocked;
      }
      mark_lines_through(layout, a, line, s.begin, s.end, grid, marks);
    }
  }
  return any;
}

void find_smallest_gap(const Grid& grid, const std::array<bool, 6>& domain_wall, CutGrid& cut) {
  double smallest = HUGE_VAL;
  for (int a = 0; a < 3; ++a) {
    const GapLines gaps(grid, cut, domain_wall, a);
    for (const Segment& s : gaps.lines.segments) smallest = std::min(smallest, gaps.width(s));
  }
  cut.smallest_gap = smallest < HUGE_VAL ? smallest : 0.0;
}

}  // namespace

void cut_grid(const Grid& grid, const Bodies& bodies, double gap_block,
              const std::array<bool, 6>& domain_wall, CutGrid& cut) {
  const Layout layout(grid);
  cut.blocked_segments = cut.open_lines = cut.n_thin = 0;
  cut.smallest_gap = 0.0;
  cut.tag.assign(grid.n_cells(), tag_fluid);
  LineMarks marks;
  int first_present = -1;
  for (int a = 0; a < 3; ++a) {
    if (!grid.axis[static_cast<std::size_t>(a)].present) continue;
    if (first_present < 0) first_present = a;
    marks[a].assign(static_cast<std::size_t>(layout.n_b(a)) * layout.n_c(a), 0);
    mark_crossed_lines(bodies, a, marks[a]);
    for (std::size_t b = 0; b < bodies.size(); ++b)
      cut.open_lines += bodies[b].crossings[a].open_lines;
  }
  if (first_present < 0) return;
  tag_bodies(grid, bodies, layout, first_present, cut, marks);
  for (int pass = 0; pass <= most_gap_passes; ++pass) {
    cut.thin_cut.assign(grid.n_cells(), 0);
    cut.n_thin = 0;
    for (int a = first_present; a < 3; ++a) {
      if (grid.axis[static_cast<std::size_t>(a)].present) {
        cut_direction(grid, bodies, layout, a, marks[a], cut);
      }
    }
    if (gap_block <= 0.0 || pass == most_gap_passes) break;
    if (!block_gaps(grid, layout, gap_block, domain_wall, cut, marks)) break;
  }
  find_smallest_gap(grid, domain_wall, cut);
}

}  // namespace ocublast::flow
