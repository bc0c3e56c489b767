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
  OCU_LANE_INLINE const std::int32_t* pressure_nodes(const BlockView& block, std::int64_t batch,
                                                     int lane) {
    return block.pressure_nodes + batch * 4 * batch_lanes + lane;
  }

  static void gradients(const BlockView& block, const double* u, std::int64_t begin,
                        std::int64_t end, PointBuffer& buffer) noexcept {
    for (std::int64_t batch = begin; batch < end; ++batch)
      for (int lane = 0; lane < batch_lanes; lane += W) {
        const std::int32_t* nodes = block.nodes + batch * 4 * batch_lanes + lane;
        const double* ref = reference(block, batch, lane);
        const auto p = batch - begin;
        if (lane == 0)
          prefetch(ref + batches_ahead * n_reference * batch_lanes, n_reference * batch_lanes);
        V n[4][3];
        for (int a = 0; a < 4; ++a) gather<W>(u, nodes + a * batch_lanes, n[a]);
        V g[9];
        for (int i = 0; i < 9; ++i) g[i] = load<W>(ref + i * batch_lanes);
        for (int i = 0; i < 3; ++i) {
          const V a = n[0][i] - n[3][i];
          const V b = n[1][i] - n[3][i];
          const V c = n[2][i] - n[3][i];
          for (int j = 0; j < 3; ++j)
            store<W>(&buffer.gradient[p][3 * i + j][lane],
                     a * g[j] + (b * g[3 + j] + c * g[6 + j]));
        }
        store<W>(&buffer.weight[p][lane], load<W>(ref + 9 * batch_lanes));
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

  static void add_volume(const BlockView& block, std::int64_t begin, std::int64_t end,
                         const PointBuffer& buffer) noexcept {
    for (std::int64_t batch = begin; batch < end; ++batch)
      for (int lane = 0; lane < batch_lanes; lane += W)
        scatter_add_scalar<W, 4>(block.nodal_volume_change, pressure_nodes(block, batch, lane),
                                 0.25 * load<W>(&buffer.mean_stress[batch - begin][lane]));
  }
  static void gather_pressure(const BlockView& block, std::int64_t begin, std::int64_t end,
                              PointBuffer& buffer) noexcept {
    for (std::int64_t batch = begin; batch < end; ++batch)
      for (int lane = 0; lane < batch_lanes; lane += W) {
        const std::int32_t* p = pressure_nodes(block, batch, lane);
        V sum{};
        for (int a = 0; a < 4; ++a)
          sum += gather_scalar<W>(block.nodal_pressure, p + a * batch_lanes);
        store<W>(&buffer.mean_stress[batch - begin][lane], 0.25 * sum);
      }
  }
  static constexpr ElementKernels table() {
    return {.gradients = &gradients,
            .forces = &forces,
            .add_volume = &add_volume,
            .gather_pressure = &gather_pressure};
  }
};

}  // namespace
}  // namespace ocublast::solid
