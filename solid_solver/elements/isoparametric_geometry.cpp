#include "solid_solver/elements/isoparametric_geometry.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "solid_solver/elements/tet4_geometry.hpp"

namespace ocublast::solid {
namespace {

using Local = std::vector<Eigen::Vector3d>;

struct Point {
  Eigen::Vector3d xi;
  double weight;
};

constexpr double gauss = 0.57735026918962576451;  // 1 / sqrt 3
constexpr std::array<std::array<std::size_t, 2>, 6> tet_edges{
    {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}}};

std::vector<Point> points_of(Shape shape) {
  std::vector<Point> points;
  if (shape == Shape::tet10) {
    const double a = (5.0 - std::sqrt(5.0)) / 20.0;
    const double b = 1.0 - 3.0 * a;
    for (const auto& xi : {Eigen::Vector3d(a, a, a), Eigen::Vector3d(b, a, a),
                           Eigen::Vector3d(a, b, a), Eigen::Vector3d(a, a, b)})
      points.push_back({xi, 1.0 / 24.0});
  } else if (shape == Shape::wedge6) {
    for (const double z : {-gauss, gauss})
      for (const auto& [r, s] : {std::pair{1.0 / 6.0, 1.0 / 6.0}, std::pair{2.0 / 3.0, 1.0 / 6.0},
                                 std::pair{1.0 / 6.0, 2.0 / 3.0}})
        points.push_back({Eigen::Vector3d(r, s, z), 1.0 / 6.0});
  } else {
    for (const double s : {-gauss, gauss})
      for (const double r : {-gauss, gauss}) points.push_back({Eigen::Vector3d(r, s, 0.0), 1.0});
  }
  return points;
}

/// Shape functions and their derivatives by the reference coordinates.
void shape_functions(Shape shape, const Eigen::Vector3d& xi, std::vector<double>& N, Local& dN) {
  if (shape == Shape::tet10) {
    const std::array<double, 4> L{1.0 - xi.sum(), xi[0], xi[1], xi[2]};
    const std::array<Eigen::Vector3d, 4> dL{Eigen::Vector3d(-1, -1, -1), Eigen::Vector3d(1, 0, 0),
                                            Eigen::Vector3d(0, 1, 0), Eigen::Vector3d(0, 0, 1)};
    for (std::size_t a = 0; a < 4; ++a) {
      N.push_back(L[a] * (2.0 * L[a] - 1.0));
      dN.push_back((4.0 * L[a] - 1.0) * dL[a]);
    }
    for (const auto& [a, b] : tet_edges) {
      N.push_back(4.0 * L[a] * L[b]);
      dN.push_back(4.0 * (L[a] * dL[b] + L[b] * dL[a]));
    }
  } else if (shape == Shape::wedge6) {
    const std::array<double, 3> L{1.0 - xi[0] - xi[1], xi[0], xi[1]};
    const std::array<Eigen::Vector2d, 3> dL{Eigen::Vector2d(-1, -1), Eigen::Vector2d(1, 0),
                                            Eigen::Vector2d(0, 1)};
    for (const double z : {-1.0, 1.0})
      for (std::size_t a = 0; a < 3; ++a) {
        const double half = 0.5 * (1.0 + z * xi[2]);
        N.push_back(L[a] * half);
        dN.emplace_back(dL[a][0] * half, dL[a][1] * half, 0.5 * z * L[a]);
      }
  } else {
    for (const auto& [r, s] :
         {std::pair{-1.0, -1.0}, std::pair{1.0, -1.0}, std::pair{1.0, 1.0}, std::pair{-1.0, 1.0}}) {
      N.push_back(0.25 * (1.0 + r * xi[0]) * (1.0 + s * xi[1]));
      dN.emplace_back(0.25 * r * (1.0 + s * xi[1]), 0.25 * s * (1.0 + r * xi[0]), 0.0);
    }
  }
}

double radius(const PointGeometry& point, NodePositions x) {
  double r = 0.0;
  for (std::size_t a = 0; a < x.size(); ++a) r += point.shape[a] * x[a][0];
  return r;
}

template <Shape shape>
void fill_solid(NodePositions x, const FillOptions& options, double* out) {
  for (const auto& point : compute_point_geometry(shape, x)) {
    for (std::size_t a = 0; a < x.size(); ++a)
      for (std::size_t j = 0; j < 3; ++j, out += batch_lanes) *out = point.gradients[a][j];
    *out = options.scale * point.weight;
    out += batch_lanes;
  }
}

template <bool ring>
void fill_plane(NodePositions x, const FillOptions& options, double* out) {
  for (const auto& point : compute_point_geometry(Shape::quad4, x)) {
    const double r = radius(point, x);
    for (std::size_t a = 0; a < 4; ++a) {
      for (std::size_t j = 0; j < 2; ++j, out += batch_lanes) *out = point.gradients[a][j];
      if constexpr (ring) {
        *out = point.shape[a] / r;
        out += batch_lanes;
      }
    }
    *out = options.scale * point.weight * (ring ? 2.0 * std::numbers::pi * r : 1.0);
    out += batch_lanes;
  }
}

template <Shape shape, bool ring>
void lump_rows(NodePositions x, std::span<double> volumes) {
  std::fill(volumes.begin(), volumes.end(), 0.0);
  for (const auto& point : compute_point_geometry(shape, x)) {
    const double w = point.weight * (ring ? 2.0 * std::numbers::pi * radius(point, x) : 1.0);
    for (std::size_t a = 0; a < x.size(); ++a) volumes[a] += w * point.shape[a];
  }
}

void lump_tet10(NodePositions x, std::span<double> volumes) {
  double volume = 0.0;
  for (const auto& point : compute_point_geometry(Shape::tet10, x)) volume += point.weight;
  for (std::size_t a = 0; a < 10; ++a) volumes[a] = volume * (a < 4 ? 1.0 / 36.0 : 4.0 / 27.0);
}

Eigen::Vector3d at(NodePositions x, std::size_t a) {
  return {x[a][0], x[a][1], x[a][2]};
}

/// Smallest of the mean height between the triangles and the altitudes of the mean triangle.
double wedge_length(NodePositions x) {
  Eigen::Vector3d mean[3];
  for (std::size_t a = 0; a < 3; ++a) mean[a] = 0.5 * (at(x, a) + at(x, a + 3));
  const double area = 0.5 * (mean[1] - mean[0]).cross(mean[2] - mean[0]).norm();
  double side = 0.0;
  for (int a = 0; a < 3; ++a) side = std::max(side, (mean[(a + 1) % 3] - mean[a]).norm());
  double volume = 0.0;
  for (const auto& point : compute_point_geometry(Shape::wedge6, x)) volume += point.weight;
  return std::min(volume / area, 2.0 * area / side);
}

/// Area over the longest side.
double quad_length(NodePositions x) {
  double area = 0.0;
  for (const auto& point : compute_point_geometry(Shape::quad4, x)) area += point.weight;
  double side = 0.0;
  for (std::size_t a = 0; a < 4; ++a) side = std::max(side, (at(x, (a + 1) % 4) - at(x, a)).norm());
  return area / side;
}

constexpr std::array<int, 10> same_order{0, 1, 2, 3, 4, 5, 6, 7, 8, 9};

std::span<const int> order(std::size_t n) {
  return {same_order.data(), n};
}

}  // namespace

