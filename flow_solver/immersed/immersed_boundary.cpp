#include "flow_solver/immersed/immersed_boundary.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <type_traits>
#include <utility>

#include "coupler/base/errors.hpp"
#include "flow_solver/immersed/gas_content.hpp"
#include "flow_solver/immersed/surface_readout.hpp"
#include "flow_solver/immersed/topology.hpp"
#include "flow_solver/immersed/wall_thickness.hpp"

namespace ocublast::flow {
namespace {

/// Feet are searched anew where the wall moved by more than this share of the finest spacing;
/// until then they move with their facet.
constexpr double stale_share = 0.2;
/// Largest wall displacement in a step, in cells: a fresh node's held value is then at most a third
/// of a cell away from the wall it was made for.
constexpr double largest_step_share = 0.3;
/// Where a shallow ghost's image lacks the nodes behind the wall, what is read lies farther out
/// than the ghost lies deep, by more than this (spacings): the pressure's curvature on that
/// difference of ways is added, from a second place this much farther.
constexpr double least_offset = 0.1;
constexpr double second_place = 0.7;
/// Share of the pressure at which half of that is left: smooth gas stays below a third of it, a
/// shock far above.
constexpr double largest_curving = 0.02;
/// A fresh node whose nearest wall now faces another way than the one its value came from.
constexpr double changed_side_cosine = 0.2;

double finest_spacing(const Grid& grid) {
  double h = HUGE_VAL;
  for (const Axis& axis : grid.axis) {
    if (!axis.present) continue;
    for (int i = 0; i + 1 < axis.n; ++i) h = std::min(h, axis.x(i + 1) - axis.x(i));
  }
  return h;
}

constexpr const char* history_misfit =
    "checkpoint: the walls do not fit this case; was a mesh or the grid changed?";

template <class T>
void append_bytes(std::vector<std::uint8_t>& bytes, std::span<const T> values) {
  static_assert(std::is_trivially_copyable_v<T>);
  const auto* first = reinterpret_cast<const std::uint8_t*>(values.data());
  bytes.insert(bytes.end(), first, first + values.size_bytes());
}

/// Takes the bytes of all values from the front.
template <class T>
void take_bytes(std::span<const std::uint8_t>& bytes, std::span<T> values) {
  if (bytes.size() < values.size_bytes()) throw CaseError(history_misfit);
  if (!values.empty()) std::memcpy(values.data(), bytes.data(), values.size_bytes());
  bytes = bytes.subspan(values.size_bytes());
}

}  // namespace

struct ImmersedBoundary::State {
  Grid grid;
  Gas gas;
  ImmersedOptions options;
  double h_min;
  Bodies bodies;
  Topology topology;
  Topology last;                  ///< of the step before; its memory serves the next one
  std::unique_ptr<FarNodes> far;  ///< null: no other ranks
  TopologyReport report;
  std::vector<WallThickness> thickness;  ///< per body
  std::uint64_t n_fallbacks = 0;
  bool has_topology = false;

  State(const Grid& g, const Gas& gas_, std::vector<Body>&& b, const ImmersedOptions& o)
      : grid(g),
        gas(gas_),
        options(o),
        h_min(finest_spacing(g)),
        bodies(grid, std::move(b), o.smooth_below_degrees),
        thickness(bodies.size()) {}

