#include "flow_solver/numerics/line_table.hpp"

#include <array>
#include <cstddef>

namespace ocublast::flow::inline OCU_PRECISION {
namespace {

struct FluxWeights {
  double alpha, a, b, c;
};
// Lele (1992) sixth order in flux form, and its eighth-order tridiagonal relative.
constexpr FluxWeights sixth{1.0 / 3.0, 29.0 / 36.0, 1.0 / 36.0, 0.0};
constexpr FluxWeights eighth{3.0 / 8.0, 25.0 / 32.0 + 1.0 / 20.0 - 1.0 / 480.0,
                             1.0 / 20.0 - 1.0 / 480.0, -1.0 / 480.0};

/// Right-side weights of the filter of order 2 m in flux form: (-1)^(m+1) (1 - 2 alpha) / 4^m times
/// the difference of order 2 m - 1, written in pairs phi(j+p-1) - phi(j-p), p = 1..4.
std::array<double, 4> weights_of_filter(int m, double alpha) {
  const double s = 1.0 - 2.0 * alpha;
  switch (m) {
    case 1:
      return {s / 4.0, 0.0, 0.0, 0.0};
    case 2:
      return {3.0 * s / 16.0, -s / 16.0, 0.0, 0.0};
    case 3:
      return {10.0 * s / 64.0, -5.0 * s / 64.0, s / 64.0, 0.0};
    default:
      return {35.0 * s / 256.0, -21.0 * s / 256.0, 7.0 * s / 256.0, -s / 256.0};
  }
}

bool mirrored(LineEnd end) {
  return end == LineEnd::mirrored_slip || end == LineEnd::held_wall;
}

/// Rows of one solve with one parity class under construction.
struct ClassRows {
  std::vector<double>& rows;
  int row_size, n_weights, parity_class;
  const std::vector<std::array<double, 4>>& weights;  ///< of each face
  const std::vector<double>& alpha;

