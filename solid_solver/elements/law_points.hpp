#pragma once

// The kernels of one material law: stresses of points from their displacement gradients. The
// pressure comes from the dilatation averaged as the element wants it (Volumetric), so that every
// law works with every element. Energy: sum_q w_q psi_iso(F_q) + V U(averaged dilatation).

#include "solid_solver/elements/lanes.hpp"
#include "solid_solver/elements/overlay.hpp"

namespace ocublast::solid {
namespace {

template <class Law, int W>
struct LawPoints {
  using V = Lanes<W>;
  using Integer = typename LaneTypes<W>::Integer;
  static constexpr int n_values = Law::n_constants + Law::n_fields;
  static constexpr bool has_factors = requires(const V* c, const Gradient<V>& g, V& factor) {
    Law::template isochoric_factors<V>(c, g, factor, factor);
  };

  OCU_LANE_INLINE void load_values(const BlockView& block, std::int64_t batch, int lane, V* c) {
    for (int k = 0; k < n_values; ++k)
      c[k] = load<W>(block.constants + (batch * n_values + k) * batch_lanes + lane);
  }
  OCU_LANE_INLINE void load_gradient(const PointBuffer& buffer, int p, int lane, V H[9]) {
    for (int i = 0; i < 9; ++i) H[i] = load<W>(&buffer.gradient[p][i][lane]);
  }

  /// Bulk viscosity: tension-positive stress from the rate of the mean dilatation; remembers both.
  OCU_LANE_INLINE V viscous_stress(const BlockView& block, std::int64_t batch, int lane,
                                   V dilatation, V volume, double inverse_step, V& work) {
    double* memory = block.memory + batch * 2 * batch_lanes + lane;
    const double* b = block.viscosity + batch * 2 * batch_lanes + lane;
    const V change = dilatation - load<W>(memory);
    const V rate = change * inverse_step / (1.0 + dilatation);
    // Linear part always, quadratic part in compression only.
    const V compression = rate < 0.0 ? rate : V{};
    const V stress = load<W>(b) * rate - load<W>(b + batch_lanes) * (compression * compression);
    work += volume * (0.5 * (stress + load<W>(memory + batch_lanes))) * change;
    store<W>(memory, dilatation);
    store<W>(memory + batch_lanes, stress);
    return stress;
  }

  /// Stress of one point with its mean stress known; `g` is complete.
  OCU_LANE_INLINE void point_stress(const BlockView& block, std::int64_t batch, int lane, int q,
                                    double inverse_step, const V* c, const Gradient<V>& g, V w,
                                    V mean_stress, double* out, V& overlay_work) {
    if constexpr (has_factors) {
      if (block.overlay.state == nullptr) {
        V of_F;
        V of_cof;
        Law::template isochoric_factors<V>(c, g, of_F, of_cof);
        of_F *= w;
        of_cof = w * (of_cof + mean_stress);
        for (int i = 0; i < 9; ++i)
          store<W>(out + i * batch_lanes, of_F * deformation(g, i) + of_cof * g.cof[i]);
        return;
      }
    }
    V P[9];
    Law::template isochoric_stress<V>(c, g, P);
    if (block.overlay.state != nullptr)
      Overlay<W>::apply(block.overlay, batch, lane, block.n_points, q, inverse_step, g, w, P,
                        overlay_work);
    for (int i = 0; i < 9; ++i)
      store<W>(out + i * batch_lanes, w * (P[i] + mean_stress * g.cof[i]));
  }

  struct Sums {
    Integer bad{};
    V viscous{};
    V overlay{};
  };
  OCU_LANE_INLINE void note_bad(V j, Sums& sums) {
    sums.bad |= j > -1.0 ? Integer{} : Integer{} + 1;
  }

  /// Elements of one point: one pass.
  OCU_LANE_INLINE void single(const BlockView& block, double inverse_step, std::int64_t batch,
                              int p, int lane, PointBuffer& buffer, Sums& sums) {
    V c[n_values];
    load_values(block, batch, lane, c);
    Gradient<V> g;
    load_gradient(buffer, p, lane, g.H);
    complete<Law>(g);
    note_bad(g.j, sums);
    const V w = load<W>(&buffer.weight[p][lane]);
    V mean_stress = block.volumetric == Volumetric::nodal
                        ? load<W>(&buffer.mean_stress[p][lane])
                        : Law::template volumetric_stress<V>(c, g.j);
    if (inverse_step > 0.0)
      mean_stress += viscous_stress(block, batch, lane, g.j, w, inverse_step, sums.viscous);
    point_stress(block, batch, lane, 0, inverse_step, c, g, w, mean_stress,
                 &buffer.stress[p][0][lane], sums.overlay);
  }

