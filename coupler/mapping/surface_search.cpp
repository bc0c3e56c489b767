#include "coupler/mapping/surface_search.hpp"

#include <cmath>
#include <limits>
#include <unsupported/Eigen/BVH>

#include "coupler/base/closest_point.hpp"

namespace ocublast::coupler {

using Eigen::Vector3d;

namespace {

using Box = Eigen::AlignedBox3d;
using BoxTree = Eigen::KdBVH<double, 3, std::int32_t>;

/// Facets that look away are no candidates. Cosine: the walls of the flow use the same limit.
constexpr double same_side = 0.2;

}  // namespace

std::vector<Vector3d> area_vectors(std::span<const double> vertices,
                                   std::span<const std::int32_t> triangles) {
  std::vector<Vector3d> areas(triangles.size() / 3);
  for (std::size_t t = 0; t < areas.size(); ++t) {
    const auto corner = [&](std::size_t k) {
      return point_of(vertices, static_cast<std::size_t>(triangles[3 * t + k]));
    };
    areas[t] = 0.5 * (corner(1) - corner(0)).cross(corner(2) - corner(0));
  }
  return areas;
}

std::vector<Vector3d> vertex_normals(const link::InterfaceMesh& mesh) {
  std::vector<Vector3d> normals(mesh.n_vertices(), Vector3d::Zero());
  const auto areas = area_vectors(mesh.vertices, mesh.triangles);
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    normals[static_cast<std::size_t>(mesh.triangles[i])] += areas[i / 3];
  for (Vector3d& n : normals) n = n.normalized();
  return normals;
}

struct SurfaceSearch::Tree {
  std::vector<Vector3d> corners;  ///< three per triangle
  std::vector<Vector3d> normals;  ///< unit
  std::vector<double> sizes;      ///< m
  BoxTree boxes;
};

namespace {

/// Squared distance of a point to boxes and triangles, as Eigen's search wants it.
struct Nearest {
  using Scalar = double;
  const std::vector<Vector3d>& corners;
  const std::vector<Vector3d>& normals;
  const Vector3d& x;
  const Vector3d& normal;
  SurfacePoint best;
  double best_square = std::numeric_limits<double>::infinity();

  double minimumOnVolume(const Box& box) const { return box.squaredExteriorDistance(x); }
  double minimumOnObject(std::int32_t t) {
    const auto i = static_cast<std::size_t>(t);
    if (!(normals[i].dot(normal) > same_side)) return std::numeric_limits<double>::infinity();
    const Vector3d *a = &corners[3 * i], *b = a + 1, *c = a + 2;
    const auto weight = closest_weights(x, *a, *b, *c);
    const double square = (weight[0] * *a + weight[1] * *b + weight[2] * *c - x).squaredNorm();
    if (square < best_square) {
      best_square = square;
      best = {.triangle = t, .weight = weight, .distance = std::sqrt(square)};
    }
    return square;
  }
};

}  // namespace

SurfaceSearch::SurfaceSearch(const link::InterfaceMesh& mesh) : tree_(std::make_unique<Tree>()) {
  const std::size_t n = mesh.triangles.size() / 3;
  const auto areas = area_vectors(mesh.vertices, mesh.triangles);
  std::vector<std::int32_t> numbers(n);
  std::vector<Box> boxes(n);
  for (std::size_t t = 0; t < n; ++t) {
    numbers[t] = static_cast<std::int32_t>(t);
    for (std::size_t k = 0; k < 3; ++k) {
      tree_->corners.push_back(
          point_of(mesh.vertices, static_cast<std::size_t>(mesh.triangles[3 * t + k])));
      boxes[t].extend(tree_->corners.back());
    }
    tree_->normals.push_back(areas[t].normalized());
    tree_->sizes.push_back(std::sqrt(4.0 / std::sqrt(3.0) * areas[t].norm()));
  }
  tree_->boxes.init(numbers.begin(), numbers.end(), boxes.begin(), boxes.end());
}

SurfaceSearch::~SurfaceSearch() = default;
SurfaceSearch::SurfaceSearch(SurfaceSearch&&) noexcept = default;
SurfaceSearch& SurfaceSearch::operator=(SurfaceSearch&&) noexcept = default;

SurfacePoint SurfaceSearch::nearest(const Vector3d& x, const Vector3d& normal) const {
  Nearest search{
      .corners = tree_->corners, .normals = tree_->normals, .x = x, .normal = normal, .best = {}};
  if (!tree_->sizes.empty()) static_cast<void>(Eigen::BVMinimize(tree_->boxes, search));
  return search.best;
}

double SurfaceSearch::facet_size(std::int32_t triangle) const {
  return tree_->sizes[static_cast<std::size_t>(triangle)];
}

}  // namespace ocublast::coupler
