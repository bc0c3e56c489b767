#include "flow_solver/immersed/surface_readout.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <type_traits>

#include "flow_solver/immersed/wall_fit.hpp"

namespace ocublast::flow::inline OCU_PRECISION {
namespace {

/// Least share of usable weight in an interpolation, as for the ghosts.
constexpr double least_share = 0.05;
/// Steps of the probe along the normal where no node around the point is usable, in spacings.
constexpr double probe_step = 0.5;
constexpr int most_probe_steps = 6;
/// Nodes searched around a point without gas in front: 6 each way.
constexpr int widest_search = 6;
/// A facet whose normal has less than this in the present directions closes an extruded body.
constexpr double cap_share = 1e-3;

/// The place that is read.
struct Wall {
  Foot foot;
  WallState state;
};

/// Pressure at the wall and what else a load needs of the gas there.
struct Reading {
  double p = 0.0;
  double impedance = 0.0;
  double added_mass = 0.0;
  bool found = false;
  /// `beside`: what adds to the pressure of the sample, Pa: momentum that goes through its place,
  /// curvature.
  void take(const Sample& s, double beside, double distance, const Wall& wall, const Gas& gas) {
    p = pressure_towards_wall(wall.foot, s, wall.state, distance, gas) + beside;
    const double rho = density(gas, s.p, s.T);
    impedance = rho * sound_speed(gas, s.T);
    added_mass = rho * distance;
    found = true;
  }
};

class Reader {
 public:
  Reader(const FluidNodes& nodes, const GasNodes& W, const Gas& gas)
      : nodes_(nodes), W_(W), gas_(gas) {}

  [[nodiscard]] Reading at(const Wall& wall) const {
    const Vec3& point = wall.foot.point;
    const Vec3& normal = wall.foot.normal;
    Reading reading = around(wall);
    if (reading.found) return reading;
    const double h = nodes_.spacing(normal, inside(nodes_.cell(point)));
    for (int n = 1; n <= most_probe_steps; ++n) {
      Stencil s;
      const Vec3 probe = point + n * probe_step * h * normal;
      if (nodes_.weigh(probe, point, normal, nullptr, least_share, s) < least_share) continue;
      take(s, s.distance, wall, reading);
      return reading;
    }
    return nearest(wall);
  }

 private:
  void take(const Stencil& stencil, double distance, const Wall& wall, Reading& reading) const {
    reading.take(sample(stencil, W_, gas_),
                 momentum_transport(stencil, W_, wall.state.velocity, wall.foot.normal, gas_),
                 distance, wall, gas_);
  }

  /// Fitted to the nodes in front of the wall, each one's value taken to it.
  [[nodiscard]] Reading around(const Wall& wall) const {
    const Vec3& point = wall.foot.point;
    const Vec3& normal = wall.foot.normal;
    NodeIndex nearest_node{};
    const NodeIndex* from =
        nodes_.narrow_gaps() && nodes_.nearest_in_front(point, point, normal, nearest_node)
            ? &nearest_node
            : nullptr;
    const WallFit fit = fit_at_wall(nodes_, point, normal, from);
    Reading reading;
    if (fit.n == 0) return reading;
    const FitSample s = sample(fit, W_, wall.state.velocity, normal, gas_);
    reading.take(s.gas, s.beside, s.distance, wall, gas_);
    return reading;
  }

  [[nodiscard]] NodeIndex inside(NodeIndex node) const {
    for (std::size_t a = 0; a < 3; ++a) {
      node[a] = std::clamp(node[a], 0, nodes_.grid().axis[a].n - 1);
    }
    return node;
  }