  [[nodiscard]] FluidNodes nodes() const {
    const CutGrid& cut = topology.cut;
    // Behind a thin body, less than a few cells away, lie nodes that are not this wall's gas.
    constexpr double narrow = 4.0;
    const bool narrow_gaps = cut.n_thin > 0 && cut.smallest_gap > 0.0 && cut.smallest_gap < narrow;
    return {grid, cut.tag, cut.thin_cut, narrow_gaps};
  }
  [[nodiscard]] ReadOut read_out(FieldsView<const Real> W) const {
    if (far) far->fetch(W);
    return {.nodes = nodes(),
            .bodies = bodies,
            .W = {W, far.get()},
            .gas = gas,
            .transport = options.transport};
  }
  void plan_exchange();
  [[nodiscard]] WallState wall_state(const Foot& foot) const;
  void fill_ghosts(FieldsView<Real> W);
  /// Whether an image may lie far enough out for curve_pressure; cheap, as most do not.
  [[nodiscard]] bool is_far(const GhostPoint& ghost) const {
    constexpr double rounding =
        1.0 - 1e-12;  // no spacing along a normal is less than the finest one
    return ghost.foot.body >= 0 && !ghost.stencil.own_state &&
           ghost.stencil.distance - std::max(0.0, ghost.foot.depth) >=
               rounding * least_offset * h_min;
  }
  void curve_pressure(const FluidNodes& view, const GasNodes& W, const GhostPoint& ghost,
                      const NodeIndex& end, const WallState& wall, Sample& image) const;
  void fill_fresh_nodes(FieldsView<Real> W, const Topology& old);
  [[nodiscard]] bool rebuild(const NodeIndex& node, const Foot& foot, FieldsView<Real> W) const;
};

WallState ImmersedBoundary::State::wall_state(const Foot& foot) const {
  WallState wall;
  if (foot.body < 0) return wall;
  const BodyState& s = bodies[foot.body];
  wall.slip = s.body.slip;
  wall.temperature = s.body.wall_temperature;
  if (s.at_rest) return wall;
  wall.velocity = at_foot(s, foot, s.velocity);
  wall.acceleration = dot(at_foot(s, foot, s.acceleration), foot.normal);
  return wall;
}

/// Less the wall's slope the pressure is even about the wall, q(d) = q(0) + b d^2: adds b (d^2 -
/// D^2) to an image read at distance D for a ghost at depth d < D. Temperature follows along an
/// isentrope.
void ImmersedBoundary::State::curve_pressure(const FluidNodes& view, const GasNodes& W,
                                             const GhostPoint& ghost, const NodeIndex& end,
                                             const WallState& wall, Sample& image) const {
  const Foot& foot = ghost.foot;
  const double distance = ghost.stencil.distance, depth = std::max(0.0, foot.depth);
  const double h = view.spacing(foot.normal, end);
  if (distance - depth < least_offset * h) return;
  Stencil outer;
  constexpr double least_share = 0.5;
  const Vec3 place = foot.point + (distance + second_place * h) * foot.normal;
  if (view.weigh(place, foot.point, foot.normal, &end, least_share, outer) < least_share) return;
  if (outer.distance - distance < 0.5 * h) return;
  const Sample second = sample(outer, W, gas);
  const double curvature = (pressure_towards_wall(foot, second, wall, outer.distance, gas) -
                            pressure_towards_wall(foot, image, wall, distance, gas)) /
                           (outer.distance * outer.distance - distance * distance);
  const double change = curvature * (depth * depth - distance * distance);
  const double share = change / (largest_curving * image.p);
  const double p = image.p + change / (1.0 + share * share);
  image.T *= std::pow(p / image.p, 1.0 - 1.0 / gas.heat_capacity_ratio);
  image.p = p;
}

/// Values of all ghosts into the tables of the lines and, in the band, into their nodes: stencils
/// read fluid nodes and the domain's ghosts only.
void ImmersedBoundary::State::fill_ghosts(FieldsView<Real> W) {
  GhostList& list = topology.ghosts;
  auto& lines = topology.cut.lines;
  const FluidNodes view = nodes();
  const GasNodes everywhere(W, far.get());
  const auto n = static_cast<std::ptrdiff_t>(list.point.size());
  std::uint64_t fallbacks = 0;
#pragma omp parallel for schedule(static) reduction(+ : fallbacks) if (n > 500)
  for (std::ptrdiff_t p = 0; p < n; ++p) {
    GhostPoint& ghost = list.point[p];
    const std::span<const GhostUse> uses(list.use.data() + list.first[p],
                                         list.use.data() + list.first[p + 1]);
    const auto wall_of = [&](const GhostUse& u) -> const WallEnd& {
      return topology.cut.walls[u.axis][u.ghost / n_ghost];
    };
    if (ghost.foot.body >= 0 && bodies[ghost.foot.body].moved_since_ghosts) {
      const GhostUse& u = uses.front();
      follow_ghost(grid, bodies, view, u.axis, wall_of(u), u.ghost % n_ghost, false, ghost);
    }
    Sample image = sample(ghost.stencil, everywhere, gas);
    const WallState wall = wall_state(ghost.foot);
    if (is_far(ghost))
      curve_pressure(view, everywhere, ghost,
                     end_node(grid, uses.front().axis, wall_of(uses.front())), wall, image);
    const auto state = ghost_state(ghost.foot, ghost.stencil, image, wall, gas);
    for (const GhostUse& u : uses) {
      CutLines& to = lines[u.axis];
      std::copy(state.begin(), state.end(),
                to.ghost.begin() + static_cast<std::ptrdiff_t>(u.ghost) * n_primitive);
      if (u.ghost % n_ghost == 0) {
        double* at = &to.wall_motion[static_cast<std::size_t>(u.ghost / n_ghost) * 6];
        for (int a = 0; a < 3; ++a) {
          at[a] = wall.slip == WallSlip::slip ? ghost.foot.normal[a] : 0.0;
          at[3 + a] = wall.velocity[a];
        }
      }
      if (ghost.stencil.own_state && (!far || far->near_own(end_node(grid, u.axis, wall_of(u)), 0)))
        ++fallbacks;
    }
    if (list.in_band[p] == 0) continue;
    const NodeIndex& node = list.node[p];
    Real* at = &W(0, node[0], node[1], node[2]);
    for (int f = 0; f < n_primitive; ++f) at[f * W.stride_f] = static_cast<Real>(state[f]);
  }
  n_fallbacks += fallbacks;
}

/// Pressure and temperature of the image one spacing in front of the wall, normal velocity linear
/// between the two.
bool ImmersedBoundary::State::rebuild(const NodeIndex& node, const Foot& foot,
                                      FieldsView<Real> W) const {
  const FluidNodes view = nodes();
  const double h = view.spacing(foot.normal, node);
  // The node itself must not serve: it is what is being rebuilt. Only neighbours farther out do.
  Stencil stencil;
  constexpr double least_share = 0.05;
  if (view.weigh(foot.point + h * foot.normal, foot.point, foot.normal, &node, least_share,
                 stencil) < least_share) {
    return false;
  }
  double others = 0.0;
  for (unsigned corner = 0; corner < 8; ++corner) {
    const NodeIndex at = {stencil.base[0] + static_cast<int>(corner & 1U),
                          stencil.base[1] + static_cast<int>(corner >> 1 & 1U),
                          stencil.base[2] + static_cast<int>(corner >> 2)};
    if (at == node) stencil.weight[corner] = 0.0;
    others += stencil.weight[corner];
  }
  if (others < least_share) return false;
  for (double& weight : stencil.weight) weight /= others;
  const Sample image = sample(stencil, {W, far.get()}, gas);
  const WallState wall = wall_state(foot);
  const double reach = std::clamp(-foot.depth / h, 0.0, 1.0);
  const Vec3 u = image.u - (1.0 - reach) * dot(image.u - wall.velocity, foot.normal) * foot.normal;
  W(prim_rho, node[0], node[1], node[2]) = static_cast<Real>(density(gas, image.p, image.T));
  for (int a = 0; a < 3; ++a) W(prim_u + a, node[0], node[1], node[2]) = static_cast<Real>(u[a]);
  W(prim_T, node[0], node[1], node[2]) = static_cast<Real>(image.T);
  return true;
}

void ImmersedBoundary::State::fill_fresh_nodes(FieldsView<Real> W, const Topology& old) {
  const auto& tag = topology.cut.tag;
  std::size_t n = 0;
  const auto row = static_cast<std::size_t>(grid.axis[0].n);
  for (int k = 0; k < grid.axis[2].n; ++k) {
    for (int j = 0; j < grid.axis[1].n; ++j) {
      if (std::memcmp(&tag[n], &old.cut.tag[n], row) == 0) {
        n += row;
        continue;
      }
      for (int i = 0; i < grid.axis[0].n; ++i, ++n) {
        if (tag[n] != tag_fluid || old.cut.tag[n] == tag_fluid) continue;
        const NodeIndex node = {i, j, k};
        if (far && !far->near_own(node, 0)) continue;
        ++report.fresh_nodes;
        const Foot foot = nearest_foot(bodies, nodes().place(node), 4.0 * h_min);
        if (foot.body < 0) continue;
        const std::int32_t entry = old.band_of_node[n];
        const bool same_side =
            entry >= 0 && dot(old.band[entry].normal, foot.normal) >= changed_side_cosine;
        if (!same_side && rebuild(node, foot, W)) ++report.rebuilt_nodes;
      }
    }
  }
}

/// What the ranks send each other depends on where the bodies are, in nodes.
void ImmersedBoundary::State::plan_exchange() {
  std::vector<NodeBox> boxes;
  const FluidNodes view = nodes();
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    const Box& around = bodies[b].tree.box();
    const NodeIndex low = view.cell(around.low), high = view.cell(around.high);
    NodeBox box{};
    for (std::size_t a = 0; a < 3; ++a) {
      box.lo[a] = low[a];
      box.hi[a] = high[a] + 2;
    }
    boxes.push_back(box);
  }
  far->plan(boxes);
}