  /// Elements of several points: dilatations first, for their mean, then stresses.
  OCU_LANE_INLINE void several(const BlockView& block, double inverse_step, std::int64_t batch,
                               int first, int lane, PointBuffer& buffer, Sums& sums) {
    V c[n_values];
    load_values(block, batch, lane, c);
    const int n = block.n_points;
    V sum{};
    V volume{};
    for (int q = 0; q < n; ++q) {
      V H[9];
      load_gradient(buffer, first + q, lane, H);
      const V j = dilatation_of<Law>(H);
      const V w = load<W>(&buffer.weight[first + q][lane]);
      note_bad(j, sums);
      sum += w * j;
      volume += w;
      store<W>(&buffer.mean_stress[first + q][lane], j);
    }
    const V mean = sum / volume;
    V viscous{};
    if (inverse_step > 0.0)
      viscous = viscous_stress(block, batch, lane, mean, volume, inverse_step, sums.viscous);
    const bool averaged = block.volumetric == Volumetric::mean;
    const V of_mean = Law::template volumetric_stress<V>(c, mean) + viscous;
    for (int q = 0; q < n; ++q) {
      Gradient<V> g;
      load_gradient(buffer, first + q, lane, g.H);
      complete<Law>(g);
      g.j = load<W>(&buffer.mean_stress[first + q][lane]);  // need not be found twice
      V stress = of_mean;
      if (!averaged) stress = Law::template volumetric_stress<V>(c, g.j) + viscous;
      point_stress(block, batch, lane, q, inverse_step, c, g,
                   load<W>(&buffer.weight[first + q][lane]), stress,
                   &buffer.stress[first + q][0][lane], sums.overlay);
    }
  }

  static void stress(const BlockView& block, double inverse_step, std::int64_t begin,
                     std::int64_t end, PointBuffer& buffer, KernelSums& total) noexcept {
    Sums sums;
    if (block.n_points == 1) {
      for (std::int64_t batch = begin; batch < end; ++batch)
        for (int lane = 0; lane < batch_lanes; lane += W)
          single(block, inverse_step, batch, static_cast<int>(batch - begin), lane, buffer, sums);
    } else {
      for (std::int64_t batch = begin; batch < end; ++batch)
        for (int lane = 0; lane < batch_lanes; lane += W)
          several(block, inverse_step, batch, static_cast<int>(batch - begin) * block.n_points,
                  lane, buffer, sums);
    }
    for (int l = 0; l < W; ++l) {
      total.viscous_work += sums.viscous[l];
      total.overlay_work += sums.overlay[l];
      total.bad += static_cast<std::uint64_t>(sums.bad[l]);
    }
  }

  static void nodal_pressure(const BlockView& block, std::int64_t begin,
                             std::int64_t end) noexcept {
    for (std::int64_t a = begin; a < end; ++a)
      block.nodal_pressure[a] = Law::template volumetric_stress<double>(
          block.nodal_constants + a * n_values,
          block.nodal_volume_change[a] / block.nodal_volume[a]);
  }

  /// U of the averaged dilatation, times the reference volume it belongs to, J.
  OCU_LANE_INLINE V volumetric_energy(const V* c, V j, V volume) {
    V energy{};
    for (int l = 0; l < W; ++l) {
      double values[n_values];
      for (int k = 0; k < n_values; ++k) values[k] = c[k][l];
      energy[l] = volume[l] * Law::volumetric_energy(values, j[l]);
    }
    return energy;
  }

  static void evaluate(const BlockView& block, std::int64_t begin, std::int64_t end,
                       const PointBuffer& buffer, double* out) noexcept {
    for (std::int64_t batch = begin; batch < end; ++batch)
      for (int lane = 0; lane < batch_lanes; lane += W)
        evaluate_element(block, batch, static_cast<int>(batch - begin) * block.n_points, lane,
                         buffer, out + (batch - begin) * n_evaluated * batch_lanes + lane,
                         static_cast<int>(batch - begin));
  }

