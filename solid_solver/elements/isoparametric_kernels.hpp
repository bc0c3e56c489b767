#pragma once

// Any isoparametric element by its stored shape gradients: N nodes, Q points. Reference per point:
// dN_a/dX_j (N x D, 1/m), [axisymmetric: N_a / R (N, 1/m)], weight (m^3). In the plane the third
// row of grad u is zero but for the hoop strain u_r / R of an axisymmetric body (x is the radius,
// y the axis; volumes are those of the whole ring). Plane strain has the thickness 1 m.

#include "solid_solver/elements/lanes.hpp"

namespace ocublast::solid {
namespace {

enum class Space { solid, plane_strain, axisymmetric };

template <int W, int N, int Q, Space space>
struct IsoparametricKernels {
  using V = Lanes<W>;
  static constexpr int n_points = Q;
  static constexpr int dimensions = space == Space::solid ? 3 : 2;
  static constexpr int per_node = space == Space::plane_strain ? 2 : 3;
  static constexpr int per_point = N * per_node + 1;
  static constexpr int n_reference = Q * per_point;

  OCU_LANE_INLINE void element_gradients(const BlockView& block, std::int64_t batch, int lane,
                                         const double* u, int first, PointBuffer& buffer) {
    const std::uint16_t* nodes = block.nodes + batch * N * batch_lanes + lane;
    V n[N][3];
    for (int a = 0; a < N; ++a) gather<W>(u, nodes + a * batch_lanes, n[a]);
    const double* ref = block.reference + batch * n_reference * batch_lanes + lane;
    for (int q = 0; q < Q; ++q, ref += per_point * batch_lanes) {
      V H[9] = {};
      for (int a = 0; a < N; ++a) {
        for (int j = 0; j < dimensions; ++j) {
          const V g = load<W>(ref + (a * per_node + j) * batch_lanes);
          for (int i = 0; i < dimensions; ++i) H[3 * i + j] += n[a][i] * g;
        }
        if constexpr (space == Space::axisymmetric)
          H[8] += n[a][0] * load<W>(ref + (a * per_node + 2) * batch_lanes);
      }
      for (int i = 0; i < 9; ++i) store<W>(&buffer.gradient[first + q][i][lane], H[i]);
      store<W>(&buffer.weight[first + q][lane], load<W>(ref + (per_point - 1) * batch_lanes));
    }
  }

  OCU_LANE_INLINE void element_forces(const BlockView& block, std::int64_t batch, int lane,
                                      int first, const PointBuffer& buffer, double* force) {
    V f[N][3] = {};
    const double* ref = block.reference + batch * n_reference * batch_lanes + lane;
    for (int q = 0; q < Q; ++q, ref += per_point * batch_lanes) {
      V P[9];
      for (int i = 0; i < 9; ++i) P[i] = load<W>(&buffer.stress[first + q][i][lane]);
      for (int a = 0; a < N; ++a) {
        for (int j = 0; j < dimensions; ++j) {
          const V g = load<W>(ref + (a * per_node + j) * batch_lanes);
          for (int i = 0; i < dimensions; ++i) f[a][i] += P[3 * i + j] * g;
        }
        if constexpr (space == Space::axisymmetric)
          f[a][0] += P[8] * load<W>(ref + (a * per_node + 2) * batch_lanes);
      }
    }
    scatter_add<W, N>(force, block.nodes + batch * N * batch_lanes + lane, f);
  }

  static void gradients(const BlockView& block, const double* u, std::int64_t begin,
                        std::int64_t end, PointBuffer& buffer) noexcept {
    for (std::int64_t batch = begin; batch < end; ++batch)
      for (int lane = 0; lane < batch_lanes; lane += W)
        element_gradients(block, batch, lane, u, static_cast<int>(batch - begin) * Q, buffer);
  }
  static void forces(const BlockView& block, std::int64_t begin, std::int64_t end,
                     const PointBuffer& buffer, double* force) noexcept {
    for (std::int64_t batch = begin; batch < end; ++batch)
      for (int lane = 0; lane < batch_lanes; lane += W)
        element_forces(block, batch, lane, static_cast<int>(batch - begin) * Q, buffer, force);
  }
  static constexpr ElementKernels table() { return {.gradients = &gradients, .forces = &forces}; }
};

}  // namespace
}  // namespace ocublast::solid
