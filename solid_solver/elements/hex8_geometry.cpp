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
Eigen::Matrix3d jacobian(NodePositions x, const Eigen::Vector3d& xi) {
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

HexGeometry compute_hex_geometry(NodePositions x) {
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

namespace {

/// V / A_max, m.
double hex_length(NodePositions x) {
  const auto at = [&](int a) {
    const auto& p = x[static_cast<std::size_t>(a)];
    return Eigen::Vector3d(p[0], p[1], p[2]);
  };
  double largest = 0.0;
  for (const auto& f : hex_faces)
    largest = std::max(largest, 0.5 * (at(f[2]) - at(f[0])).cross(at(f[3]) - at(f[1])).norm());
  return compute_hex_geometry(x).volume / largest;
}

void lump(NodePositions x, std::span<double> volumes) {
  const auto g = compute_hex_geometry(x);
  std::copy(g.lumped.begin(), g.lumped.end(), volumes.begin());
}

void fill_points(NodePositions x, const FillOptions& options, double* out) {
  const auto g = compute_hex_geometry(x);
  for (std::size_t q = 0; q < 8; ++q) {
    for (std::size_t i = 0; i < 9; ++i) *out = g.gradients[q][i], out += batch_lanes;
    *out = options.scale * g.weights[q];
    out += batch_lanes;
  }
}

/// Volume mean of the shape gradients [8 binary nodes, 3], 1/m.
Eigen::Matrix<double, 8, 3> mean_gradients(const HexGeometry& g) {
  Eigen::Matrix<double, 8, 3> mean = Eigen::Matrix<double, 8, 3>::Zero();
  for (std::size_t q = 0; q < 8; ++q) {
    const int bits = static_cast<int>(q);
    const Eigen::Vector3d xi(gauss * sign(bits, 1), gauss * sign(bits, 2), gauss * sign(bits, 4));
    for (int b = 0; b < 8; ++b) {
      const Eigen::Vector3d s(sign(b, 1), sign(b, 2), sign(b, 4));
      const Eigen::Vector3d f = Eigen::Vector3d::Ones() + s.cwiseProduct(xi);
      const Eigen::Vector3d local(s[0] * f[1] * f[2], s[1] * f[0] * f[2], s[2] * f[0] * f[1]);
      for (int j = 0; j < 3; ++j)
        for (int k = 0; k < 3; ++k)
          mean(b, j) += g.weights[q] / g.volume * local[k] *
                        g.gradients[q][static_cast<std::size_t>(3 * k + j)];
    }
  }
  return mean;
}

void fill_one_point(NodePositions x, const FillOptions& options, double* out) {
  const auto g = compute_hex_geometry(x);
  const Eigen::Matrix<double, 8, 3> B = mean_gradients(g);
  Eigen::Matrix<double, 8, 8> h;  // row m: signs of mode m at the binary nodes
  Eigen::Matrix<double, 8, 3> X;
  for (int b = 0; b < 8; ++b) {
    for (int m = 0; m < 8; ++m) {
      h(m, b) = 1.0;
      for (const int bit : {1, 2, 4})
        if ((m & bit) != 0) h(m, b) *= sign(b, bit);
    }
    const auto& p = x[static_cast<std::size_t>(hex_vtk_of_binary[static_cast<std::size_t>(b)])];
    X.row(b) << p[0], p[1], p[2];
  }
  const auto put = [&](double value) {
    *out = value;
    out += batch_lanes;
  };
  // B_a = sum_m h_m(a) modes(m) / 8: with m(u) = h u, grad u = sum_m m(u) modes(m) / 8.
  const Eigen::Matrix<double, 8, 3> modes = h * B / 8.0;
  for (int m = 1; m < 8; ++m)
    for (int j = 0; j < 3; ++j) put(modes(m, j));
  for (const int m : {3, 5, 6, 7})
    for (int j = 0; j < 3; ++j) put(h.row(m).dot(X.col(j)));
  put(options.scale * g.volume);
  const Eigen::Matrix3d inverse = jacobian(x, Eigen::Vector3d::Zero()).inverse();
  for (const int m : {3, 5, 6, 7}) {
    double softest = 1e300;  // of |grad|^2 along the mode's directions
    for (int k = 0; k < 3; ++k)
      if ((m & (1 << k)) != 0) softest = std::min(softest, inverse.row(k).squaredNorm());
    // Mean over the cube of |grad mode|^2, as if all its directions were the softest one.
    const double square = softest * (m == 7 ? 3.0 / 9.0 : 2.0 / 3.0);
    put(options.scale * options.hourglass_modulus * g.volume * square / 64.0);
  }
}

}  // namespace

ElementGeometry hex8_geometry() {
  return {.fill = &fill_points, .lump = &lump, .length = &hex_length, .order = hex_vtk_of_binary};
}

ElementGeometry hex8_one_point_geometry() {
  return {
      .fill = &fill_one_point, .lump = &lump, .length = &hex_length, .order = hex_vtk_of_binary};
}

}  // namespace ocublast::solid