  /// Nearest fluid node, one in front of the wall before all others.
  [[nodiscard]] Reading nearest(const Wall& wall) const {
    const Vec3& point = wall.foot.point;
    const Vec3& normal = wall.foot.normal;
    const NodeIndex centre = inside(nodes_.cell(point));
    double best2[2] = {HUGE_VAL, HUGE_VAL};  // behind, in front
    NodeIndex best[2] = {centre, centre};
    const NodeIndex low =
        inside({centre[0] - widest_search, centre[1] - widest_search, centre[2] - widest_search});
    const NodeIndex high =
        inside({centre[0] + widest_search, centre[1] + widest_search, centre[2] + widest_search});
    NodeIndex node{};
    for (node[2] = low[2]; node[2] <= high[2]; ++node[2]) {
      for (node[1] = low[1]; node[1] <= high[1]; ++node[1]) {
        for (node[0] = low[0]; node[0] <= high[0]; ++node[0]) {
          if (!nodes_.is_fluid(node)) continue;
          const Vec3 away = nodes_.place(node) - point;
          const std::size_t in_front = dot(away, normal) > 0.0 ? 1 : 0;
          if (norm2(away) >= best2[in_front]) continue;
          best2[in_front] = norm2(away);
          best[in_front] = node;
        }
      }
    }
    const std::size_t taken = best2[1] < HUGE_VAL ? 1 : 0;
    Reading reading;
    if (best2[taken] == HUGE_VAL) return reading;
    Stencil s{.base = best[taken]};
    s.weight[0] = 1.0;
    take(s, 0.0, wall, reading);
    return reading;
  }

  const FluidNodes& nodes_;
  const GasNodes& W_;
  const Gas& gas_;
};

bool is_cap(const Grid& grid, const Vec3& normal) {
  double present2 = 0.0;
  for (int a = 0; a < 3; ++a) {
    if (grid.axis[static_cast<std::size_t>(a)].present) present2 += normal[a] * normal[a];
  }
  return present2 < cap_share * cap_share;
}

bool in_grid(const Grid& grid, const Vec3& x) {
  for (int a = 0; a < 3; ++a) {
    const Axis& axis = grid.axis[static_cast<std::size_t>(a)];
    if (axis.present && (x[a] < axis.min || x[a] > axis.max)) return false;
  }
  return true;
}

/// Barycentric middles of the 4^level similar triangles of a facet.
std::vector<std::array<double, 3>> middles_of_parts(int level) {
  const int n = 1 << level;
  std::vector<std::array<double, 3>> parts;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n - i; ++j) {
      const auto add = [&](double third) {
        const double u = (i + third) / n, v = (j + third) / n;
        parts.push_back({u, v, 1.0 - u - v});
      };
      add(1.0 / 3.0);
      if (j < n - i - 1) add(2.0 / 3.0);
    }
  }
  return parts;
}

/// Exposed share and middle of the exposed part: from the four similar triangles of a facet, from
/// sixteen where another body may cut it.
class Exposure {
 public:
  Exposure(const Grid& grid, const Bodies& bodies, std::size_t b)
      : grid_(grid), bodies_(bodies), b_(static_cast<std::int32_t>(b)) {}

  void find(std::int32_t f, FacetReading& reading) const {
    if (!sum(f, coarse_, reading) || reading.exposed == 1.0) return;
    sum(f, fine_, reading);
  }

 private:
  /// Whether any part is exposed.
  bool sum(std::int32_t f, const std::vector<std::array<double, 3>>& parts,
           FacetReading& reading) const {
    const BodyState& s = bodies_[static_cast<std::size_t>(b_)];
    const Corners& v = s.topology.facet[f];
    const Vec3 x[3] = {s.vertex(v[0]), s.vertex(v[1]), s.vertex(v[2])};
    const SurfaceTopology::QuadHalf& half = s.topology.quad_half[static_cast<std::size_t>(f)];
    const auto end_1 = static_cast<std::size_t>(half.apex + 1) % 3,
               end_2 = static_cast<std::size_t>(half.apex + 2) % 3;
    // Two barycentric coordinates have the covariance -1/36 over a triangle, over one of n similar
    // parts -1/(36 n).
    const double covariance = 1.0 / (36.0 * static_cast<double>(parts.size()));
    reading.weight = {};
    reading.twist = 0.0;
    int n = 0;
    for (const auto& w : parts) {
      const Vec3 point = w[0] * x[0] + w[1] * x[1] + w[2] * x[2];
      if (!in_grid(grid_, point) || is_covered(bodies_, b_, f, point)) continue;
      for (std::size_t c = 0; c < 3; ++c) reading.weight[c] += w[c];
      reading.twist += w[end_1] * w[end_2] - covariance;
      ++n;
    }
    reading.exposed = static_cast<double>(n) / static_cast<double>(parts.size());
    for (double& w : reading.weight) w = n > 0 ? w / n : 1.0 / 3.0;
    reading.twist = half.fourth < 0 || n == 0 ? 0.0 : reading.twist / n;
    reading.point = reading.weight[0] * x[0] + reading.weight[1] * x[1] + reading.weight[2] * x[2];
    return n > 0;
  }

