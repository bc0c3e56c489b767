#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "solid_solver/elements/point_buffer.hpp"

namespace ocublast::solid {

/// Symmetric tensor xx, yy, zz, xy, yz, zx.
using Symmetric = std::array<double, 6>;

/// Largest eigenvalue, by the trigonometric form on the deviator: round-off relative to the
/// deviator.
[[nodiscard]] inline double largest_eigenvalue(const Symmetric& s) {
  const double mean = (s[0] + s[1] + s[2]) / 3.0;
  const double a = s[0] - mean;
  const double b = s[1] - mean;
  const double c = s[2] - mean;
  const double j2 = 0.5 * (a * a + b * b + c * c) + s[3] * s[3] + s[4] * s[4] + s[5] * s[5];
  if (j2 <= 0.0) return mean;
  const double j3 =
      a * (b * c - s[4] * s[4]) - s[3] * (s[3] * c - s[4] * s[5]) + s[5] * (s[3] * s[4] - b * s[5]);
  const double angle =
      std::acos(std::clamp(1.5 * std::sqrt(3.0) * j3 / (j2 * std::sqrt(j2)), -1.0, 1.0)) / 3.0;
  return mean + 2.0 * std::sqrt(j2 / 3.0) * std::cos(angle);
}

/// Scalars of one cell that tables and pictures show.
struct CellScalars {
  double pressure = 0.0;          ///< -tr(sigma)/3, over ambient, Pa
  double von_mises = 0.0;         ///< Pa
  double principal_stress = 0.0;  ///< largest, Pa
  double principal_strain = 0.0;  ///< largest stretch less 1
  double deviatoric_norm = 0.0;   ///< sqrt(s:s) of the stress deviator, Pa
};

/// From the results of `evaluate` of one cell [n_evaluated].
[[nodiscard]] inline CellScalars cell_scalars(const double* cell) {
  Symmetric s;
  std::copy(cell + stress_xx, cell + stress_xx + 6, s.begin());
  const double mean = (s[0] + s[1] + s[2]) / 3.0;
  double j2 = s[3] * s[3] + s[4] * s[4] + s[5] * s[5];
  for (std::size_t i = 0; i < 3; ++i) j2 += 0.5 * (s[i] - mean) * (s[i] - mean);
  const double* H = cell + gradient_00;
  constexpr std::array<std::size_t, 6> row{0, 1, 2, 0, 1, 2};
  constexpr std::array<std::size_t, 6> column{0, 1, 2, 1, 2, 0};
  Symmetric twice_strain;  // C - I = H + H^T + H^T H
  for (std::size_t k = 0; k < 6; ++k) {
    twice_strain[k] = H[3 * row[k] + column[k]] + H[3 * column[k] + row[k]];
    for (std::size_t m = 0; m < 3; ++m) twice_strain[k] += H[3 * m + row[k]] * H[3 * m + column[k]];
  }
  const double e = largest_eigenvalue(twice_strain);
  return {.pressure = -mean,
          .von_mises = std::sqrt(3.0 * j2),
          .principal_stress = largest_eigenvalue(s),
          .principal_strain = e / (1.0 + std::sqrt(std::max(0.0, 1.0 + e))),
          .deviatoric_norm = std::sqrt(2.0 * j2)};
}

}  // namespace ocublast::solid
