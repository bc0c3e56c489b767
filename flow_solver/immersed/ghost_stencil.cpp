// Ghost states of Mittal et al. (2008), doi:10.1016/j.jcp.2008.01.028: image of the ghost in the
// wall, multilinear interpolation there, wall condition half-way. Different here: the ghost belongs
// to a wall end, corners behind the wall are left out, the weights of the rest renormalised; the
// interpolated state then stands for the weighted mean place of its corners, whose distance from
// the wall enters the wall condition in place of the image's.
#include "flow_solver/immersed/ghost_stencil.hpp"

#include <algorithm>
#include <cmath>

namespace ocublast::flow {
namespace {

/// Deeper ghosts take the image at this depth (spacings): a fourth-layer ghost square to the wall
/// is at most 4 deep; beyond, the image would need nodes that share nothing with the wall.
constexpr double deepest_image = 3.45;
/// Least share of weight on usable nodes before the image is moved.
constexpr double least_share = 0.05;
constexpr double move_out = 0.35;  // spacings
constexpr int most_moves = 6;
constexpr std::array<double, 3> move_in = {0.8, 0.5, 0.3};
/// A node this far (spacings) behind the plane still counts as in front: rounding of the foot.
constexpr double plane_slack = 1e-9;
/// Corners below this weight are left out: nothing is gained by reading them.
constexpr double least_weight = 1e-13;
/// Bounds of a ghost's pressure and temperature as multiples of the image's.
constexpr double lowest_ratio = 0.3;
/// Largest pressure difference by the turning of the stream along the wall, of the image's
/// pressure: at supersonic speed behind a body the unlimited term feeds oscillations (measured at
/// Mach 3).
constexpr double largest_turning = 0.1;
/// Largest ratio of a ghost's depth to its image's distance in the wall condition; beyond it the
/// odd part stays constant. Reached neither by the limited image (4 / 3.45) nor by a wall that
/// moves on under an image within a step.
constexpr double farthest_reach = 1.25;
constexpr double highest_ratio = 3.0;

constexpr std::array<std::array<int, 3>, 6> walk_orders = {
    {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}}};

/// Acceleration [m/s^2] towards a wall of gas that follows its curvature: u_t . grad n . u_t.
double turning_acceleration(const Foot& foot, const Vec3& relative) {
  const Vec3 t = relative - dot(relative, foot.normal) * foot.normal;
  const auto& k = foot.curvature;
  return k[0] * t[0] * t[0] + k[1] * t[1] * t[1] + k[2] * t[2] * t[2] +
         2.0 * (k[3] * t[0] * t[1] + k[4] * t[1] * t[2] + k[5] * t[2] * t[0]);
}

/// ratio^power; near one by its series (relative error below 1e-6), which saves the power function.
double isentropic_ratio(double ratio, double power) {
  const double x = ratio - 1.0;
  constexpr double near = 0.02;
  if (std::abs(x) > near) return std::pow(ratio, power);
  return 1.0 + power * x * (1.0 + 0.5 * (power - 1.0) * x * (1.0 + (power - 2.0) / 3.0 * x));
}

int cell_along(const Axis& axis, double x) {
  if (!axis.present) return 0;
  const int low = -n_ghost;
  const int high = axis.n + n_ghost - 2;
  const double guess = (x - axis.min) / (axis.max - axis.min) * axis.n - 0.5;
  const int i = static_cast<int>(std::clamp(std::floor(guess), double(low), double(high)));
  if (axis.x(i) <= x && x < axis.x(i + 1)) return i;  // right away on a uniform grid
  const auto above = std::upper_bound(axis.node.begin(), axis.node.end(), x);
  return std::clamp(static_cast<int>(above - axis.node.begin()) - 1 - n_ghost, low, high);
}

}  // namespace

NodeIndex FluidNodes::cell(const Vec3& x) const {
  return {cell_along(grid_.axis[0], x[0]), cell_along(grid_.axis[1], x[1]),
          cell_along(grid_.axis[2], x[2])};
}

NodeIndex FluidNodes::cell_inside(const Vec3& x) const {
  NodeIndex node = cell(x);
  for (std::size_t a = 0; a < 3; ++a) node[a] = std::clamp(node[a], 0, grid_.axis[a].n - 1);
  return node;
}

Vec3 FluidNodes::place(const NodeIndex& node) const {
  return {{grid_.axis[0].x(node[0]), grid_.axis[1].x(node[1]), grid_.axis[2].x(node[2])}};
}