  const Grid& grid_;
  const Bodies& bodies_;
  std::int32_t b_;
  std::vector<std::array<double, 3>> coarse_ = middles_of_parts(1);
  std::vector<std::array<double, 3>> fine_ = middles_of_parts(2);
};

/// Least distance of the first probe, spacings: nearer, its difference from the wall is rounding of
/// the interpolation.
constexpr double shear_probe = 1.0;

double viscosity(const WallTransport& t, double T) {
  if (t.sutherland_reference <= 0.0) return t.viscosity;
  const double r = T / t.sutherland_reference;
  return t.viscosity * r * std::sqrt(r) * (t.sutherland_reference + t.sutherland_temperature) /
         (T + t.sutherland_temperature);
}

/// Slope at the wall of the parabola through 0 at 0, f1 at d1, f2 at d2.
template <class Value>
Value wall_slope(const Value& f1, double d1, const Value& f2, double d2) {
  return (d2 / (d1 * (d2 - d1))) * f1 - (d1 / (d2 * (d2 - d1))) * f2;
}

/// Tangential part of grad u . n at a wall without slip: how its own normal velocity varies along
/// it. Belongs to the stress of a turning or deforming wall beside the slope of the gas's velocity.
Vec3 wall_gradient(const BodyState& s, std::int32_t f) {
  const Corners& v = s.topology.facet[f];
  const Vec3& normal = s.geometry.normal[f];
  Vec3 sum;
  for (std::size_t c = 0; c < 3; ++c) {
    const Vec3 opposite = s.vertex(v[(c + 2) % 3]) - s.vertex(v[(c + 1) % 3]);
    const double u_n = dot(row(s.velocity, v[c]), normal);
    sum = sum + (0.5 * u_n / s.geometry.area[f]) * cross(normal, opposite);
  }
  return sum;
}

/// Shear traction and heat flux at a facet, where gas lies within two spacings in front of it.
void read_friction(const ReadOut& read, const BodyState& s, const Wall& wall,
                   FacetReading& reading) {
  const Vec3& point = wall.foot.point;
  const Vec3& normal = wall.foot.normal;
  const double h = read.nodes.spacing(normal, read.nodes.cell_inside(point));
  const auto probe = [&](double distance, Stencil& stencil) {
    return read.nodes.weigh(point + distance * normal, point, normal, nullptr, least_share,
                            stencil) >= least_share;
  };
  Stencil near, far;
  if (!probe(shear_probe * h, near) || near.distance <= 0.0) return;
  const Sample first = sample(near, read.W, read.gas);
  const auto along_wall = [&](const Sample& at) {
    const Vec3 relative = at.u - wall.state.velocity;
    return relative - dot(relative, normal) * normal;
  };
  Vec3 slope = (1.0 / near.distance) * along_wall(first);
  const double T_wall = s.body.wall_temperature;
  double heat_slope = T_wall > 0.0 ? (first.T - T_wall) / near.distance : 0.0;
  if (probe(2.0 * shear_probe * h, far) && far.distance > 1.5 * near.distance) {
    const Sample second = sample(far, read.W, read.gas);
    slope = wall_slope(along_wall(first), near.distance, along_wall(second), far.distance);
    if (T_wall > 0.0) {
      heat_slope = wall_slope(first.T - T_wall, near.distance, second.T - T_wall, far.distance);
    }
  }
  const double mu = viscosity(read.transport, T_wall > 0.0 ? T_wall : first.T);
  const double cp =
      read.gas.gas_constant * read.gas.heat_capacity_ratio / (read.gas.heat_capacity_ratio - 1.0);
  if (!s.at_rest) slope = slope + wall_gradient(s, wall.foot.facet);
  reading.shear = mu * slope;
  reading.heat = mu * cp / read.transport.prandtl * heat_slope;
}

