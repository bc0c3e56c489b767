#include "flow_solver/immersed/bodies.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "coupler/base/errors.hpp"

namespace ocublast::flow {
namespace {

constexpr char axis_name[] = {'x', 'y', 'z'};

void find_place_faults(const Grid& grid, const Body& body, std::vector<std::string>& faults) {
  Box box;
  for (std::size_t v = 0; v < body.surface.vertices.size() / 3; ++v) {
    box.include(row(body.surface.vertices, static_cast<std::int32_t>(v)));
  }
  for (int a = 0; a < 3; ++a) {
    const Axis& axis = grid.axis[static_cast<std::size_t>(a)];
    const double low = axis.present ? axis.min : axis.x(0);
    const double high = axis.present ? axis.max : axis.x(0);
    if (box.high[a] < low || box.low[a] > high) {
      faults.push_back(fmt::format(
          "body '{}': reaches from {} = {} m to {} m, the grid from {} m to {} m; move the body or "
          "the grid{}",
          body.name, axis_name[a], box.low[a], box.high[a], low, high,
          axis.present ? ""
                       : " (an absent direction has one plane of nodes: the body must cross it)"));
    }
  }
}

std::vector<Body> check(const Grid& grid, std::vector<Body> bodies) {
  std::vector<std::string> faults;
  for (const Body& body : bodies) {
    std::vector<std::string> found = find_surface_faults(body);
    if (found.empty()) find_place_faults(grid, body, found);
    faults.insert(faults.end(), found.begin(), found.end());
  }
  if (!faults.empty()) throw CaseError(fmt::format("{}", fmt::join(faults, "\n")));
  return bodies;
}

bool is_zero(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(), [](double x) { return x == 0.0; });
}

}  // namespace

BodyState::BodyState(Body&& b, double smooth_below_degrees)
    : body(std::move(b)),
      topology((orient_outward(body.surface),
                make_surface_topology(body.surface, smooth_below_degrees))),
      path(body.surface.vertices),
      position(body.surface.vertices),
      velocity(position.size(), 0.0),
      acceleration(position.size(), 0.0),
      stale(topology.facet.size(), 1),
      buried(topology.facet.size(), 0) {
  compute_facet_geometry(topology, position, geometry);
}

Bodies::Bodies(const Grid& grid, std::vector<Body> bodies, double smooth_below_degrees)
    : snapped_(grid), present_{grid.axis[0].present, grid.axis[1].present, grid.axis[2].present} {
  bodies = check(grid, std::move(bodies));
  state_.reserve(bodies.size());
  for (Body& body : bodies) state_.emplace_back(std::move(body), smooth_below_degrees);
}

bool Bodies::moved() const {
  return std::any_of(state_.begin(), state_.end(),
                     [](const BodyState& s) { return s.moved_since_topology; });
}

void Bodies::move_to(double t) {
  std::vector<double> before;
  for (BodyState& s : state_) {
    if (!s.body.moves) continue;
    before = s.position;
    s.path.evaluate(t, s.position, s.velocity, s.acceleration);
    s.at_rest = is_zero(s.velocity) && is_zero(s.acceleration);
    if (before == s.position) continue;
    s.moved_since_topology = s.moved_since_ghosts = true;
    compute_facet_geometry(s.topology, s.position, s.geometry);
  }
}

void Bodies::update_search(double stale_distance) {
  for (BodyState& s : state_) {
    if (!s.moved_since_topology) {
      std::fill(s.stale.begin(), s.stale.end(), std::uint8_t{0});
      continue;
    }
    s.tree.update(s.topology.facet, s.position);
    snapped_.snap(s.position, s.snapped);
    const bool first = s.searched.empty();
    if (first) s.searched = s.position;
    std::vector<std::uint8_t> moved(s.n_vertices(), first ? 1 : 0);
    for (std::int32_t v = 0; v < static_cast<std::int32_t>(s.n_vertices()); ++v) {
      if (norm2(row(s.searched, v) - s.vertex(v)) <= stale_distance * stale_distance) continue;
      moved[v] = 1;
      std::copy_n(s.position.begin() + 3 * v, 3, s.searched.begin() + 3 * v);
    }
    for (std::size_t f = 0; f < s.n_facets(); ++f) {
      const Corners& v = s.topology.facet[f];
      s.stale[f] = moved[v[0]] | moved[v[1]] | moved[v[2]];
    }
    for (int a = 0; a < 3; ++a) {
      if (present_[static_cast<std::size_t>(a)]) {
        s.crossings[static_cast<std::size_t>(a)] =
            compute_crossings(snapped_, a, s.topology, s.snapped);
      }
    }
  }
  if (state_.size() > 1) find_buried();
}

int Bodies::winding(std::size_t b, const Vec3& x) const {
  const BodyState& s = state_[b];
  if (!s.tree.box().contains(x, 0.0)) return 0;
  const Point64 at = snapped_.snap(x);
  const double along = snapped_.to_units(0, x[0]);
  // All facets the ray towards +x can meet; the margin covers the rounding of the snapped vertices.
  Box range;
  range.include(x);
  range.include(Vec3{{s.tree.box().high[0], x[1], x[2]}});
  for (int a = 0; a < 3; ++a) {
    range.low[a] -= 2.0 * snapped_.unit(a);
    range.high[a] += 2.0 * snapped_.unit(a);
  }
  int turns = 0;
  s.tree.visit(range, [&](std::int32_t f) {
    const Corners& v = s.topology.facet[f];
    double position = 0.0;
    const int turn =
        meet_triangle(s.snapped[v[0]], s.snapped[v[1]], s.snapped[v[2]], 0, at[1], at[2], position);
    if (turn != 0 && position > along) turns -= turn;
  });
  return turns;
}

bool Bodies::inside_any(const Vec3& x, std::int32_t except) const {
  for (std::size_t b = 0; b < state_.size(); ++b) {
    if (static_cast<std::int32_t>(b) != except && winding(b, x) != 0) return true;
  }
  return false;
}

void Bodies::find_buried() {
  for (std::size_t b = 0; b < state_.size(); ++b) {
    BodyState& s = state_[b];
    bool affected = s.moved_since_topology;
    Box others;
    for (std::size_t o = 0; o < state_.size(); ++o) {
      if (o == b) continue;
      affected = affected || state_[o].moved_since_topology;
      others.include(state_[o].tree.box());
    }
    if (!affected) continue;
    std::vector<std::uint8_t> covered(s.n_vertices(), 0);
    const auto n = static_cast<std::int32_t>(s.n_vertices());
#pragma omp parallel for schedule(dynamic, 256) if (n > 1000)
    for (std::int32_t v = 0; v < n; ++v) {
      const Vec3 x = s.vertex(v);
      covered[v] = others.contains(x, 0.0) && inside_any(x, static_cast<std::int32_t>(b)) ? 1 : 0;
    }
    for (std::size_t f = 0; f < s.n_facets(); ++f) {
      const Corners& v = s.topology.facet[f];
      s.buried[f] = covered[v[0]] & covered[v[1]] & covered[v[2]];
    }
  }
}

}  // namespace ocublast::flow
