#include "flow_solver/immersed/wall_fit.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace ocublast::flow {
namespace {

/// Spacings. Half a ball of this radius holds some 24 nodes, half a disc 8: for 7 and 4 terms.
/// At 2.0 spikes on a moving cylinder are larger by a fifth, at 2.5 peaks along the wall lose a
/// fifth more.
constexpr double reach = 2.25;
/// A node counts in full from this distance on (spacings): many steps after it came out of the
/// wall. At 0.5 the pressure of a moving wall changes a third faster when it passes nodes, and a
/// shock's impulse on a cylinder at 8 cells per radius misses 1.1 % instead of 0.7 %.
constexpr double full_from = 1.0;
/// Weight of the terms of second order themselves beside that of the field's deviations: keeps them
/// from nodes that hardly tell them apart. At 0.1 a peak of half width 2 loses 5.1 % of its height,
/// here 3.3 %.
constexpr double curved_damping = 0.02;
/// Least sum of weights: one node half-way to the rim has 0.56.
constexpr double least_sum = 0.05;
/// Least spread of the nodes along the wall (variance, spacings^2) for a slope to be taken from
/// them. A half-disc has 0.3; below, the slope is damped.
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

/// Terms of the field around a point, places in spacings: 1, along the wall a and b, then of second
/// order aa, ab, bb and dd (d: from the wall).
constexpr int most_terms = 7;
using Terms = Eigen::Matrix<double, most_terms, 1>;
using Normal = Eigen::Matrix<double, most_terms, most_terms>;

/// Least variance of the nodes along the wall, from the lower half of the sums.
double least_variance(const Normal& m, const std::array<bool, 2>& present) {
  const double one = m(0, 0), mean_a = m(1, 0) / one, mean_b = m(2, 0) / one;
  const double a = m(1, 1) / one - mean_a * mean_a, b = m(2, 2) / one - mean_b * mean_b;
  if (!(present[0] && present[1]))
    return std::min(present[0] ? a : HUGE_VAL, present[1] ? b : HUGE_VAL);
  const double cov = m(2, 1) / one - mean_a * mean_b;
  return 0.5 * (a + b) - std::sqrt(0.25 * (a - b) * (a - b) + cov * cov);
}

}  // namespace

WallFit fit_at_wall(const FluidNodes& nodes, const Vec3& point, const Vec3& normal,
                    const NodeIndex* from) {
  const Grid& grid = nodes.grid();
  const NodeIndex base = nodes.cell(point);
  const Tangents along = tangents_of(grid, normal);
  const double h = nodes.spacing(normal, nodes.cell_inside(point));
  // Along each axis: how far the nodes are, and the square of that in spacings.
  std::array<std::array<double, 6>, 3> far{}, far2{};
  NodeIndex low = base, high = base;
  for (std::size_t a = 0; a < 3; ++a) {
    const Axis& axis = grid.axis[a];
    if (!axis.present) continue;
    const double inverse_spacing = 1.0 / (axis.x(base[a] + 1) - axis.x(base[a]));
    low[a] = std::max(base[a] - 2, -n_ghost);
    high[a] = std::min(base[a] + 3, axis.n + n_ghost - 1);
    for (int i = low[a]; i <= high[a]; ++i) {
      const auto at = static_cast<std::size_t>(i - low[a]);
      far[a][at] = axis.x(i) - point.c[a];
      far2[a][at] = far[a][at] * far[a][at] * inverse_spacing * inverse_spacing;
    }
  }
  constexpr double reach2 = reach * reach;
  WallFit fit;
  Normal m = Normal::Zero();
  std::array<Terms, WallFit::most_nodes> at;
  NodeIndex node{};
  for (node[2] = low[2]; node[2] <= high[2]; ++node[2]) {
    const auto k = static_cast<std::size_t>(node[2] - low[2]);
    for (node[1] = low[1]; node[1] <= high[1]; ++node[1]) {
      const auto j = static_cast<std::size_t>(node[1] - low[1]);
      const double across2 = far2[1][j] + far2[2][k];
      if (across2 >= reach2) continue;
      for (node[0] = low[0]; node[0] <= high[0]; ++node[0]) {
        const auto i_far = static_cast<std::size_t>(node[0] - low[0]);
        const double rim = 1.0 - (far2[0][i_far] + across2) / reach2;
        if (rim <= 0.0) continue;
        const Vec3 away{{far[0][i_far], far[1][j], far[2][k]}};
        const double distance = dot(away, normal);
        if (distance <= 0.0 || !nodes.usable(node, point, normal, from)) continue;
        const double weight = rim * rim * std::min(1.0, distance / (full_from * h));
        const std::size_t i = fit.n++;
        fit.node[i] = {.at = node, .mean = weight, .distance = distance};
        const double u = along.present[0] ? dot(away, along.t[0]) / h : 0.0;
        const double v = along.present[1] ? dot(away, along.t[1]) / h : 0.0;
        const double d = distance / h;
        at[i] << 1.0, u, v, u * u, u * v, v * v, d * d;
        m.selfadjointView<Eigen::Lower>().rankUpdate(at[i], weight);
      }
    }
  }
  const double one = m(0, 0);
  if (one < least_sum) return {};
  for (int q = 1; q < most_terms; ++q) {
    if (m(q, q) == 0.0) m(q, q) = one;  // no such direction
  }
  const double damping = std::max(0.0, least_spread - least_variance(m, along.present));
  m(1, 1) += damping * one;
  m(2, 2) += damping * one;
  m.diagonal().tail<4>().array() += curved_damping * one;
  const Eigen::Vector3d linear = m.topLeftCorner<3, 3>().llt().solve(Eigen::Vector3d::Unit(0));
  const Terms curved = m.llt().solve(Terms::Unit(0));
  for (std::size_t i = 0; i < fit.n; ++i) {
    WallFit::Node& to = fit.node[i];
    to.linear = to.mean * linear.dot(at[i].head<3>());
    to.curved = to.mean * curved.dot(at[i]);
    to.mean /= one;
  }
  return fit;
}

}  // namespace ocublast::flow