/// Node next to the middle of a facet, which says who reads it.
NodeIndex middle_cell(const FluidNodes& nodes, const BodyState& s, std::int32_t f) {
  const Corners& v = s.topology.facet[f];
  return nodes.cell_inside((1.0 / 3.0) * (s.vertex(v[0]) + s.vertex(v[1]) + s.vertex(v[2])));
}

/// Gives every rank the readings of all: each rank has read the facets in its block, and every rank
/// knows which those are.
void share_readings(const ReadOut& read, const BodyState& s, std::vector<FacetReading>& facets) {
  static_assert(std::is_trivially_copyable_v<FacetReading>);
  const FarNodes& far = *read.W.far;
  const Ranks& ranks = far.ranks();
  std::vector<std::vector<std::int32_t>> of_rank(static_cast<std::size_t>(ranks.size()));
  for (std::int32_t f = 0; f < static_cast<std::int32_t>(facets.size()); ++f)
    of_rank.at(static_cast<std::size_t>(far.owner(middle_cell(read.nodes, s, f)))).push_back(f);
  for (int from = 0; from < ranks.size(); ++from) {
    const auto& list = of_rank[static_cast<std::size_t>(from)];
    if (list.empty()) continue;
    std::vector<FacetReading> part;
    for (const std::int32_t f : list) part.push_back(facets[static_cast<std::size_t>(f)]);
    ranks.broadcast(std::span<FacetReading>(part), from);
    for (std::size_t n = 0; n < list.size(); ++n)
      facets[static_cast<std::size_t>(list[n])] = part[n];
  }
}

}  // namespace

std::vector<FacetReading> read_facets(const ReadOut& read, std::size_t b, double ambient_pressure) {
  const BodyState& s = read.bodies[b];
  const Grid& grid = read.nodes.grid();
  const Reader reader(read.nodes, read.W, read.gas);
  const bool friction = read.transport.viscosity > 0.0 && s.body.slip == WallSlip::no_slip;
  const Exposure exposure(grid, read.bodies, b);
  std::vector<FacetReading> facets(s.n_facets());
  const FarNodes* far = read.W.far;
  const auto is_own = [&](std::int32_t f) {
    return far == nullptr || far->near_own(middle_cell(read.nodes, s, f), 0);
  };
  const auto n = static_cast<std::int32_t>(s.n_facets());
#pragma omp parallel for schedule(dynamic, 64) if (n > 500)
  for (std::int32_t f = 0; f < n; ++f) {
    FacetReading& reading = facets[f];
    const Vec3& normal = s.geometry.normal[f];
    if (s.buried[f] != 0 || is_cap(grid, normal) || !is_own(f)) continue;
    exposure.find(f, reading);
    if (reading.exposed == 0.0) continue;
    Wall wall{.foot = foot_on_facet(s, f, reading.point)};
    if (!s.at_rest) {
      wall.state.velocity = at_foot(s, wall.foot, s.velocity);
      wall.state.acceleration = dot(at_foot(s, wall.foot, s.acceleration), normal);
    }
    const Reading found = reader.at(wall);
    if (!found.found) {
      reading.exposed = 0.0;  // no gas within reach at all
      continue;
    }
    reading.overpressure = found.p - ambient_pressure;
    reading.impedance = found.impedance;
    reading.added_mass = found.added_mass;
    if (friction) read_friction(read, s, wall, reading);
  }
  if (far != nullptr) share_readings(read, s, facets);
  return facets;
}

LoadShares load_shares(const SurfaceTopology& topology, std::size_t f,
                       const FacetReading& reading) {
  const Corners& v = topology.facet[f];
  const SurfaceTopology::QuadHalf& half = topology.quad_half[f];
  LoadShares shares{
      .vertex = {v[0], v[1], v[2], half.fourth},
      .share = {reading.weight[0], reading.weight[1], reading.weight[2], reading.twist},
      .n = half.fourth < 0 ? 3 : 4};
  if (half.fourth < 0) return shares;
  for (std::int32_t c = 0; c < 3; ++c)
    shares.share[static_cast<std::size_t>(c)] += c == half.apex ? reading.twist : -reading.twist;
  return shares;
}