std::vector<PointGeometry> compute_point_geometry(Shape shape, NodePositions x) {
  std::vector<PointGeometry> result;
  for (const auto& point : points_of(shape)) {
    PointGeometry g;
    Local dN;
    shape_functions(shape, point.xi, g.shape, dN);
    Eigen::Matrix3d J = Eigen::Matrix3d::Zero();  // J(j, k) = dX_j / dxi_k
    for (std::size_t a = 0; a < x.size(); ++a) J += at(x, a) * dN[a].transpose();
    if (shape == Shape::quad4) J.row(2) << 0.0, 0.0, 1.0;
    const Eigen::Matrix3d inverse = J.inverse();
    for (std::size_t a = 0; a < x.size(); ++a) {
      const Eigen::Vector3d gradient = inverse.transpose() * dN[a];
      g.gradients.push_back({gradient[0], gradient[1], gradient[2]});
    }
    g.weight = J.determinant() * point.weight;
    result.push_back(std::move(g));
  }
  return result;
}

ElementGeometry tet10_geometry() {
  return {.fill = &fill_solid<Shape::tet10>,
          .lump = &lump_tet10,
          .length = &tet_length,
          .order = order(10)};
}

ElementGeometry wedge6_geometry() {
  return {.fill = &fill_solid<Shape::wedge6>,
          .lump = &lump_rows<Shape::wedge6, false>,
          .length = &wedge_length,
          .order = order(6)};
}

ElementGeometry quad4_plane_geometry() {
  return {.fill = &fill_plane<false>,
          .lump = &lump_rows<Shape::quad4, false>,
          .length = &quad_length,
          .order = order(4)};
}

ElementGeometry quad4_ring_geometry() {
  return {.fill = &fill_plane<true>,
          .lump = &lump_rows<Shape::quad4, true>,
          .length = &quad_length,
          .order = order(4)};
}

}  // namespace ocublast::solid