ImmersedBoundary::ImmersedBoundary(const Grid& grid, const Gas& gas, std::vector<Body> bodies,
                                   const ImmersedOptions& options)
    : state_(std::make_unique<State>(grid, gas, std::move(bodies), options)) {}
ImmersedBoundary::~ImmersedBoundary() = default;
ImmersedBoundary::ImmersedBoundary(ImmersedBoundary&&) noexcept = default;
ImmersedBoundary& ImmersedBoundary::operator=(ImmersedBoundary&&) noexcept = default;

void ImmersedBoundary::share(const Ranks& ranks, std::span<const NodeBox> blocks) {
  if (!ranks.alone()) state_->far = std::make_unique<FarNodes>(state_->grid, ranks, blocks);
}

std::size_t ImmersedBoundary::n_bodies() const {
  return state_->bodies.size();
}
const Body& ImmersedBoundary::body(std::size_t b) const {
  return state_->bodies[b].body;
}

void ImmersedBoundary::set_path(std::size_t b, double t_begin, double t_end,
                                std::span<const double> position_end,
                                std::span<const double> velocity_end) {
  state_->bodies[b].path.set_cubic(t_begin, t_end, position_end, velocity_end);
}
void ImmersedBoundary::set_straight_path(std::size_t b, double t_begin, double t_end,
                                         std::span<const double> position_end) {
  state_->bodies[b].path.set_straight(t_begin, t_end, position_end);
}
void ImmersedBoundary::restore_wall(std::size_t b, std::span<const double> position,
                                    std::span<const double> velocity,
                                    std::span<const double> acceleration) {
  state_->bodies[b].path.set_state(position, velocity, acceleration);
}
void ImmersedBoundary::move_to(double t) {
  state_->bodies.move_to(t);
}

