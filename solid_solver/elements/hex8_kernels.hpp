#pragma once

// Trilinear hexahedron with 2x2x2 Gauss points, total Lagrangian. Gradients by sum factorisation:
// the 8-point Hadamard transform of the nodal values gives the modes of (1 +- xi)(1 +- eta)
// (1 +- zeta); a derivative takes only 4 values per direction at the 8 points. Node order here is
// binary: bit 0 xi, bit 1 eta, bit 2 zeta. The factor 1/8 is in the stored gradients.
// Reference per point: (1/8) d xi_k / d X_j (9, 1/m), weight (m^3).

#include "solid_solver/elements/lanes.hpp"

namespace ocublast::solid {
namespace {

/// Hadamard transform of 8 values in binary order, without scaling: m[k] = sum_a sign_k(a) n_a.
template <class V>
OCU_LANE_INLINE void hadamard(V m[8]) {
  for (int bit = 1; bit < 8; bit <<= 1)
    for (int a = 0; a < 8; ++a)
      if ((a & bit) == 0) {
        const V sum = m[a] + m[a | bit];
        m[a | bit] = m[a | bit] - m[a];
        m[a] = sum;
      }
}
/// Its transpose.
template <class V>
OCU_LANE_INLINE void hadamard_transposed(V m[8]) {
  for (int bit = 1; bit < 8; bit <<= 1)
    for (int a = 0; a < 8; ++a)
      if ((a & bit) == 0) {
        const V difference = m[a] - m[a | bit];
        m[a | bit] = m[a] + m[a | bit];
        m[a] = difference;
      }
}

template <int W>
struct Hex8Kernels {
  using V = Lanes<W>;
  static constexpr int n_points = 8;
  static constexpr int n_reference = n_points * 10;
  static constexpr double gauss = 0.57735026918962576451;  // 1 / sqrt 3

  /// Bilinear field constant + p first + q second + p q both at (p, q) = (-,-), (+,-), (-,+),
  /// (+,+).
  OCU_LANE_INLINE void spread(V constant, V first, V second, V both, V D[4][3], int i) {
    const V low = constant - second;
    const V high = constant + second;
    const V slope_low = first - both;
    const V slope_high = first + both;
    D[0][i] = low - slope_low;
    D[1][i] = low + slope_low;
    D[2][i] = high - slope_high;
    D[3][i] = high + slope_high;
  }
  /// Transpose of `spread`: adds to the four modes.
  OCU_LANE_INLINE void collect(const V A[4][3], int i, V& constant, V& first, V& second, V& both) {
    const V low = A[0][i] + A[1][i];
    const V high = A[2][i] + A[3][i];
    const V slope_low = A[1][i] - A[0][i];
    const V slope_high = A[3][i] - A[2][i];
    constant += low + high;
    second += high - low;
    first += slope_low + slope_high;
    both += slope_high - slope_low;
  }

  OCU_LANE_INLINE void element_gradients(const BlockView& block, std::int64_t batch, int lane,
                                         const double* u, int first, PointBuffer& buffer) {
    const std::uint16_t* nodes = block.nodes + batch * 8 * batch_lanes + lane;
    V n[8][3];
    for (int a = 0; a < 8; ++a) gather<W>(u, nodes + a * batch_lanes, n[a]);
    V D[3][4][3];  // along xi, eta, zeta: [direction][point on the transverse face][component]
    for (int i = 0; i < 3; ++i) {
      V m[8];
      for (int a = 0; a < 8; ++a) m[a] = n[a][i];
      hadamard(m);
      m[3] *= gauss;
      m[5] *= gauss;
      m[6] *= gauss;
      m[7] *= gauss * gauss;
      spread(m[1], m[3], m[5], m[7], D[0], i);
      spread(m[2], m[3], m[6], m[7], D[1], i);
      spread(m[4], m[5], m[6], m[7], D[2], i);
    }
    const double* ref = block.reference + batch * n_reference * batch_lanes + lane;
    for (int q = 0; q < n_points; ++q, ref += 10 * batch_lanes) {
      const V* xi = D[0][q >> 1];
      const V* eta = D[1][(q & 1) | ((q >> 1) & 2)];
      const V* zeta = D[2][q & 3];
      V g[9];
      for (int i = 0; i < 9; ++i) g[i] = load<W>(ref + i * batch_lanes);
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
          store<W>(&buffer.gradient[first + q][3 * i + j][lane],
                   xi[i] * g[j] + (eta[i] * g[3 + j] + zeta[i] * g[6 + j]));
      store<W>(&buffer.weight[first + q][lane], load<W>(ref + 9 * batch_lanes));
    }
  }

  OCU_LANE_INLINE void element_forces(const BlockView& block, std::int64_t batch, int lane,
                                      int first, const PointBuffer& buffer, double* force) {
    V A[3][4][3] = {};
    const double* ref = block.reference + batch * n_reference * batch_lanes + lane;
    for (int q = 0; q < n_points; ++q, ref += 10 * batch_lanes) {
      V* xi = A[0][q >> 1];
      V* eta = A[1][(q & 1) | ((q >> 1) & 2)];
      V* zeta = A[2][q & 3];
      V g[9];
      for (int i = 0; i < 9; ++i) g[i] = load<W>(ref + i * batch_lanes);
      for (int i = 0; i < 3; ++i) {
        const V a = load<W>(&buffer.stress[first + q][3 * i][lane]);
        const V b = load<W>(&buffer.stress[first + q][3 * i + 1][lane]);
        const V c = load<W>(&buffer.stress[first + q][3 * i + 2][lane]);
        xi[i] += a * g[0] + (b * g[1] + c * g[2]);
        eta[i] += a * g[3] + (b * g[4] + c * g[5]);
        zeta[i] += a * g[6] + (b * g[7] + c * g[8]);
      }
    }
    V f[8][3];
    for (int i = 0; i < 3; ++i) {
      V m[8] = {};
      collect(A[0], i, m[1], m[3], m[5], m[7]);
      collect(A[1], i, m[2], m[3], m[6], m[7]);
      collect(A[2], i, m[4], m[5], m[6], m[7]);
      m[3] *= gauss;
      m[5] *= gauss;
      m[6] *= gauss;
      m[7] *= gauss * gauss;
      hadamard_transposed(m);
      for (int a = 0; a < 8; ++a) f[a][i] = m[a];
    }
    scatter_add<W, 8>(force, block.nodes + batch * 8 * batch_lanes + lane, f);
  }

  static void gradients(const BlockView& block, const double* u, std::int64_t begin,
                        std::int64_t end, PointBuffer& buffer) noexcept {
    for (std::int64_t batch = begin; batch < end; ++batch)
      for (int lane = 0; lane < batch_lanes; lane += W)
        element_gradients(block, batch, lane, u, static_cast<int>(batch - begin) * n_points,
                          buffer);
  }
  static void forces(const BlockView& block, std::int64_t begin, std::int64_t end,
                     const PointBuffer& buffer, double* force) noexcept {
    for (std::int64_t batch = begin; batch < end; ++batch)
      for (int lane = 0; lane < batch_lanes; lane += W)
        element_forces(block, batch, lane, static_cast<int>(batch - begin) * n_points, buffer,
                       force);
  }
  static constexpr ElementKernels table() { return {.gradients = &gradients, .forces = &forces}; }
};

}  // namespace
}  // namespace ocublast::solid
