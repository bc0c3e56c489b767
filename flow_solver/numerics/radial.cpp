#include "flow_solver/numerics/radial.hpp"

#include <cmath>
#include <utility>

namespace ocublast::flow::inline OCU_PRECISION {
namespace {

double to_power(double r, int m) {
  return m == 2 ? r * r : r;
}

}  // namespace

RadialMetric make_radial_metric(const Grid& grid, bool mirrored_low, bool mirrored_high) {
  const Axis& axis = grid.axis[0];
  const int m = grid.radial_power(), n = axis.n;
  RadialMetric out;
  out.power = m;
  // Kernels read whole vectors along x, past the last ghost (as in make_line_metric).
  const auto size = static_cast<std::size_t>(n + 2 * table_offset + 32);
  out.node_weight.assign(size, 1.0);
  out.inverse_volume.assign(size, 1.0);
  out.face_area.assign(size, 1.0);
  out.power_over_r.assign(size, 0.0);
  out.filter_face.assign(size, 1.0);
  const auto at = [](int i) { return static_cast<std::size_t>(i + table_offset); };
  for (int i = -n_ghost; i < n + n_ghost; ++i) {
    int source = i;
    if (i < 0 && mirrored_low) source = -1 - i;
    if (i >= n && mirrored_high) source = 2 * n - 1 - i;
    const double r = axis.x(source);
    out.node_weight[at(i)] = to_power(std::abs(r), m);
    out.inverse_volume[at(i)] = 1.0 / (out.node_weight[at(i)] * axis.h(i));
    if (i >= 0 && i < n) out.power_over_r[at(i)] = m / r;
  }
  // Faces from the nodes' volumes. For equal cells the sum is r^3 - r h^2/4 (m = 2), r^2 (m = 1).
  const double h = axis.h(0);
  double r_face = axis.min;
  double sum = to_power(r_face, m) * r_face - (m == 2 ? 0.25 * h * h * r_face : 0.0);
  for (int j = 0; j <= n; ++j) {
    out.face_area[at(j)] = r_face > 0.0 ? sum / r_face : 0.0;
    if (j == n) break;
    sum += (m + 1) * to_power(axis.x(j), m) * axis.h(j);
    r_face += axis.h(j);
  }
  for (int g = 1; g <= n_ghost; ++g) {
    out.face_area[at(-g)] = out.face_area[at(mirrored_low ? g : 0)];
    out.face_area[at(n + g)] = mirrored_high ? out.face_area[at(n - g)] : out.face_area[at(n)];
  }
  for (int j = -n_ghost + 1; j < n + n_ghost; ++j) {
    out.filter_face[at(j)] = 0.5 * (axis.h(j) + axis.h(j - 1)) * out.face_area[at(j)];
  }
  return out;
}

StoredRadialMetric stored(RadialMetric m) {
  return {m.power,
          stored(std::move(m.node_weight)),
          stored(std::move(m.inverse_volume)),
          stored(std::move(m.face_area)),
          stored(std::move(m.power_over_r)),
          stored(std::move(m.filter_face))};
}

LineTable make_radial_table(const LineTable& plain, int power, bool from_axis) {
  LineTable t = plain;
  if (power != 1 || !from_axis) return t;
  // Faces 0 .. explicit_axis_faces are given; the rest is eliminated anew from there. Off-diagonals
  // are recovered from the plain rows.
  constexpr std::size_t lower_at = flux_weights, upper_at = flux_weights + 1,
                        pivot_at = flux_weights + 2;
  for (std::size_t parity = 0; parity < n_classes; ++parity) {
    double c_before = 0.0;
    for (int j = 0; j <= t.face_end; ++j) {
      const std::size_t at =
          static_cast<std::size_t>(j + table_offset) * flux_row_size + parity * flux_class_size;
      double* row = &t.flux[at];
      const double* old = &plain.flux[at];
      double lower = 0.0, upper = 0.0, pivot = j == 0 ? 0.0 : 1.0, scale = 0.0;
      if (old[pivot_at] == 0.0) {
        pivot = 0.0;
      } else if (j > explicit_axis_faces) {
        lower = old[lower_at] / old[pivot_at];
        upper = old[upper_at] / old[pivot_at];
        pivot = 1.0 / (1.0 - lower * c_before);
        scale = pivot / old[pivot_at];
      }
      for (std::size_t m = 0; m < flux_weights; ++m) row[m] = scale * old[m];
      row[lower_at] = lower * pivot;
      row[upper_at] = upper * pivot;
      row[pivot_at] = pivot;
      c_before = row[upper_at];
    }
  }
  return t;
}

}  // namespace ocublast::flow
