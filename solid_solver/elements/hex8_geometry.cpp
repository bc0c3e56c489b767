#include "solid_solver/elements/hex8_geometry.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace ocublast::solid {
namespace {

constexpr double gauss = 0.57735026918962576451;

double sign(int node, int bit) {
  return (node & bit) != 0 ? 1.0 : -1.0;
}

/// dX/dxi at a point of the reference cube.
Eigen::Matrix3d jacobian(const HexNodes& x, const Eigen::Vector3d& xi) {
  Eigen::Matrix3d J = Eigen::Matrix3d::Zero();  // J(j, k) = dX_j / dxi_k
  for (int b = 0; b < 8; ++b) {
    const Eigen::Vector3d s(sign(b, 1), sign(b, 2), sign(b, 4));
    const Eigen::Vector3d f = Eigen::Vector3d::Ones() + s.cwiseProduct(xi);
    const auto& p = x[static_cast<std::size_t>(hex_vtk_of_binary[static_cast<std::size_t>(b)])];
    const Eigen::Vector3d X(p[0], p[1], p[2]);
    J.col(0) += X * (0.125 * s[0] * f[1] * f[2]);
    J.col(1) += X * (0.125 * s[1] * f[0] * f[2]);
    J.col(2) += X * (0.125 * s[2] * f[0] * f[1]);
  }
  return J;
}

}  // namespace

HexGeometry compute_hex_geometry(const HexNodes& x) {
  HexGeometry g{};
  g.smallest_jacobian = 1e300;
  for (std::size_t q = 0; q < 8; ++q) {
    const int bits = static_cast<int>(q);
    const Eigen::Vector3d xi(gauss * sign(bits, 1), gauss * sign(bits, 2), gauss * sign(bits, 4));
    const Eigen::Matrix3d J = jacobian(x, xi);
    const Eigen::Matrix3d inverse = J.inverse();
    for (int k = 0; k < 3; ++k)
      for (int j = 0; j < 3; ++j)
        g.gradients[q][static_cast<std::size_t>(3 * k + j)] = 0.125 * inverse(k, j);
    g.weights[q] = J.determinant();
    g.volume += g.weights[q];
    g.smallest_jacobian = std::min(g.smallest_jacobian, g.weights[q]);
    for (int b = 0; b < 8; ++b) {
      const double N = 0.125 * (1.0 + sign(b, 1) * xi[0]) * (1.0 + sign(b, 2) * xi[1]) *
                       (1.0 + sign(b, 4) * xi[2]);
      g.lumped[static_cast<std::size_t>(hex_vtk_of_binary[static_cast<std::size_t>(b)])] +=
          g.weights[q] * N;
    }
  }
  return g;
}

double hex_length(const HexNodes& x) {
  const auto at = [&](int a) {
    const auto& p = x[static_cast<std::size_t>(a)];
    return Eigen::Vector3d(p[0], p[1], p[2]);
  };
  double largest = 0.0;
  for (const auto& f : hex_faces)
    largest = std::max(largest, 0.5 * (at(f[2]) - at(f[0])).cross(at(f[3]) - at(f[1])).norm());
  double volume = 0.0;
  for (int q = 0; q < 8; ++q)
    volume +=
        jacobian(x, gauss * Eigen::Vector3d(sign(q, 1), sign(q, 2), sign(q, 4))).determinant();
  return volume / largest;
}

}  // namespace ocublast::solid