  OCU_LANE_INLINE void evaluate_element(const BlockView& block, std::int64_t batch, int first,
                                        int lane, const PointBuffer& buffer, double* out,
                                        int element) {
    V c[n_values];
    load_values(block, batch, lane, c);
    V mean{};
    V reference{};
    for (int q = 0; q < block.n_points; ++q) {
      V H[9];
      load_gradient(buffer, first + q, lane, H);
      const V w = load<W>(&buffer.weight[first + q][lane]);
      mean += w * dilatation_of<Law>(H);
      reference += w;
    }
    mean /= reference;
    V kirchhoff[6] = {};
    V gradient[9] = {};
    V volume{};
    V energy{};
    V smallest = V{} + 1e300;
    V unused{};
    for (int q = 0; q < block.n_points; ++q) {
      Gradient<V> g;
      load_gradient(buffer, first + q, lane, g.H);
      complete<Law>(g);
      const V w = load<W>(&buffer.weight[first + q][lane]);
      V p;
      if (block.volumetric == Volumetric::nodal)
        p = load<W>(&buffer.mean_stress[first + q][lane]);
      else
        p = Law::template volumetric_stress<V>(c,
                                               block.volumetric == Volumetric::mean ? mean : g.j);
      V P[9];
      Law::template isochoric_stress<V>(c, g, P);
      if (block.overlay.state != nullptr)
        Overlay<W>::apply(block.overlay, batch, lane, block.n_points, q, 0.0, g, w, P, unused);
      for (int k = 0; k < 6; ++k) {
        V sum{};
        for (int m = 0; m < 3; ++m) {
          V F = V{} + (sym_column[k] == m ? 1.0 : 0.0);
          if constexpr (Law::finite_strain) F += g.H[3 * sym_column[k] + m];
          const int at = 3 * sym_row[k] + m;
          sum += (P[at] + p * g.cof[at]) * F;
        }
        kirchhoff[k] += w * sum;
      }
      for (int i = 0; i < 9; ++i) gradient[i] += w * g.H[i];
      volume += Law::finite_strain ? w * (1.0 + g.j) : w;
      smallest = g.j + 1.0 < smallest ? g.j + 1.0 : smallest;
      energy += w * Law::template isochoric_energy<V>(c, g);
      if (block.volumetric == Volumetric::point) energy += volumetric_energy(c, g.j, w);
    }
    if (block.volumetric == Volumetric::mean) energy += volumetric_energy(c, mean, reference);
    if (block.volumetric == Volumetric::nodal) {
      // The energy of a pressure node is shared by V/4 among its tets.
      const std::uint16_t* nodes = block.nodes + batch * 4 * batch_lanes + lane;
      for (int a = 0; a < 4; ++a)
        energy += volumetric_energy(
            c, gather_scalar<W>(block.dilatation_rows, nodes + a * batch_lanes), 0.25 * reference);
    }
    for (int k = 0; k < 6; ++k)
      store<W>(out + (stress_xx + k) * batch_lanes, kirchhoff[k] / volume);
    store<W>(out + dilatation_mean * batch_lanes, mean);
    store<W>(out + strain_energy * batch_lanes, energy);
    store<W>(out + Evaluated::hourglass_energy * batch_lanes,
             load<W>(&buffer.hourglass[element][lane]));
    for (int i = 0; i < 9; ++i)
      store<W>(out + (gradient_00 + i) * batch_lanes, gradient[i] / reference);
    store<W>(out + smallest_jacobian * batch_lanes, smallest);
  }

  /// By the same code as the elements.
  static double point(const double* values, const double H[9], double P[9]) noexcept {
    V c[n_values];
    for (int k = 0; k < n_values; ++k) c[k] = V{} + values[k];
    Gradient<V> g;
    for (int i = 0; i < 9; ++i) g.H[i] = V{} + H[i];
    complete<Law>(g);
    V stress[9];
    Law::template isochoric_stress<V>(c, g, stress);
    const V mean = Law::template volumetric_stress<V>(c, g.j);
    for (int i = 0; i < 9; ++i) P[i] = stress[i][0] + mean[0] * g.cof[i][0];
    return Law::template isochoric_energy<V>(c, g)[0] + Law::volumetric_energy(values, g.j[0]);
  }
};

template <class Law, int W>
LawKernels make_law_kernels() {
  using L = LawPoints<Law, W>;
  return {.stress = &L::stress,
          .nodal_pressure = &L::nodal_pressure,
          .evaluate = &L::evaluate,
          .point = &L::point};
}

}  // namespace
}  // namespace ocublast::solid