namespace {

/// What a vertex gets from the facets around it.
struct VertexShare {
  Vec3 force;           ///< N, wanted there, along the inward normals with the sign of pressure
  Vec3 shear;           ///< N
  Vec3 normal;          ///< m^2, its share of the area vectors around: force per pressure
  double load = 0.0;    ///< N
  double area = 0.0;    ///< m^2, its share of the areas around
  bool on_rim = false;  ///< some facet around is covered, wholly or in part, and some exposed
};

std::vector<VertexShare> share_out(const Grid& grid, const BodyState& body,
                                   const std::vector<FacetReading>& facets) {
  // Shares of a whole facet: a third each, and 1/12 of a quad's half to the corner it lacks.
  constexpr FacetReading uncovered{.weight = {1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0},
                                   .twist = 1.0 / 12.0};
  std::vector<VertexShare> shares(body.n_vertices());
  std::vector<std::uint8_t> seen(body.n_vertices(), 0);  // bit 0: covered, bit 1: exposed
  for (std::size_t f = 0; f < facets.size(); ++f) {
    const Vec3& n = body.geometry.normal[f];
    if (is_cap(grid, n)) continue;
    const double A = body.geometry.area[f];
    const double exposed = A * facets[f].exposed;
    const double load = exposed * facets[f].overpressure;
    const LoadShares part = load_shares(body.topology, f, facets[f]);
    const LoadShares whole = load_shares(body.topology, f, uncovered);
    for (std::size_t c = 0; c < static_cast<std::size_t>(part.n); ++c) {
      const auto v = static_cast<std::size_t>(part.vertex[c]);
      VertexShare& s = shares[v];
      s.force = s.force + (part.share[c] * load) * n;
      s.shear = s.shear + (part.share[c] * exposed) * facets[f].shear;
      s.load += part.share[c] * load;
      s.normal = s.normal + (whole.share[c] * A) * n;
      s.area += whole.share[c] * A;
      seen[v] = static_cast<std::uint8_t>(seen[v] | (facets[f].exposed < 1.0 ? 1U : 0U) |
                                          (facets[f].exposed > 0.0 ? 2U : 0U));
    }
  }
  for (std::size_t v = 0; v < shares.size(); ++v) shares[v].on_rim = seen[v] == 3;
  return shares;
}

/// Closes the balance of force of a partly covered body: the load of a facet cut by another body is
/// smeared over the facets of its corners, whose normals face elsewhere (second order in facet size
/// times curvature; 1.5 % of the force on a globe of 1500 facets). All pressures change by the same
/// small part along the missing force, so that the work changes as the force does; changing the rim
/// alone would put the force right and the work wrong where the rim bulges.
void balance_force(const std::vector<VertexShare>& shares, std::span<double> p) {
  constexpr double largest_part = 0.05;
  if (std::none_of(shares.begin(), shares.end(), [](const VertexShare& s) { return s.on_rim; }))
    return;
  Eigen::Vector3d missing = Eigen::Vector3d::Zero();
  Eigen::Matrix3d normal_products = Eigen::Matrix3d::Zero();
  for (std::size_t v = 0; v < shares.size(); ++v) {
    const VertexShare& s = shares[v];
    for (int a = 0; a < 3; ++a) missing[a] += s.force[a] - p[v] * s.normal[a];
    if (s.area <= 0.0) continue;
    const Eigen::Vector3d n(s.normal[0], s.normal[1], s.normal[2]);
    normal_products += (std::abs(p[v]) / s.area) * n * n.transpose();
  }
  // Directions in which the pressures cannot push stay as they are.
  const Eigen::Vector3d way = normal_products.completeOrthogonalDecomposition().solve(missing);
  for (std::size_t v = 0; v < shares.size(); ++v) {
    const VertexShare& s = shares[v];
    if (s.area <= 0.0) continue;
    const double part =
        (s.normal[0] * way[0] + s.normal[1] * way[1] + s.normal[2] * way[2]) / s.area;
    p[v] += std::clamp(part, -largest_part, largest_part) * std::abs(p[v]);
  }
}

}  // namespace

