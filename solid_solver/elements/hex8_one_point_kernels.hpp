#pragma once

// Trilinear hexahedron with one point and stiffness against its hourglass modes.
// Gradient: the exact volume mean (Flanagan & Belytschko 1981, DOI 10.1002/nme.1620170504), which
// passes the patch test on any shape. Hourglass amplitudes q_k = h_k . u - (h_k . X) . grad u are
// zero in every linear field, so rigid rotation costs nothing; energy 1/2 sum_k kappa_k |q_k|^2
// with kappa_k = c G V mean|grad mode_k|^2 / 64, a neo-Hookean G/2 |grad u|^2 of the mode on a
// cube. It scales with G only (with K it would lock). In a flat element the gradient along the
// mode's longest direction is taken for all: across the flat one the mode's parasitic shear would
// stiffen bending by the square of the aspect ratio.
// Everything in the Hadamard space of the nodal values (modes 1, 2, 4 linear; 3, 5, 6, 7
// hourglass). Reference: mean gradient of the modes 1..7 (21, 1/m), h_k . X (12, m), volume (m^3),
// kappa_k (4, N/m).

#include "solid_solver/elements/hex8_kernels.hpp"

namespace ocublast::solid {
namespace {

template <int W>
struct Hex8OnePointKernels {
  using V = Lanes<W>;
  static constexpr int n_points = 1;
  static constexpr int n_reference = 38;
  static constexpr int hourglass_modes[4] = {3, 5, 6, 7};

  OCU_LANE_INLINE void element_gradients(const BlockView& block, std::int64_t batch, int lane,
                                         const double* u, int p, PointBuffer& buffer) {
    const std::uint16_t* nodes = block.nodes + batch * 8 * batch_lanes + lane;
    V n[8][3];
    for (int a = 0; a < 8; ++a) gather<W>(u, nodes + a * batch_lanes, n[a]);
    V m[3][8];
    for (int i = 0; i < 3; ++i) {
      for (int a = 0; a < 8; ++a) m[i][a] = n[a][i];
      hadamard(m[i]);
    }
    const double* ref = block.reference + batch * n_reference * batch_lanes + lane;
    V H[9];
    for (int j = 0; j < 3; ++j) {
      V b[7];
      for (int k = 0; k < 7; ++k) b[k] = load<W>(ref + (3 * k + j) * batch_lanes);
      for (int i = 0; i < 3; ++i)
        H[3 * i + j] = (m[i][1] * b[0] + m[i][2] * b[1]) + (m[i][3] * b[2] + m[i][4] * b[3]) +
                       ((m[i][5] * b[4] + m[i][6] * b[5]) + m[i][7] * b[6]);
    }
    for (int i = 0; i < 9; ++i) store<W>(&buffer.gradient[p][i][lane], H[i]);
    store<W>(&buffer.weight[p][lane], load<W>(ref + 33 * batch_lanes));
    V energy{};
    for (int k = 0; k < 4; ++k) {
      V X[3];
      for (int j = 0; j < 3; ++j) X[j] = load<W>(ref + (21 + 3 * k + j) * batch_lanes);
      const V kappa = load<W>(ref + (34 + k) * batch_lanes);
      V square{};
      for (int i = 0; i < 3; ++i) {
        const V q = m[i][hourglass_modes[k]] -
                    (X[0] * H[3 * i] + (X[1] * H[3 * i + 1] + X[2] * H[3 * i + 2]));
        square += q * q;
        store<W>(&buffer.extra[p][3 * k + i][lane], kappa * q);
      }
      energy += (0.5 * kappa) * square;
    }
    store<W>(&buffer.hourglass[p][lane], energy);
  }

  OCU_LANE_INLINE void element_forces(const BlockView& block, std::int64_t batch, int lane, int p,
                                      const PointBuffer& buffer, double* force) {
    const double* ref = block.reference + batch * n_reference * batch_lanes + lane;
    V P[9];
    for (int i = 0; i < 9; ++i) P[i] = load<W>(&buffer.stress[p][i][lane]);
    V Q[4][3];
    for (int k = 0; k < 4; ++k)
      for (int i = 0; i < 3; ++i) Q[k][i] = load<W>(&buffer.extra[p][3 * k + i][lane]);
    for (int k = 0; k < 4; ++k)
      for (int j = 0; j < 3; ++j) {
        const V X = load<W>(ref + (21 + 3 * k + j) * batch_lanes);
        for (int i = 0; i < 3; ++i) P[3 * i + j] -= Q[k][i] * X;
      }
    V m[3][8];
    for (int k = 0; k < 7; ++k) {
      V b[3];
      for (int j = 0; j < 3; ++j) b[j] = load<W>(ref + (3 * k + j) * batch_lanes);
      for (int i = 0; i < 3; ++i)
        m[i][k + 1] = P[3 * i] * b[0] + (P[3 * i + 1] * b[1] + P[3 * i + 2] * b[2]);
    }
    V f[8][3];
    for (int i = 0; i < 3; ++i) {
      m[i][0] = V{};
      for (int k = 0; k < 4; ++k) m[i][hourglass_modes[k]] += Q[k][i];
      hadamard_transposed(m[i]);
      for (int a = 0; a < 8; ++a) f[a][i] = m[i][a];
    }
    scatter_add<W, 8>(force, block.nodes + batch * 8 * batch_lanes + lane, f);
  }

  static void gradients(const BlockView& block, const double* u, std::int64_t begin,
                        std::int64_t end, PointBuffer& buffer) noexcept {
    for (std::int64_t batch = begin; batch < end; ++batch)
      for (int lane = 0; lane < batch_lanes; lane += W)
        element_gradients(block, batch, lane, u, static_cast<int>(batch - begin), buffer);
  }
  static void forces(const BlockView& block, std::int64_t begin, std::int64_t end,
                     const PointBuffer& buffer, double* force) noexcept {
    for (std::int64_t batch = begin; batch < end; ++batch)
      for (int lane = 0; lane < batch_lanes; lane += W)
        element_forces(block, batch, lane, static_cast<int>(batch - begin), buffer, force);
  }
  static constexpr ElementKernels table() { return {.gradients = &gradients, .forces = &forces}; }
};

}  // namespace
}  // namespace ocublast::solid