TopologyReport ImmersedBoundary::update_topology(FieldsView<Real> W) {
  State& s = *state_;
  if (s.has_topology && !s.bodies.moved()) {
    s.report.fresh_nodes = s.report.rebuilt_nodes = 0;
    s.report.renewed = false;
    return s.report;
  }
  s.bodies.update_search(stale_share * s.h_min);
  std::swap(s.last, s.topology);
  make_topology(s.grid, s.bodies, s.options, s.far.get(), s.last, s.topology);
  if (s.far) s.plan_exchange();
  for (std::size_t b = 0; b < s.bodies.size(); ++b) {
    if (s.bodies[b].body.moves) s.thickness[b].update(s.bodies[b], s.h_min);
  }
  const auto& tag = s.topology.cut.tag;
  s.report = {
      .blocked_segments = s.topology.cut.blocked_segments,
      .fluid_nodes = static_cast<std::size_t>(std::count(tag.begin(), tag.end(), tag_fluid)),
      .smallest_gap = s.topology.cut.smallest_gap,
      .open_lines = s.topology.cut.open_lines};
  if (s.has_topology) {
    if (s.far) s.far->fetch(W);
    s.fill_fresh_nodes(W, s.last);
    if (s.far) {
      double counts[2] = {static_cast<double>(s.report.fresh_nodes),
                          static_cast<double>(s.report.rebuilt_nodes)};
      s.far->ranks().sum_of_all(counts);
      s.report.fresh_nodes = static_cast<std::size_t>(counts[0]);
      s.report.rebuilt_nodes = static_cast<std::size_t>(counts[1]);
    }
  }
  s.has_topology = true;
  for (std::size_t b = 0; b < s.bodies.size(); ++b) {
    s.bodies[b].moved_since_topology = s.bodies[b].moved_since_ghosts = false;
  }
  return s.report;
}

