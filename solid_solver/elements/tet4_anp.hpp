#pragma once

// Tetrahedron with averaged nodal pressure (Bonet & Burton 1998): linear displacement, one point;
// the dilatation is averaged at nodes over the tets of one material, J_a - 1 = sum V_e/4 (J_e - 1)
// / V_a, V_a = sum V_e/4, and the pressure of a tet is the mean of dU/dJ at its four nodes. Energy:
// sum_e V_e psi_iso(F_e) + sum_a V_a U(J_a), so forces are its exact derivative. Two passes.

#include "solid_solver/elements/cell_means.hpp"
#include "solid_solver/elements/kernel_table.hpp"
#include "solid_solver/elements/lanes.hpp"

namespace ocublast::solid {
namespace {

template <class Law, int W>
struct Tet4Anp {
  using V = Lanes<W>;
  static constexpr int n_reference = 10 * batch_lanes;

  /// grad u from the first three nodes' gradients; the fourth is minus their sum.
  OCU_LANE_INLINE void displacement_gradient(const BlockView& block, std::int64_t batch, int lane,
                                             const double* u, V g[9], V H[9]) {
    const std::int32_t* nodes = block.nodes + batch * 4 * batch_lanes + lane;
    V n[4][3];
    for (int a = 0; a < 4; ++a) gather<W>(u, nodes + a * batch_lanes, n[a]);
    const double* ref = block.reference + batch * n_reference + lane;
    for (int i = 0; i < 9; ++i) g[i] = load<W>(ref + i * batch_lanes);
    for (int i = 0; i < 3; ++i) {
      const V a = n[0][i] - n[3][i];
      const V b = n[1][i] - n[3][i];
      const V c = n[2][i] - n[3][i];
      for (int j = 0; j < 3; ++j) H[3 * i + j] = a * g[j] + (b * g[3 + j] + c * g[6 + j]);
    }
  }
  OCU_LANE_INLINE V volume_of(const BlockView& block, std::int64_t batch, int lane) {
    return load<W>(block.reference + batch * n_reference + 9 * batch_lanes + lane);
  }
  OCU_LANE_INLINE const std::int32_t* pressure_nodes(const BlockView& block, std::int64_t batch,
                                                     int lane) {
    return block.pressure_nodes + batch * 4 * batch_lanes + lane;
  }
  OCU_LANE_INLINE void load_constants(const BlockView& block, std::int64_t batch, int lane, V* c) {
    for (int k = 0; k < Law::n_constants; ++k)
      c[k] = load<W>(block.constants + (batch * Law::n_constants + k) * batch_lanes + lane);
  }
  OCU_LANE_INLINE V mean_pressure(const BlockView& block, std::int64_t batch, int lane) {
    const std::int32_t* p = pressure_nodes(block, batch, lane);
    V sum{};
    for (int a = 0; a < 4; ++a) sum += gather_scalar<W>(block.nodal_pressure, p + a * batch_lanes);
    return 0.25 * sum;
  }

  static void volume(const BlockView& block, const KernelStep& step, std::int64_t begin,
                     std::int64_t end) noexcept {
    for (std::int64_t batch = begin; batch < end; ++batch)
      for (int lane = 0; lane < batch_lanes; lane += W) {
        V g[9];
        V H[9];
        displacement_gradient(block, batch, lane, step.displacement, g, H);
        const V share = 0.25 * volume_of(block, batch, lane) * dilatation_of<Law>(H);
        scatter_add_scalar<W, 4>(block.nodal_volume_change, pressure_nodes(block, batch, lane),
                                 share);
      }
  }

  static void pressure(const BlockView& block, std::int64_t begin, std::int64_t end) noexcept {
    for (std::int64_t a = begin; a < end; ++a) {
      const double* constants = block.nodal_constants + a * Law::n_constants;
      block.nodal_pressure[a] = Law::template volumetric_stress<double>(
          constants, block.nodal_volume_change[a] / block.nodal_volume[a]);
    }
  }

  static void force(const BlockView& block, const KernelStep& step, std::int64_t begin,
                    std::int64_t end, KernelSums& sums) noexcept {
    typename LaneTypes<W>::Integer bad{};
    V work{};
    for (std::int64_t batch = begin; batch < end; ++batch)
      for (int lane = 0; lane < batch_lanes; lane += W) {
        V N[9];
        Gradient<V> g;
        displacement_gradient(block, batch, lane, step.displacement, N, g.H);
        complete<Law>(g);
        bad |= g.j > -1.0 ? typename LaneTypes<W>::Integer{} : typename LaneTypes<W>::Integer{} + 1;
        V c[Law::n_constants];
        load_constants(block, batch, lane, c);
        V mean_stress = mean_pressure(block, batch, lane);
        const V w = volume_of(block, batch, lane);
        if (step.inverse_step > 0.0)
          mean_stress +=
              Hex8Q1P0<Law, W>::viscous_stress(block, batch, lane, g.j, w, step.inverse_step, work);
        V P[9];
        Law::template isochoric_stress<V>(c, g, P);
        V f[4][3];
        for (int i = 0; i < 3; ++i) {
          V p[3];
          for (int j = 0; j < 3; ++j) p[j] = w * (P[3 * i + j] + mean_stress * g.cof[3 * i + j]);
          for (int a = 0; a < 3; ++a)
            f[a][i] = p[0] * N[3 * a] + (p[1] * N[3 * a + 1] + p[2] * N[3 * a + 2]);
          f[3][i] = -(f[0][i] + (f[1][i] + f[2][i]));
        }
        scatter_add<W, 4>(step.force, block.nodes + batch * 4 * batch_lanes + lane, f);
      }
    for (int l = 0; l < W; ++l) {
      sums.viscous_work += work[l];
      sums.bad += static_cast<std::uint64_t>(bad[l]);
    }
  }

  /// As for hexes; the volumetric energy of a pressure node is shared by V_e/4 among its tets.
  static void evaluate(const BlockView& block, const double* u, std::int64_t begin,
                       std::int64_t end, double* out) noexcept {
    for (std::int64_t batch = begin; batch < end; ++batch)
      for (int lane = 0; lane < batch_lanes; lane += W) {
        V N[9];
        V H[9];
        displacement_gradient(block, batch, lane, u, N, H);
        V c[Law::n_constants];
        load_constants(block, batch, lane, c);
        const V w = volume_of(block, batch, lane);
        CellMeans<Law, W> means;
        means.add(c, H, mean_pressure(block, batch, lane), w);
        const std::int32_t* p = pressure_nodes(block, batch, lane);
        for (int a = 0; a < 4; ++a)
          means.add_volumetric(c,
                               gather_scalar<W>(block.nodal_volume_change, p + a * batch_lanes) /
                                   gather_scalar<W>(block.nodal_volume, p + a * batch_lanes),
                               0.25 * w);
        means.write(w, dilatation_of<Law>(H), out + batch * n_evaluated * batch_lanes + lane);
      }
  }
};

}  // namespace
}  // namespace ocublast::solid
