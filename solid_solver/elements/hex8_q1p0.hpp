#pragma once

// Hexahedron Q1P0: trilinear displacement, 2x2x2 Gauss points, one dilatation per element, the mean
// of det F weighted by reference volume (Simo, Taylor & Pister 1985,
// DOI 10.1016/0045-7825(85)90033-7). Energy: sum_q w_q psi_iso(F_q) + V U(theta), theta - 1 = sum_q
// w_q (J_q - 1) / V. Total Lagrangian. Gradients by sum factorisation: the 8-point Hadamard
// transform of the nodal values gives the modes of (1 +- xi)(1 +- eta)(1 +- zeta); a derivative
// takes only 4 values per direction at the 8 points. Node order here is binary: bit 0 xi, bit 1
// eta, bit 2 zeta. The factor 1/8 is in the stored gradients.

#include "solid_solver/elements/cell_means.hpp"
#include "solid_solver/elements/kernel_table.hpp"
#include "solid_solver/elements/lanes.hpp"

namespace ocublast::solid {
namespace {

template <class Law, int W>
struct Hex8Q1P0 {
  using V = Lanes<W>;
  static constexpr int n_points = 8;
  static constexpr int n_reference = n_points * 10 * batch_lanes;
  static constexpr double gauss = 0.57735026918962576451;  // 1 / sqrt 3

  struct Element {
    V H[n_points][9];
    V dilatation;  ///< mean, theta - 1
    V volume;      ///< reference, m^3
  };

  /// Derivatives along xi, eta, zeta at the points: D[direction][point on the transverse face][i].
  OCU_LANE_INLINE void reference_gradients(const double* u, const std::int32_t* nodes,
                                           V D[3][4][3]) {
    V n[8][3];
    for (int a = 0; a < 8; ++a) gather<W>(u, nodes + a * batch_lanes, n[a]);
    for (int i = 0; i < 3; ++i) {
      V m[8];
      for (int a = 0; a < 8; ++a) m[a] = n[a][i];
      for (int bit = 1; bit < 8; bit <<= 1)
        for (int a = 0; a < 8; ++a)
          if ((a & bit) == 0) {
            const V sum = m[a] + m[a | bit];
            m[a | bit] = m[a | bit] - m[a];
            m[a] = sum;
          }
      m[3] *= gauss;
      m[5] *= gauss;
      m[6] *= gauss;
      m[7] *= gauss * gauss;
      spread(m[1], m[3], m[5], m[7], D[0], i);
      spread(m[2], m[3], m[6], m[7], D[1], i);
      spread(m[4], m[5], m[6], m[7], D[2], i);
    }
  }
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

  OCU_LANE_INLINE void displacement_gradients(const BlockView& block, std::int64_t batch, int lane,
                                              const double* u, Element& e) {
    V D[3][4][3];
    reference_gradients(u, block.nodes + batch * 8 * batch_lanes + lane, D);
    const double* ref = block.reference + batch * n_reference + lane;
    V sum = V{};
    V volume = V{};
    for (int q = 0; q < n_points; ++q, ref += 10 * batch_lanes) {
      const V* xi = D[0][q >> 1];
      const V* eta = D[1][(q & 1) | ((q >> 1) & 2)];
      const V* zeta = D[2][q & 3];
      V g[9];
      for (int i = 0; i < 9; ++i) g[i] = load<W>(ref + i * batch_lanes);
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
          e.H[q][3 * i + j] = xi[i] * g[j] + (eta[i] * g[3 + j] + zeta[i] * g[6 + j]);
      const V w = load<W>(ref + 9 * batch_lanes);
      sum += w * dilatation_of<Law>(e.H[q]);
      volume += w;
    }
    e.dilatation = sum / volume;
    e.volume = volume;
  }

  OCU_LANE_INLINE void load_constants(const BlockView& block, std::int64_t batch, int lane, V* c) {
    for (int k = 0; k < Law::n_constants; ++k)
      c[k] = load<W>(block.constants + (batch * Law::n_constants + k) * batch_lanes + lane);
  }

  /// Bulk viscosity: tension-positive stress from the rate of the mean dilatation; remembers both.
  OCU_LANE_INLINE V viscous_stress(const BlockView& block, std::int64_t batch, int lane,
                                   V dilatation, V volume, double inverse_step, V& work) {
    double* memory = block.memory + batch * 2 * batch_lanes + lane;
    const double* b = block.viscosity + batch * 2 * batch_lanes + lane;
    const V old = load<W>(memory);
    const V old_stress = load<W>(memory + batch_lanes);
    const V change = dilatation - old;
    const V rate = change * inverse_step / (1.0 + dilatation);
    // Linear part always, quadratic part in compression only.
    const V compression = rate < 0.0 ? rate : V{};
    const V stress = load<W>(b) * rate - load<W>(b + batch_lanes) * (compression * compression);
    work += volume * (0.5 * (stress + old_stress)) * change;
    store<W>(memory, dilatation);
    store<W>(memory + batch_lanes, stress);
    return stress;
  }