void ImmersedBoundary::compute_ghosts(FieldsView<Real> W) {
  State& s = *state_;
  if (s.far) s.far->fetch(W);
  s.fill_ghosts(W);
  for (std::size_t b = 0; b < s.bodies.size(); ++b) s.bodies[b].moved_since_ghosts = false;
}

const CutLines& ImmersedBoundary::lines(int axis) const {
  return state_->topology.cut.lines[axis];
}
std::span<const std::uint8_t> ImmersedBoundary::tags() const {
  return state_->topology.cut.tag;
}
std::uint64_t ImmersedBoundary::n_fallbacks() const {
  const FarNodes* far = state_->far.get();
  const auto mine = static_cast<double>(state_->n_fallbacks);
  return far != nullptr ? static_cast<std::uint64_t>(far->ranks().sum_of_all(mine))
                        : state_->n_fallbacks;
}

double ImmersedBoundary::wall_step_limit() const {
  double limit = HUGE_VAL;
  for (std::size_t b = 0; b < state_->bodies.size(); ++b) {
    const BodyState& s = state_->bodies[b];
    if (!s.body.moves) continue;
    std::vector<double> speed(s.n_vertices());
    for (std::size_t v = 0; v < speed.size(); ++v) speed[v] = s.path.largest_speed(v);
    for (std::size_t f = 0; f < s.n_facets(); ++f) {
      const Corners& v = s.topology.facet[f];
      const double fastest = std::max({speed[v[0]], speed[v[1]], speed[v[2]]});
      if (fastest <= 0.0) continue;
      const double reach =
          std::min(largest_step_share * state_->h_min, 0.5 * state_->thickness[b].at(f));
      limit = std::min(limit, reach / fastest);
    }
  }
  return limit;
}

WallReading ImmersedBoundary::read_wall(FieldsView<const Real> W, std::size_t b,
                                        double ambient_pressure) const {
  return std::make_shared<const std::vector<FacetReading>>(
      read_facets(state_->read_out(W), b, ambient_pressure));
}

void ImmersedBoundary::overpressure(std::size_t b, const WallReading& reading,
                                    std::span<double> at_vertices) const {
  spread_to_vertices(state_->grid, state_->bodies[b], *reading, at_vertices);
}
void ImmersedBoundary::read_overpressure(FieldsView<const Real> W, std::size_t b,
                                         double ambient_pressure,
                                         std::span<double> at_vertices) const {
  overpressure(b, read_wall(W, b, ambient_pressure), at_vertices);
}

void ImmersedBoundary::force(std::size_t b, const WallReading& reading,
                             std::span<double> at_vertices) const {
  spread_forces(state_->bodies[b], *reading, at_vertices);
}
void ImmersedBoundary::read_force(FieldsView<const Real> W, std::size_t b, double ambient_pressure,
                                  std::span<double> at_vertices) const {
  force(b, read_wall(W, b, ambient_pressure), at_vertices);
}

void ImmersedBoundary::read_shear(FieldsView<const Real> W, std::size_t b,
                                  std::span<double> at_vertices) const {
  const State& s = *state_;
  spread_shear(s.grid, s.bodies[b], read_facets(s.read_out(W), b, 0.0), at_vertices);
}