  void set(int j, double pivot, double lower, double upper) const {
    const auto s = static_cast<std::size_t>(j + table_offset);
    double* row = &rows[s * static_cast<std::size_t>(row_size) +
                        static_cast<std::size_t>(parity_class * (n_weights + 3))];
    for (int m = 0; m < n_weights; ++m) row[m] = pivot * weights[s][static_cast<std::size_t>(m)];
    row[n_weights] = lower * pivot;
    row[n_weights + 1] = upper * pivot;
    row[n_weights + 2] = pivot;
  }
  void clear(int j, double lower) const {
    set(j, 1.0, lower, 0.0);
    double* row =
        &rows[static_cast<std::size_t>(j + table_offset) * static_cast<std::size_t>(row_size) +
              static_cast<std::size_t>(parity_class * (n_weights + 3))];
    for (int m = 0; m < n_weights; ++m) row[m] = 0.0;
  }
};

/// Eliminates tri(alpha, 1, alpha) with the end rows of one class; `known` faces at known ends.
void eliminate(const ClassRows& out, const LineTable& t, LineEnd low, LineEnd high, bool filter,
               int known) {
  double c_before = 0.0;
  for (int j = t.face_begin; j <= t.face_end; ++j) {
    const bool below = low == LineEnd::known && j < known,
               above = high == LineEnd::known && j > t.n - known;
    if (below || above) {
      // A row without right side. Below, it hands on the value that the walk starts with.
      out.clear(j, below ? -1.0 : 0.0);
      c_before = 0.0;
      continue;
    }
    double lower = out.alpha[static_cast<std::size_t>(j + table_offset)];
    double upper = lower;
    double pivot = 1.0;
    const auto close = [&](LineEnd end, double& inwards, double& outwards) {
      outwards = 0.0;
      switch (mirror_row(out.parity_class, end == LineEnd::held_wall, filter)) {
        case MirrorRow::zero:
          inwards = pivot = 0.0;
          break;
        case MirrorRow::even:
          inwards *= 2.0;
          break;
        case MirrorRow::held:
          pivot = 1.0 / (1.0 + 2.0 * inwards);
          inwards = 0.0;
          break;
      }
    };
    if (j == 0 && mirrored(low)) close(low, upper, lower);
    if (j == t.n && mirrored(high)) close(high, lower, upper);
    if (j == t.face_begin) lower = 0.0;
    if (j == t.face_end) upper = 0.0;
    pivot /= 1.0 - lower * c_before;
    out.set(j, pivot, lower, upper);
    c_before = upper * pivot;
  }
}

/// Cyclic system by a rank-one update (Sherman and Morrison): rows of the plain system with changed
/// corners, and the correction vector z with its scale.
void eliminate_periodic(const ClassRows& out, int n, std::vector<double>& z, double& last,
                        double& scale) {
  // Corner -1 makes the first diagonal 2 and the last 1 + alpha^2: both stay away from zero.
  constexpr double corner = -1.0;
  const double alpha = out.alpha[table_offset];
  z.assign(static_cast<std::size_t>(n + 1), 0.0);
  std::vector<double> c(static_cast<std::size_t>(n), 0.0);
  for (int j = 0; j < n; ++j) {
    const auto s = static_cast<std::size_t>(j);
    double diagonal = 1.0;
    if (j == 0) diagonal -= corner;
    if (j == n - 1) diagonal -= alpha * alpha / corner;
    const double lower = j == 0 ? 0.0 : alpha, upper = j == n - 1 ? 0.0 : alpha;
    const double pivot = 1.0 / (diagonal - (j == 0 ? 0.0 : lower * c[s - 1]));
    out.set(j, pivot, lower, upper);
    c[s] = upper * pivot;
    const double rhs = (j == 0 ? corner : 0.0) + (j == n - 1 ? alpha : 0.0);
    z[s] = pivot * (rhs - (j == 0 ? 0.0 : lower * z[s - 1]));
  }
  for (int j = n - 2; j >= 0; --j) {
    z[static_cast<std::size_t>(j)] -=
        c[static_cast<std::size_t>(j)] * z[static_cast<std::size_t>(j + 1)];
  }
  z[static_cast<std::size_t>(n)] = z[0];
  last = alpha / corner;
  scale = 1.0 / (1.0 + z[0] + last * z[static_cast<std::size_t>(n - 1)]);
}

}  // namespace

LineTable make_line_table(int n, LineEnd low, LineEnd high, const LineScheme& scheme) {
  LineTable t;
  t.n = n;
  t.periodic = low == LineEnd::periodic;
  t.face_begin = low == LineEnd::ghosted ? -3 : 0;
  t.face_end = high == LineEnd::ghosted ? n + 3 : n;
  const auto faces = static_cast<std::size_t>(n + 2 * table_offset + 1);
  t.flux.assign(faces * flux_row_size, 0.0);
  t.filter.assign(faces * filter_row_size, 0.0);
  const EndRows flux_end = make_flux_end_rows(scheme);
  const EndRows filter_end = make_filter_end_rows(scheme);
  const double inner_alpha = flux_end.alpha[4];
  std::vector<std::array<double, 4>> flux_rows(faces), filter_rows(faces);
  std::vector<double> flux_alpha(faces, inner_alpha);
  std::vector<double> filter_alpha(faces, scheme.filter_alpha);
  for (int j = t.face_begin; j <= t.face_end; ++j) {
    const auto s = static_cast<std::size_t>(j + table_offset);
    // Faces between a face of the solve and the nearest end of the ghosted line, itself included.
    const int to_low = low == LineEnd::ghosted ? j + 4 : 4;
    const int to_high = high == LineEnd::ghosted ? n + 4 - j : 4;
    const int reach = to_low < to_high ? to_low : to_high;
    const int r = reach < 4 ? reach : 4;
    flux_alpha[s] = flux_end.alpha[r];
    filter_alpha[s] = filter_end.alpha[r];
    for (std::size_t m = 0; m < 4; ++m) {
      flux_rows[s][m] = flux_end.weights[r][m];
      filter_rows[s][m] = filter_end.weights[r][m];
    }
  }
  for (int parity_class = 0; parity_class < n_classes; ++parity_class) {
    const ClassRows flux{t.flux, flux_row_size, flux_weights, parity_class, flux_rows, flux_alpha};
    const ClassRows filter{t.filter,     filter_row_size, filter_weights,
                           parity_class, filter_rows,     filter_alpha};
    if (t.periodic) {
      eliminate_periodic(flux, n, t.flux_wrap, t.flux_wrap_last, t.flux_wrap_scale);
      eliminate_periodic(filter, n, t.filter_wrap, t.filter_wrap_last, t.filter_wrap_scale);
    } else {
      eliminate(flux, t, low, high, false, known_flux_faces(scheme.eighth_order));
      eliminate(filter, t, low, high, true, known_filter_faces);
    }
  }
  if (t.periodic) t.face_end = n - 1;
  return t;
}

StoredTable stored(LineTable t) {
  return {t.n,
          t.face_begin,
          t.face_end,
          t.periodic,
          stored(std::move(t.flux)),
          stored(std::move(t.filter)),
          stored(std::move(t.flux_wrap)),
          stored(std::move(t.filter_wrap)),
          t.flux_wrap_last,
          t.flux_wrap_scale,
          t.filter_wrap_last,
          t.filter_wrap_scale};
}

StoredMetric stored(LineMetric m) {
  return {stored(std::move(m.inverse_face_spacing)), stored(std::move(m.face_jacobian)),
          stored(std::move(m.inverse_jacobian)), stored(std::move(m.jacobian))};
}

EndRows make_flux_end_rows(const LineScheme& scheme) {
  EndRows e;
  for (int reach = 1; reach <= 4; ++reach) {
    FluxWeights w = scheme.eighth_order ? eighth : sixth;
    if (reach == 1) w = {0.0, 0.5, 0.0, 0.0};
    if (reach == 2) w = sixth;
    e.alpha[reach] = w.alpha;
    e.weights[reach][0] = w.a;
    e.weights[reach][1] = w.b;
    e.weights[reach][2] = w.c;
  }
  return e;
}

EndRows make_filter_end_rows(const LineScheme& scheme) {
  EndRows e;
  for (int reach = 1; reach <= 4; ++reach) {
    e.alpha[reach] = scheme.filter_alpha;
    const std::array<double, 4> k = weights_of_filter(reach, scheme.filter_alpha);
    for (std::size_t m = 0; m < 4; ++m) e.weights[reach][m] = k[m];
  }
  // No filter flux on the outermost face of the ghosts: a second-order one is proportional to the
  // slope there, and the implicit coupling carries a quarter of it to a wall four nodes inside; the
  // wall of a piston then seems displaced by a tenth of a cell.
  e.alpha[1] = 0.0;
  for (double& weight : e.weights[1]) weight = 0.0;
  return e;
}

LineMetric make_line_metric(const Axis& axis) {
  LineMetric m;
  // Kernels read whole vectors along x, past the last ghost.
  const auto size = static_cast<std::size_t>(axis.n + 2 * table_offset + 32);
  m.inverse_face_spacing.assign(size, 0.0);
  m.face_jacobian.assign(size, 1.0);
  m.inverse_jacobian.assign(size, 1.0);
  m.jacobian.assign(size, 1.0);
  if (!axis.present) return m;
  for (int i = -n_ghost; i < axis.n + n_ghost; ++i) {
    const auto s = static_cast<std::size_t>(i + table_offset);
    m.jacobian[s] = axis.h(i);
    m.inverse_jacobian[s] = 1.0 / axis.h(i);
    if (i == -n_ghost) continue;
    m.inverse_face_spacing[s] = 1.0 / (axis.x(i) - axis.x(i - 1));
    m.face_jacobian[s] = 0.5 * (axis.h(i) + axis.h(i - 1));
  }
  return m;
}

}  // namespace ocublast::flow
