#include "flow_solver/immersed/wall_fit.hpp"

#include <algorithm>
#include <cmath>

namespace ocublast::flow {
namespace {

/// Spacings. Half a ball of this radius holds 6 to 12 nodes, half a disc 3 to 5. At 1.5 spikes on a moving
/// cylinder are larger by half, at 2.0 smaller by a fifth, but the wall misses more of the curvature of
/// the pressure along the normal: 1.5e-4 instead of 1.35e-4 at a swinging piston on 100 cells.
constexpr double reach = 1.75;
/// A node counts in full from this distance on (spacings): several steps after it came out of the wall.
constexpr double full_from = 0.5;
/// Least sum of weights: one node half-way to the rim has 0.56.
constexpr double least_sum = 0.05;
/// Least spread of the nodes along the wall (variance, spacings^2) for a slope to be taken from them. A
/// half-disc has 0.3; below, the slope is damped.
constexpr double least_spread = 0.05;

/// Directions along a wall. Where a direction of space is absent, there is none along it.
struct Tangents {
  std::array<Vec3, 2> t;
  std::array<bool, 2> present{};
};

Tangents tangents_of(const Grid& grid, const Vec3& normal) {
  std::size_t seed = 0;
  for (std::size_t a = 0; a < 3; ++a) {
    if (std::abs(normal.c[a]) < std::abs(normal.c[seed])) seed = a;
  }
  for (std::size_t a = 0; a < 3; ++a) {
    if (!grid.axis[a].present) seed = a;
  }
  Vec3 along{};
  along.c[seed] = 1.0;
  Tangents tangents;
  tangents.t[1] = unit(along - dot(along, normal) * normal);
  tangents.t[0] = cross(tangents.t[1], normal);
  for (std::size_t d = 0; d < 2; ++d) {
    double in_space2 = 0.0;
    for (std::size_t a = 0; a < 3; ++a) {
      if (grid.axis[a].present) in_space2 += tangents.t[d].c[a] * tangents.t[d].c[a];
    }
    tangents.present[d] = in_space2 > 0.5;
  }
  return tangents;
}

/// Sums over the nodes of weight times 1, a, b, aa, ab, bb (places along the wall, spacings).
struct Moments {
  double one = 0.0, a = 0.0, b = 0.0, aa = 0.0, ab = 0.0, bb = 0.0;
};

/// Slopes c of the factor 1 - c_a a - c_b b that makes the first moments vanish.
std::array<double, 2> balance(const Moments& m, const std::array<bool, 2>& present) {
  const double mean_a = m.a / m.one, mean_b = m.b / m.one;
  double aa = m.aa / m.one, ab = m.ab / m.one, bb = m.bb / m.one;
  const double var_a = aa - mean_a * mean_a, var_b = bb - mean_b * mean_b, cov = ab - mean_a * mean_b;
  double least = std::min(present[0] ? var_a : HUGE_VAL, present[1] ? var_b : HUGE_VAL);
  if (present[0] && present[1]) {
    least = 0.5 * (var_a + var_b) - std::sqrt(0.25 * (var_a - var_b) * (var_a - var_b) + cov * cov);
  }
  const double damping = std::max(0.0, least_spread - least);
  aa = present[0] ? aa + damping : 1.0;
  bb = present[1] ? bb + damping : 1.0;
  const double determinant = aa * bb - ab * ab;
  return {(bb * mean_a - ab * mean_b) / determinant, (aa * mean_b - ab * mean_a) / determinant};
}

}  // namespace

WallFit fit_at_wall(const FluidNodes& nodes, const Vec3& point, const Vec3& normal,
                    const NodeIndex* from) {
  const Grid& grid = nodes.grid();
  const NodeIndex base = nodes.cell(point);
  const Tangents along = tangents_of(grid, normal);
  const double h = nodes.spacing(normal, nodes.cell_inside(point));
  NodeIndex low = base, high = base;
  std::array<double, 3> spacing{};
  for (std::size_t a = 0; a < 3; ++a) {
    const Axis& axis = grid.axis[a];
    if (!axis.present) continue;
    spacing[a] = axis.x(base[a] + 1) - axis.x(base[a]);
    low[a] = std::max(base[a] - 1, -n_ghost);
    high[a] = std::min(base[a] + 2, axis.n + n_ghost - 1);
  }
  WallFit fit;
  Moments m;
  std::array<double, 64> a{}, b{};
  NodeIndex node{};
  for (node[2] = low[2]; node[2] <= high[2]; ++node[2]) {
    for (node[1] = low[1]; node[1] <= high[1]; ++node[1]) {
      for (node[0] = low[0]; node[0] <= high[0]; ++node[0]) {
        Vec3 away;
        double r2 = 0.0;
        for (std::size_t d = 0; d < 3; ++d) {
          if (!grid.axis[d].present) continue;
          away.c[d] = grid.axis[d].x(node[d]) - point.c[d];
          r2 += away.c[d] * away.c[d] / (spacing[d] * spacing[d]);
        }
        const double distance = dot(away, normal);
        const double rim = 1.0 - r2 / (reach * reach);
        if (rim <= 0.0 || distance <= 0.0 || !nodes.usable(node, point, normal, from)) continue;
        const double weight = rim * rim * std::min(1.0, distance / (full_from * h));
        const auto i = static_cast<std::size_t>(fit.n++);
        fit.node[i] = {node, weight, distance};
        a[i] = dot(away, along.t[0]) / h;
        b[i] = dot(away, along.t[1]) / h;
        m.one += weight;
        m.a += weight * a[i];
        m.b += weight * b[i];
        m.aa += weight * a[i] * a[i];
        m.ab += weight * a[i] * b[i];
        m.bb += weight * b[i] * b[i];
      }
    }
  }
  if (m.one < least_sum) return {};
  const auto c = balance(m, along.present);
  const double sum = m.one - c[0] * m.a - c[1] * m.b;
  for (std::size_t i = 0; i < static_cast<std::size_t>(fit.n); ++i) {
    fit.node[i].weight *= (1.0 - c[0] * a[i] - c[1] * b[i]) / sum;
  }
  return fit;
}

}  // namespace ocublast::flow