WallCells ImmersedBoundary::wall_cells(FieldsView<const Real> W) const {
  const FarNodes* far = state_->far.get();
  WallCells cells = integrate_wall_cells(state_->grid, state_->topology.cut, {W, far}, state_->gas);
  if (far != nullptr) {
    double sums[6] = {cells.volume,      cells.mass,        cells.momentum[0],
                      cells.momentum[1], cells.momentum[2], cells.energy};
    far->ranks().sum_of_all(sums);
    cells = {sums[0], sums[1], {sums[2], sums[3], sums[4]}, sums[5]};
  }
  return cells;
}

BodyLoad ImmersedBoundary::load(std::size_t b, const WallReading& reading) const {
  return integrate_load(state_->bodies[b], *reading);
}
BodyLoad ImmersedBoundary::load(FieldsView<const Real> W, std::size_t b,
                                double ambient_pressure) const {
  return load(b, read_wall(W, b, ambient_pressure));
}

std::vector<std::uint8_t> ImmersedBoundary::history() const {
  const State& s = *state_;
  std::vector<std::uint8_t> bytes;
  for (const auto& of : s.topology.ghosts.of) {
    std::vector<GhostPoint> ghosts;
    for (const std::int32_t point : of) {
      ghosts.push_back(point >= 0 ? s.topology.ghosts.point[static_cast<std::size_t>(point)]
                                  : GhostPoint{});
    }
    append_bytes(bytes, std::span<const GhostPoint>(ghosts));
  }
  for (std::size_t b = 0; b < s.bodies.size(); ++b)
    append_bytes(bytes, std::span<const double>(s.bodies[b].searched));
  return bytes;
}

std::vector<std::uint8_t> ImmersedBoundary::whole_history() const {
  const State& s = *state_;
  if (!s.far) return history();
  const Ranks& ranks = s.far->ranks();
  std::vector<std::uint8_t> bytes;
  for (int axis = 0; axis < 3; ++axis) {
    const auto& walls = s.topology.cut.walls[axis];
    std::vector<GhostPoint> mine;
    for (std::size_t w = 0; w < walls.size(); ++w) {
      if (!s.far->near_own(end_node(s.grid, axis, walls[w]), 0)) continue;
      for (std::size_t g = w * n_ghost; g < (w + 1) * n_ghost; ++g)
        mine.push_back(s.topology.ghost(axis, g));
    }
    const auto parts = ranks.gather(std::span<const GhostPoint>(mine));
    if (!ranks.root()) continue;
    std::vector<std::size_t> next(parts.size(), 0);
    std::vector<GhostPoint> all;
    for (const WallEnd& wall : walls) {
      const auto r = static_cast<std::size_t>(s.far->owner(end_node(s.grid, axis, wall)));
      const auto first = parts[r].begin() + static_cast<std::ptrdiff_t>(next[r]);
      all.insert(all.end(), first, first + n_ghost);
      next[r] += n_ghost;
    }
    append_bytes(bytes, std::span<const GhostPoint>(all));
  }
  for (std::size_t b = 0; ranks.root() && b < s.bodies.size(); ++b)
    append_bytes(bytes, std::span<const double>(s.bodies[b].searched));
  return bytes;
}

void ImmersedBoundary::restore_history(std::span<const std::uint8_t> bytes) {
  State& s = *state_;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    take_bytes(bytes, std::span<GhostPoint>(s.topology.searched[axis]));
    std::fill(s.topology.kept[axis].begin(), s.topology.kept[axis].end(), -1);
  }
  for (std::size_t b = 0; b < s.bodies.size(); ++b)
    take_bytes(bytes, std::span<double>(s.bodies[b].searched));
  if (!bytes.empty()) throw CaseError(history_misfit);
  arrange_ghosts(s.grid, s.bodies, s.nodes(), s.far.get(), s.last, s.topology);
}

std::span<const double> ImmersedBoundary::position(std::size_t b) const {
  return state_->bodies[b].position;
}
std::span<const double> ImmersedBoundary::acceleration(std::size_t b) const {
  return state_->bodies[b].acceleration;
}
std::span<const double> ImmersedBoundary::velocity(std::size_t b) const {
  return state_->bodies[b].velocity;
}

}  // namespace ocublast::flow