double FluidNodes::spacing(const Vec3& normal, const NodeIndex& node) const {
  double per_spacing2 = 0.0;
  for (int a = 0; a < 3; ++a) {
    const Axis& axis = grid_.axis[static_cast<std::size_t>(a)];
    if (!axis.present) continue;
    const double share = normal[a] / axis.h(node[static_cast<std::size_t>(a)]);
    per_spacing2 += share * share;
  }
  return 1.0 / std::sqrt(per_spacing2);
}

/// Replaces a node beyond the domain's face by the one its value comes from.
bool FluidNodes::mirrored(NodeIndex& node) const {
  for (std::size_t a = 0; a < 3; ++a) {
    const int n = grid_.axis[a].n;
    if (node[a] < 0) node[a] = -1 - node[a];
    if (node[a] >= n) node[a] = 2 * n - 1 - node[a];
    if (node[a] < 0 || node[a] >= n) return false;
  }
  return true;
}

bool FluidNodes::visible(const NodeIndex& from, const NodeIndex& to) const {
  if (from == to) return true;
  const std::array<std::ptrdiff_t, 3> stride = {
      1, grid_.axis[0].n, static_cast<std::ptrdiff_t>(grid_.axis[0].n) * grid_.axis[1].n};
  for (const auto& order : walk_orders) {
    auto at = static_cast<std::ptrdiff_t>(offset(from));
    bool clear = true;
    for (const int a : order) {
      const int steps = to[static_cast<std::size_t>(a)] - from[static_cast<std::size_t>(a)];
      const std::ptrdiff_t step = steps > 0 ? stride[a] : -stride[a];
      for (int s = 0; s != std::abs(steps) && clear; ++s) {
        const std::ptrdiff_t lower = steps > 0 ? at : at + step;
        at += step;
        clear = tag_[at] == tag_fluid && (thin_cut_[lower] >> a & 1U) == 0;
      }
      if (!clear) break;
    }
    if (clear) return true;
  }
  return false;
}

bool FluidNodes::usable(const NodeIndex& node, const Vec3& point, const Vec3& normal,
                        const NodeIndex* from) const {
  NodeIndex source = node;
  if (!mirrored(source) || !is_fluid(source)) return false;
  const double slack = -plane_slack * grid_.axis[0].h(source[0]);
  if (dot(place(node) - point, normal) < slack) return false;
  if (source != node && dot(place(source) - point, normal) < slack) return false;
  return from == nullptr || visible(*from, source);
}

bool FluidNodes::nearest_in_front(const Vec3& x, const Vec3& point, const Vec3& normal,
                                  NodeIndex& node) const {
  const NodeIndex base = cell(x);
  double nearest = HUGE_VAL;
  for (unsigned corner = 0; corner < 8; ++corner) {
    NodeIndex at = base;
    for (std::size_t a = 0; a < 3; ++a) {
      at[a] += grid_.axis[a].present ? static_cast<int>(corner >> a & 1U) : 0;
    }
    NodeIndex source = at;
    if (!mirrored(source) || source != at || !is_fluid(at)) continue;
    const double distance = dot(place(at) - point, normal);
    if (distance < 0.0 || distance >= nearest) continue;
    nearest = distance;
    node = at;
  }
  return nearest < HUGE_VAL;
}

double FluidNodes::weigh(const Vec3& x, const Vec3& point, const Vec3& normal,
                         const NodeIndex* from, double least, Stencil& stencil) const {
  Stencil found;
  found.built_depth = stencil.built_depth;
  found.base = cell(x);
  std::array<double, 3> upper{};
  for (std::size_t a = 0; a < 3; ++a) {
    const Axis& axis = grid_.axis[a];
    if (!axis.present) continue;
    const double low = axis.x(found.base[a]);
    upper[a] = (x.c[a] - low) / (axis.x(found.base[a] + 1) - low);
    // Outside the ghosts of the domain: the outermost cell's edge.
    upper[a] = std::clamp(upper[a], 0.0, 1.0);
  }
  double share = 0.0;
  found.all_seen = true;
  for (unsigned corner = 0; corner < 8; ++corner) {
    NodeIndex node = found.base;
    double weight = 1.0;
    for (std::size_t a = 0; a < 3; ++a) {
      const bool high = (corner >> a & 1U) != 0;
      weight *= high ? upper[a] : 1.0 - upper[a];
      node[a] += high ? 1 : 0;
    }
    if (weight < least_weight || !usable(node, point, normal, nullptr)) continue;
    NodeIndex source = node;
    if (from != nullptr && mirrored(source) && !visible(*from, source)) {
      found.all_seen = false;
      continue;
    }
    found.weight[corner] = weight;
    found.place = found.place + weight * place(node);
    share += weight;
  }
  if (share < least || share <= 0.0) return share;
  for (double& weight : found.weight) weight /= share;
  found.place = (1.0 / share) * found.place;
  found.distance = dot(found.place - point, normal);
  stencil = found;
  return share;
}