void spread_to_vertices(const Grid& grid, const BodyState& body,
                        const std::vector<FacetReading>& facets, std::span<double> at_vertices) {
  // On the rim of a thin body the normals cancel: there the mean of the pressure itself serves.
  constexpr double least_normal = 0.1;
  const std::vector<VertexShare> shares = share_out(grid, body, facets);
  for (std::size_t v = 0; v < shares.size(); ++v) {
    const VertexShare& s = shares[v];
    const bool flat = norm(s.normal) > least_normal * s.area;
    at_vertices[v] = s.area <= 0.0 ? 0.0
                     : flat        ? dot(s.force, s.normal) / norm2(s.normal)
                                   : s.load / s.area;
  }
  balance_force(shares, at_vertices);
}

void spread_forces(const BodyState& body, const std::vector<FacetReading>& facets,
                   std::span<double> at_vertices) {
  std::fill(at_vertices.begin(), at_vertices.end(), 0.0);
  for (std::size_t f = 0; f < facets.size(); ++f) {
    const FacetReading& reading = facets[f];
    if (reading.exposed == 0.0) continue;
    const double area = reading.exposed * body.geometry.area[f];
    const Vec3 force =
        (-reading.overpressure * area) * body.geometry.normal[f] + area * reading.shear;
    const LoadShares part = load_shares(body.topology, f, reading);
    for (std::size_t c = 0; c < static_cast<std::size_t>(part.n); ++c)
      for (std::size_t a = 0; a < 3; ++a)
        at_vertices[3 * static_cast<std::size_t>(part.vertex[c]) + a] += part.share[c] * force.c[a];
  }
}

void spread_shear(const Grid& grid, const BodyState& body, const std::vector<FacetReading>& facets,
                  std::span<double> at_vertices) {
  const std::vector<VertexShare> shares = share_out(grid, body, facets);
  for (std::size_t v = 0; v < shares.size(); ++v) {
    const Vec3 shear = shares[v].area > 0.0 ? (1.0 / shares[v].area) * shares[v].shear : Vec3{};
    std::copy(shear.c.begin(), shear.c.end(),
              at_vertices.begin() + static_cast<std::ptrdiff_t>(3 * v));
  }
}

BodyLoad integrate_load(const BodyState& body, const std::vector<FacetReading>& facets) {
  BodyLoad load;
  for (std::size_t f = 0; f < facets.size(); ++f) {
    const FacetReading& reading = facets[f];
    if (reading.exposed == 0.0) continue;
    const double area = reading.exposed * body.geometry.area[f];
    const Vec3& normal = body.geometry.normal[f];
    const Vec3 shear = area * reading.shear;
    const Vec3 force = (-reading.overpressure * area) * normal + shear;
    const Vec3 moment = cross(reading.point, force);
    const LoadShares part = load_shares(body.topology, f, reading);
    Vec3 velocity;
    for (std::size_t c = 0; c < static_cast<std::size_t>(part.n); ++c)
      velocity = velocity + part.share[c] * row(body.velocity, part.vertex[c]);
    const Vec3 turning = cross(reading.point, normal);
    const std::array<double, 6> g = {normal[0],  normal[1],  normal[2],
                                     turning[0], turning[1], turning[2]};
    for (std::size_t a = 0; a < 3; ++a) {
      load.force[a] += force.c[a];
      load.shear_force[a] += shear.c[a];
      load.moment[a] += moment.c[a];
    }
    for (std::size_t a = 0; a < 6; ++a) {
      for (std::size_t c = 0; c < 6; ++c) {
        load.impedance[6 * a + c] += reading.impedance * area * g[a] * g[c];
        load.added_mass[6 * a + c] += reading.added_mass * area * g[a] * g[c];
      }
    }
    load.power += dot(force, velocity);
    load.heat += area * reading.heat;
    load.volume_rate += area * dot(normal, velocity);
    load.exposed_area += area;
    load.largest_impedance = std::max(load.largest_impedance, reading.impedance);
  }
  return load;
}

}  // namespace ocublast::flow
