#pragma once

// Linear tetrahedron, one point, total Lagrangian. Reference: gradients of the first three nodes
// (9, 1/m; the fourth is minus their sum), volume (m^3). The nodal parts serve the averaged nodal
// pressure (Bonet & Burton 1998): J_a - 1 = sum V_e/4 (J_e - 1) / V_a over the tets of one
// material, and the pressure of a tet is the mean of dU/dJ at its four nodes; forces are the exact
// derivative of sum_e V_e psi_iso(F_e) + sum_a V_a U(J_a).

#include "solid_solver/elements/lanes.hpp"

namespace ocublast::solid {
namespace {

template <int W>
struct Tet4Kernels {
  using V = Lanes<W>;
  static constexpr int n_points = 1;
  static constexpr int n_reference = 10;
  static constexpr int batches_ahead = 8;  ///< one group: the next one waits in the cache

  OCU_LANE_INLINE const double* reference(const BlockView& block, std::int64_t batch, int lane) {
    return block.reference + batch * n_reference * batch_lanes + lane;
  }
  /// grad u from the values of the four nodes.
  OCU_LANE_INLINE void gradient(const V* n0, const V* n1, const V* n2, const V* n3,
                                const double* ref, V H[9]) {
    V g[9];
    for (int i = 0; i < 9; ++i) g[i] = load<W>(ref + i * batch_lanes);
    for (int i = 0; i < 3; ++i) {
      const V a = n0[i] - n3[i];
      const V b = n1[i] - n3[i];
      const V c = n2[i] - n3[i];
      for (int j = 0; j < 3; ++j) H[3 * i + j] = a * g[j] + (b * g[3 + j] + c * g[6 + j]);
    }
  }

  template <bool nodal>
  OCU_LANE_INLINE void element_gradients(const BlockView& block, std::int64_t batch, int lane,
                                         const double* rows, std::int64_t p, PointBuffer& buffer) {
    constexpr int C = nodal ? 4 : 3;
    const std::uint16_t* nodes = block.nodes + batch * 4 * batch_lanes + lane;
    const double* ref = reference(block, batch, lane);
    if (lane == 0)
      prefetch(ref + batches_ahead * n_reference * batch_lanes, n_reference * batch_lanes);
    V n[4][C];
    for (int a = 0; a < 4; ++a) gather<W, C>(rows, nodes + a * batch_lanes, n[a]);
    V H[9];
    gradient(n[0], n[1], n[2], n[3], ref, H);
    for (int i = 0; i < 9; ++i) store<W>(&buffer.gradient[p][i][lane], H[i]);
    store<W>(&buffer.weight[p][lane], load<W>(ref + 9 * batch_lanes));
    if constexpr (nodal)
      store<W>(&buffer.mean_stress[p][lane], 0.25 * ((n[0][3] + n[1][3]) + (n[2][3] + n[3][3])));
  }

  static void gradients(const BlockView& block, const double* rows, std::int64_t begin,
                        std::int64_t end, PointBuffer& buffer) noexcept {
    if (block.volumetric == Volumetric::nodal) {
      for (std::int64_t batch = begin; batch < end; ++batch)
        for (int lane = 0; lane < batch_lanes; lane += W)
          element_gradients<true>(block, batch, lane, rows, batch - begin, buffer);
    } else {
      for (std::int64_t batch = begin; batch < end; ++batch)
        for (int lane = 0; lane < batch_lanes; lane += W)
          element_gradients<false>(block, batch, lane, rows, batch - begin, buffer);
    }
  }

  static void forces(const BlockView& block, std::int64_t begin, std::int64_t end,
                     const PointBuffer& buffer, double* force) noexcept {
    for (std::int64_t batch = begin; batch < end; ++batch)
      for (int lane = 0; lane < batch_lanes; lane += W) {
        const double* ref = reference(block, batch, lane);
        const auto p = batch - begin;
        V g[9];
        for (int i = 0; i < 9; ++i) g[i] = load<W>(ref + i * batch_lanes);
        V f[4][3];
        for (int i = 0; i < 3; ++i) {
          V P[3];
          for (int j = 0; j < 3; ++j) P[j] = load<W>(&buffer.stress[p][3 * i + j][lane]);
          for (int a = 0; a < 3; ++a)
            f[a][i] = P[0] * g[3 * a] + (P[1] * g[3 * a + 1] + P[2] * g[3 * a + 2]);
          f[3][i] = -(f[0][i] + (f[1][i] + f[2][i]));
        }
        scatter_add<W, 4>(force, block.nodes + batch * 4 * batch_lanes + lane, f);
      }
  }

  template <bool finite_strain>
  OCU_LANE_INLINE void element_volume(const BlockView& block, std::int64_t batch, int lane,
                                      const double* rows, double* change) {
    const std::uint16_t* nodes = block.nodes + batch * 4 * batch_lanes + lane;
    const double* ref = reference(block, batch, lane);
    if (lane == 0)
      prefetch(ref + batches_ahead * n_reference * batch_lanes, n_reference * batch_lanes);
    V n[4][3];
    for (int a = 0; a < 4; ++a) gather<W>(rows, nodes + a * batch_lanes, n[a]);
    V H[9];
    gradient(n[0], n[1], n[2], n[3], ref, H);
    const V quarter = 0.25 * load<W>(ref + 9 * batch_lanes);
    const V j = finite_strain ? dilatation_finite(H) : H[0] + H[4] + H[8];
    scatter_add_scalar<W, 4>(change, nodes, quarter * j);
  }

  static void add_volume(const BlockView& block, const double* rows, bool finite_strain,
                         std::int64_t begin, std::int64_t end, double* change) noexcept {
    for (std::int64_t batch = begin; batch < end; ++batch)
      for (int lane = 0; lane < batch_lanes; lane += W)
        if (finite_strain)
          element_volume<true>(block, batch, lane, rows, change);
        else
          element_volume<false>(block, batch, lane, rows, change);
  }
  static constexpr ElementKernels table() {
    return {.gradients = &gradients, .forces = &forces, .add_volume = &add_volume};
  }
};

}  // namespace
}  // namespace ocublast::solid