bool FluidNodes::sees_alike(const Stencil& stencil, const NodeIndex& from,
                            const NodeIndex& other) const {
  if (!stencil.all_seen) return false;
  // The spacing at the end node, at least its smallest along an axis, bounds deep images only.
  for (std::size_t a = 0; a < 3; ++a) {
    const Axis& axis = grid_.axis[a];
    if (axis.present &&
        stencil.built_depth >= deepest_image * std::min(axis.h(from[a]), axis.h(other[a])))
      return false;
  }
  for (unsigned corner = 0; corner < 8; ++corner) {
    if (stencil.weight[corner] == 0.0) continue;
    NodeIndex node = {stencil.base[0] + static_cast<int>(corner & 1U),
                      stencil.base[1] + static_cast<int>(corner >> 1 & 1U),
                      stencil.base[2] + static_cast<int>(corner >> 2)};
    if (!mirrored(node) || !visible(other, node)) return false;
  }
  return true;
}

bool FluidNodes::holds(const Stencil& stencil) const {
  if (stencil.own_state) return false;
  for (unsigned corner = 0; corner < 8; ++corner) {
    if (stencil.weight[corner] == 0.0) continue;
    NodeIndex node = {stencil.base[0] + static_cast<int>(corner & 1U),
                      stencil.base[1] + static_cast<int>(corner >> 1 & 1U),
                      stencil.base[2] + static_cast<int>(corner >> 2)};
    if (!mirrored(node) || !is_fluid(node)) return false;
  }
  return true;
}

Stencil FluidNodes::image(const Foot& foot, const NodeIndex& end_node) const {
  const double h = spacing(foot.normal, end_node);
  const double depth = std::clamp(foot.depth, 0.0, deepest_image * h);
  Stencil stencil;
  stencil.built_depth = foot.depth;
  const auto reached = [&](double d) {
    return weigh(foot.point + d * foot.normal, foot.point, foot.normal, &end_node, least_share,
                 stencil) >= least_share;
  };
  for (int n = 0; n <= most_moves; ++n) {
    if (!reached(depth + move_out * h * n)) continue;
    stencil.all_seen = stencil.all_seen && n == 0;
    return stencil;
  }
  for (const double share : move_in) {
    if (!reached(share * depth)) continue;
    stencil.all_seen = false;
    return stencil;
  }
  stencil.base = end_node;
  stencil.weight[0] = 1.0;
  stencil.place = place(end_node);
  stencil.distance = dot(stencil.place - foot.point, foot.normal);
  stencil.own_state = true;
  return stencil;
}

double pressure_towards_wall(const Foot& foot, const Sample& sample, const WallState& wall,
                             double apart, const Gas& gas) noexcept {
  const double rho = density(gas, sample.p, sample.T);
  const double turning =
      std::clamp(rho * turning_acceleration(foot, sample.u - wall.velocity) * apart,
                 -largest_turning * sample.p, largest_turning * sample.p);
  return std::clamp(sample.p + rho * wall.acceleration * apart - turning, lowest_ratio * sample.p,
                    highest_ratio * sample.p);
}

std::array<double, n_primitive> ghost_state(const Foot& foot, const Stencil& stencil,
                                            const Sample& image, const WallState& wall,
                                            const Gas& gas) noexcept {
  const double reach = stencil.distance > 0.0
                           ? std::clamp(foot.depth / stencil.distance, -1.0, farthest_reach)
                           : 1.0;
  const Vec3 relative = image.u - wall.velocity;
  const Vec3 u = wall.slip == WallSlip::no_slip
                     ? wall.velocity - reach * relative
                     : image.u - (1.0 + reach) * dot(relative, foot.normal) * foot.normal;
  const double p = pressure_towards_wall(foot, image, wall, stencil.distance + foot.depth, gas);
  double T = image.T;
  if (wall.temperature > 0.0) {
    T = std::clamp(wall.temperature - reach * (image.T - wall.temperature), lowest_ratio * image.T,
                   highest_ratio * image.T);
  } else if (p != image.p) {
    // Entropy, not temperature, is even about an adiabatic wall with a pressure slope.
    T *= isentropic_ratio(p / image.p, 1.0 - 1.0 / gas.heat_capacity_ratio);
  }
  return {density(gas, p, T), u[0], u[1], u[2], T};
}

}  // namespace ocublast::flow
