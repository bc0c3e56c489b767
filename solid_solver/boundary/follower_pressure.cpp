#include "solid_solver/boundary/follower_pressure.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace ocublast::solid {

FollowerPressure::FollowerPressure(const SolidMesh& mesh, const std::vector<Facet>& facets,
                                   Edges edges)
    : mesh_(mesh), kind_(edges) {
  for (const auto& f : facets)
    for (const auto n : f)
      if (n >= 0) nodes_.push_back(n);
  std::sort(nodes_.begin(), nodes_.end());
  nodes_.erase(std::unique(nodes_.begin(), nodes_.end()), nodes_.end());
  const auto vertex = [&](std::int32_t n) {
    return static_cast<std::int32_t>(std::lower_bound(nodes_.begin(), nodes_.end(), n) -
                                     nodes_.begin());
  };
  const auto add = [&](std::int32_t a, std::int32_t b, std::int32_t c, double share) {
    triangles_.push_back({.vertices = {vertex(a), vertex(b), vertex(c)}, .share = share});
  };
  for (const auto& f : facets) {
    if (f[2] < 0) {
      edges_.push_back({vertex(f[0]), vertex(f[1])});
      continue;
    }
    if (f[3] < 0) {
      add(f[0], f[1], f[2], 1.0);
      continue;
    }
    add(f[0], f[1], f[2], 0.5);
    add(f[0], f[2], f[3], 0.5);
    add(f[0], f[1], f[3], 0.5);
    add(f[1], f[2], f[3], 0.5);
  }
}

std::array<double, 3> FollowerPressure::triangle_area(const Triangle& t,
                                                      std::span<const double> displacement) const {
  double x[3][3];
  for (std::size_t a = 0; a < 3; ++a) {
    const auto n = static_cast<std::size_t>(nodes_[static_cast<std::size_t>(t.vertices[a])]);
    for (std::size_t i = 0; i < 3; ++i) {
      x[a][i] = mesh_.nodes[3 * n + i];
      if (!displacement.empty()) x[a][i] += displacement[4 * n + i];
    }
  }
  double u[3];
  double v[3];
  for (int i = 0; i < 3; ++i) {
    u[i] = x[1][i] - x[0][i];
    v[i] = x[2][i] - x[0][i];
  }
  const double half = 0.5 * t.share;
  return {half * (u[1] * v[2] - u[2] * v[1]), half * (u[2] * v[0] - u[0] * v[2]),
          half * (u[0] * v[1] - u[1] * v[0])};
}

std::array<FollowerPressure::EdgePoint, 2> FollowerPressure::edge_points(
    const Edge& edge, std::span<const double> displacement) const {
  double x[2][2];
  for (std::size_t a = 0; a < 2; ++a) {
    const auto n = static_cast<std::size_t>(nodes_[static_cast<std::size_t>(edge[a])]);
    for (std::size_t i = 0; i < 2; ++i) {
      x[a][i] = mesh_.nodes[3 * n + i];
      if (!displacement.empty()) x[a][i] += displacement[4 * n + i];
    }
  }
  std::array<EdgePoint, 2> points{};
  for (std::size_t q = 0; q < 2; ++q) {
    const double s = 0.5 * (1.0 + (q == 0 ? -1.0 : 1.0) / std::numbers::sqrt3);
    points[q].shape = {1.0 - s, s};
    const double radius = (1.0 - s) * x[0][0] + s * x[1][0];
    const double width = kind_ == Edges::rings ? 2.0 * std::numbers::pi * radius : 1.0;
    // Outward: cells run counter-clockwise.
    points[q].area = {0.5 * width * (x[1][1] - x[0][1]), -0.5 * width * (x[1][0] - x[0][0])};
  }
  return points;
}

void FollowerPressure::compute_forces(std::span<const double> displacement,
                                      std::span<const double> pressure,
                                      std::span<double> forces) const {
  std::fill(forces.begin(), forces.end(), 0.0);
  for (const auto& t : triangles_) {
    std::array<std::size_t, 3> v{};
    double sum = 0.0;
    for (std::size_t a = 0; a < 3; ++a) {
      v[a] = static_cast<std::size_t>(t.vertices[a]);
      sum += pressure[v[a]];
    }
    const auto S = triangle_area(t, displacement);
    for (std::size_t a = 0; a < 3; ++a) {
      const double scale = -(pressure[v[a]] + sum) / 12.0;
      for (std::size_t i = 0; i < 3; ++i) forces[3 * v[a] + i] += scale * S[i];
    }
  }
  for (const auto& edge : edges_)
    for (const auto& point : edge_points(edge, displacement)) {
      const std::size_t v[2] = {static_cast<std::size_t>(edge[0]),
                                static_cast<std::size_t>(edge[1])};
      const double p = point.shape[0] * pressure[v[0]] + point.shape[1] * pressure[v[1]];
      for (std::size_t a = 0; a < 2; ++a)
        for (std::size_t i = 0; i < 2; ++i)
          forces[3 * v[a] + i] -= p * point.shape[a] * point.area[i];
    }
}

std::vector<double> FollowerPressure::nodal_areas() const {
  std::vector<double> areas(nodes_.size(), 0.0);
  for (const auto& t : triangles_) {
    const auto S = triangle_area(t, {});
    const double area = std::sqrt(S[0] * S[0] + S[1] * S[1] + S[2] * S[2]);
    for (const auto v : t.vertices) areas[static_cast<std::size_t>(v)] += area / 3.0;
  }
  for (const auto& edge : edges_)
    for (const auto& point : edge_points(edge, {}))
      for (std::size_t a = 0; a < 2; ++a)
        areas[static_cast<std::size_t>(edge[a])] +=
            point.shape[a] * std::hypot(point.area[0], point.area[1]);
  return areas;
}

std::array<double, 3> FollowerPressure::area_vector(std::span<const double> displacement) const {
  std::array<double, 3> sum{};
  for (const auto& t : triangles_) {
    const auto S = triangle_area(t, displacement);
    for (std::size_t i = 0; i < 3; ++i) sum[i] += S[i];
  }
  for (const auto& edge : edges_)
    for (const auto& point : edge_points(edge, displacement))
      for (std::size_t i = 0; i < 2; ++i) sum[i] += point.area[i];
  return sum;
}

}  // namespace ocublast::solid
