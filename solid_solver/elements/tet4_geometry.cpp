#include "solid_solver/elements/tet4_geometry.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace ocublast::solid {
namespace {

Eigen::Vector3d point(NodePositions x, std::size_t a) {
  return {x[a][0], x[a][1], x[a][2]};
}

constexpr std::array<int, 4> same_order{0, 1, 2, 3};

void lump(NodePositions x, std::span<double> volumes) {
  std::fill(volumes.begin(), volumes.end(), 0.25 * compute_tet_geometry(x).volume);
}

void fill(NodePositions x, const FillOptions& options, double* out) {
  const auto g = compute_tet_geometry(x);
  for (std::size_t a = 0; a < 3; ++a)
    for (std::size_t j = 0; j < 3; ++j, out += batch_lanes) *out = g.gradients[a][j];
  *out = options.scale * g.volume;
}

}  // namespace

TetGeometry compute_tet_geometry(NodePositions x) {
  Eigen::Matrix3d E;  // edges from node 3: columns X_a - X_3; u - u_3 = sum (u_a - u_3) N_a
  for (std::size_t a = 0; a < 3; ++a) E.col(static_cast<int>(a)) = point(x, a) - point(x, 3);
  TetGeometry g{};
  g.volume = -E.determinant() / 6.0;
  const Eigen::Matrix3d inverse = E.inverse();  // row a = dN_a / dX
  for (std::size_t a = 0; a < 3; ++a)
    for (std::size_t j = 0; j < 3; ++j) {
      g.gradients[a][j] = inverse(static_cast<int>(a), static_cast<int>(j));
      g.gradients[3][j] -= g.gradients[a][j];
    }
  return g;
}

double tet_length(NodePositions x) {
  double largest = 0.0;
  for (std::size_t skip = 0; skip < 4; ++skip) {
    const auto a = point(x, (skip + 1) % 4);
    const auto b = point(x, (skip + 2) % 4);
    const auto c = point(x, (skip + 3) % 4);
    largest = std::max(largest, 0.5 * (b - a).cross(c - a).norm());
  }
  return 3.0 * compute_tet_geometry(x).volume / largest;
}

ElementGeometry tet4_geometry() {
  return {.fill = &fill, .lump = &lump, .length = &tet_length, .order = same_order};
}

}  // namespace ocublast::solid