  /// Adds a point's P, turned to the directions, to the sums that the inverse transform needs.
  OCU_LANE_INLINE void add_point(const V P[9], const double* ref, V w, V xi[3], V eta[3],
                                 V zeta[3]) {
    V g[9];
    for (int i = 0; i < 9; ++i) g[i] = load<W>(ref + i * batch_lanes);
    for (int i = 0; i < 3; ++i) {
      const V a = w * P[3 * i];
      const V b = w * P[3 * i + 1];
      const V c = w * P[3 * i + 2];
      xi[i] += a * g[0] + (b * g[1] + c * g[2]);
      eta[i] += a * g[3] + (b * g[4] + c * g[5]);
      zeta[i] += a * g[6] + (b * g[7] + c * g[8]);
    }
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

  OCU_LANE_INLINE void scatter_forces(const V A[3][4][3], const std::int32_t* nodes,
                                      double* force) {
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
      for (int bit = 1; bit < 8; bit <<= 1)
        for (int a = 0; a < 8; ++a)
          if ((a & bit) == 0) {
            const V difference = m[a] - m[a | bit];
            m[a | bit] = m[a] + m[a | bit];
            m[a] = difference;
          }
      for (int a = 0; a < 8; ++a) f[a][i] = m[a];
    }
    scatter_add<W, 8>(force, nodes, f);
  }

  static void force(const BlockView& block, const KernelStep& step, std::int64_t begin,
                    std::int64_t end, KernelSums& sums) noexcept {
    typename LaneTypes<W>::Integer bad{};
    V work{};
    for (std::int64_t batch = begin; batch < end; ++batch)
      for (int lane = 0; lane < batch_lanes; lane += W) {
        Element e;
        displacement_gradients(block, batch, lane, step.displacement, e);
        V c[Law::n_constants];
        load_constants(block, batch, lane, c);
        V mean_stress = Law::template volumetric_stress<V>(c, e.dilatation);
        if (step.inverse_step > 0.0)
          mean_stress +=
              viscous_stress(block, batch, lane, e.dilatation, e.volume, step.inverse_step, work);
        V A[3][4][3] = {};
        const double* ref = block.reference + batch * n_reference + lane;
        for (int q = 0; q < n_points; ++q, ref += 10 * batch_lanes) {
          Gradient<V> g;
          for (int i = 0; i < 9; ++i) g.H[i] = e.H[q][i];
          complete<Law>(g);
          bad |=
              g.j > -1.0 ? typename LaneTypes<W>::Integer{} : typename LaneTypes<W>::Integer{} + 1;
          V P[9];
          Law::template isochoric_stress<V>(c, g, P);
          for (int i = 0; i < 9; ++i) P[i] += mean_stress * g.cof[i];
          add_point(P, ref, load<W>(ref + 9 * batch_lanes), A[0][q >> 1],
                    A[1][(q & 1) | ((q >> 1) & 2)], A[2][q & 3]);
        }
        scatter_forces(A, block.nodes + batch * 8 * batch_lanes + lane, step.force);
      }
    for (int l = 0; l < W; ++l) {
      sums.viscous_work += work[l];
      sums.bad += static_cast<std::uint64_t>(bad[l]);
    }
  }

  static void evaluate(const BlockView& block, const double* u, std::int64_t begin,
                       std::int64_t end, double* out) noexcept {
    for (std::int64_t batch = begin; batch < end; ++batch)
      for (int lane = 0; lane < batch_lanes; lane += W) {
        Element e;
        displacement_gradients(block, batch, lane, u, e);
        V c[Law::n_constants];
        load_constants(block, batch, lane, c);
        const V mean_stress = Law::template volumetric_stress<V>(c, e.dilatation);
        CellMeans<Law, W> means;
        const double* ref = block.reference + batch * n_reference + lane;
        for (int q = 0; q < n_points; ++q, ref += 10 * batch_lanes)
          means.add(c, e.H[q], mean_stress, load<W>(ref + 9 * batch_lanes));
        means.add_volumetric(c, e.dilatation, e.volume);
        means.write(e.volume, e.dilatation, out + batch * n_evaluated * batch_lanes + lane);
      }
  }
};

}  // namespace
}  // namespace ocublast::solid
