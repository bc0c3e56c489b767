#include "coupler/mapping/point_rows.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <unsupported/Eigen/BVH>

#include "coupler/mapping/surface_search.hpp"

namespace ocublast::coupler {

using Eigen::Vector3d;

namespace {

class Projection : public PointFinder {
 public:
  explicit Projection(const link::InterfaceMesh& mesh)
      : triangles_(mesh.triangles), search_(mesh) {}

  [[nodiscard]] PointRow row(const Vector3d& x, const Vector3d& normal) const override {
    const SurfacePoint found = search_.nearest(x, normal);
    if (found.triangle < 0) return {};
    PointRow row{.weights = {}, .gap = found.distance, .size = search_.facet_size(found.triangle)};
    for (std::size_t k = 0; k < 3; ++k)
      if (found.weight[k] != 0.0)
        row.weights.emplace_back(triangles_[3 * static_cast<std::size_t>(found.triangle) + k],
                                 found.weight[k]);
    return row;
  }

 private:
  std::vector<std::int32_t> triangles_;
  SurfaceSearch search_;
};

/// Nodes of a stencil: twice the least that a local quadratic in the plane would need, and more.
constexpr std::size_t stencil_nodes = 20;

using Box = Eigen::AlignedBox3d;
using BoxTree = Eigen::KdBVH<double, 3, std::int32_t>;

/// Nodes within a radius, as Eigen's tree wants it.
struct Within {
  const std::vector<Vector3d>& points;
  const Vector3d& x;
  double square;
  std::vector<std::pair<double, std::int32_t>> found;

  bool intersectVolume(const Box& box) const { return box.squaredExteriorDistance(x) <= square; }
  bool intersectObject(std::int32_t k) {
    const double d = (points[static_cast<std::size_t>(k)] - x).squaredNorm();
    if (d <= square) found.emplace_back(d, k);
    return false;  // go on
  }
};

class RadialBasis : public PointFinder {
 public:
  explicit RadialBasis(const link::InterfaceMesh& mesh) {
    std::vector<std::int32_t> numbers(mesh.n_vertices());
    std::iota(numbers.begin(), numbers.end(), 0);
    std::vector<Box> boxes;
    Box all;
    for (std::size_t v = 0; v < mesh.n_vertices(); ++v) {
      points_.push_back(point_of(mesh.vertices, v));
      boxes.emplace_back(points_.back());
      all.extend(points_.back());
    }
    tree_.init(numbers.begin(), numbers.end(), boxes.begin(), boxes.end());
    extent_ = all.isEmpty() ? 0.0 : all.diagonal().norm();
  }

  [[nodiscard]] PointRow row(const Vector3d& x, const Vector3d& normal) const override;

 private:
  [[nodiscard]] std::vector<std::pair<double, std::int32_t>> nearest(const Vector3d& x) const;

  std::vector<Vector3d> points_;
  BoxTree tree_;
  double extent_ = 0.0;
};

std::vector<std::pair<double, std::int32_t>> RadialBasis::nearest(const Vector3d& x) const {
  const std::size_t wanted = std::min(stencil_nodes, points_.size());
  // The radius that would hold as many of nodes spread over a surface of this extent, doubled until
  // it does.
  double radius =
      extent_ * std::sqrt(static_cast<double>(wanted) / static_cast<double>(points_.size()));
  for (;; radius *= 2.0) {
    Within search{.points = points_, .x = x, .square = radius * radius, .found = {}};
    Eigen::BVIntersect(tree_, search);
    if (search.found.size() < wanted && radius < 1e6 * extent_) continue;
    std::sort(search.found.begin(), search.found.end());
    search.found.resize(std::min(wanted, search.found.size()));
    return search.found;
  }
}

PointRow RadialBasis::row(const Vector3d& x, const Vector3d& /*normal*/) const {
  const auto near = nearest(x);
  if (near.size() < 4 || !(extent_ > 0.0)) return {};
  const auto n = static_cast<Eigen::Index>(near.size());
  const auto at = [&](Eigen::Index k) -> const Vector3d& {
    return points_[static_cast<std::size_t>(near[static_cast<std::size_t>(k)].second)];
  };
  Vector3d center = Vector3d::Zero();
  for (Eigen::Index k = 0; k < n; ++k) center += at(k) / static_cast<double>(n);
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (Eigen::Index k = 0; k < n; ++k) spread += (at(k) - center) * (at(k) - center).transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(spread);
  // In units of the stencil's own size, so that the system is as well conditioned at any scale.
  const double scale = std::sqrt(axes.eigenvalues()[2]);
  const Vector3d s = axes.eigenvectors().col(2) / scale, t = axes.eigenvectors().col(1) / scale;
  // Nodes on a line carry no second direction.
  constexpr double flat = 1e-8;
  const Eigen::Index m = axes.eigenvalues()[1] > flat * axes.eigenvalues()[2] ? 3 : 2;
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(n + m, n + m);
  Eigen::VectorXd b(n + m);
  const auto cube = [&](const Vector3d& d) { return std::pow(d.norm() / scale, 3); };
  const auto polynomial = [&](const Vector3d& d, Eigen::Index p) {
    return p == 0 ? 1.0 : d.dot(p == 1 ? s : t);
  };
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) A(i, j) = cube(at(i) - at(j));
    for (Eigen::Index p = 0; p < m; ++p) A(i, n + p) = A(n + p, i) = polynomial(at(i) - center, p);
    b(i) = cube(x - at(i));
  }
  for (Eigen::Index p = 0; p < m; ++p) b(n + p) = polynomial(x - center, p);
  const Eigen::VectorXd w = A.partialPivLu().solve(b);
  PointRow row{.weights = {},
               .gap = std::sqrt(near.front().first),
               .size = 2.0 * scale / std::sqrt(static_cast<double>(n))};
  const double sum = w.head(n).sum();
  for (Eigen::Index k = 0; k < n; ++k)
    row.weights.emplace_back(near[static_cast<std::size_t>(k)].second, w(k) / sum);
  return row;
}

}  // namespace

std::unique_ptr<PointFinder> make_projection(const link::InterfaceMesh& mesh) {
  return std::make_unique<Projection>(mesh);
}

std::unique_ptr<PointFinder> make_radial_basis(const link::InterfaceMesh& mesh) {
  return std::make_unique<RadialBasis>(mesh);
}

}  // namespace ocublast::coupler
