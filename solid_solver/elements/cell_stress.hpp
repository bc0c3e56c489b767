#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "solid_solver/elements/point_buffer.hpp"

namespace ocublast::solid {

/// Symmetric tensor xx, yy, zz, xy, yz, zx.
using Symmetric = std::array<double, 6>;

/// Eigenvalues, the largest first, by the trigonometric form on the deviator: round-off relative to
/// the deviator.
[[nodiscard]] inline std::array<double, 3> eigenvalues(const Symmetric& s) {
  const double mean = (s[0] + s[1] + s[2]) / 3.0;
  const double a = s[0] - mean;
  const double b = s[1] - mean;
  const double c = s[2] - mean;
  const double j2 = 0.5 * (a * a + b * b + c * c) + s[3] * s[3] + s[4] * s[4] + s[5] * s[5];
  if (j2 <= 0.0) return {mean, mean, mean};
  const double j3 =
      a * (b * c - s[4] * s[4]) - s[3] * (s[3] * c - s[4] * s[5]) + s[5] * (s[3] * s[4] - b * s[5]);
  const double angle =
      std::acos(std::clamp(1.5 * std::sqrt(3.0) * j3 / (j2 * std::sqrt(j2)), -1.0, 1.0)) / 3.0;
  const double radius = 2.0 * std::sqrt(j2 / 3.0);
  constexpr double third_turn = 2.09439510239319549231;
  const double first = radius * std::cos(angle);
  const double last = radius * std::cos(angle + third_turn);
  return {mean + first, mean - (first + last), mean + last};
}

/// Scalars of one cell that tables and pictures show.
struct CellScalars {
  double pressure = 0.0;                       ///< -tr(sigma)/3, over ambient, Pa
  double von_mises = 0.0;                      ///< Pa
  double principal_stress = 0.0;               ///< largest, Pa
  double principal_strain = 0.0;               ///< largest stretch less 1
  double deviatoric_norm = 0.0;                ///< sqrt(s:s) of the stress deviator, Pa
  std::array<double, 3> principal_stresses{};  ///< the largest first, Pa
  std::array<double, 3> principal_strains{};   ///< principal stretches less 1, the largest first
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
  auto strains = eigenvalues(twice_strain);
  for (auto& e : strains) e = e / (1.0 + std::sqrt(std::max(0.0, 1.0 + e)));
  const auto stresses = eigenvalues(s);
  return {.pressure = -mean,
          .von_mises = std::sqrt(3.0 * j2),
          .principal_stress = stresses[0],
          .principal_strain = strains[0],
          .deviatoric_norm = std::sqrt(2.0 * j2),
          .principal_stresses = stresses,
          .principal_strains = strains};
}

}  // namespace ocublast::solid
