#pragma once

#include <cstddef>
#include <functional>
#include <span>

#include "solid_solver/parallel/team.hpp"

namespace ocublast::solid {

/// y = K x on nodal arrays [n, 4].
using StiffnessProduct = std::function<void(std::span<const double> x, std::span<double> y)>;

struct Frequency {
  double omega = 0.0;  ///< largest angular frequency, rad/s
  int products = 0;
  double last_change = 0.0;  ///< relative change of omega by the last product
};

/// Largest angular frequency of M^-1 K by Lanczos in the M inner product with full
/// re-orthogonalisation: at least `products` products, at most twice as many, until omega changes
/// by less than 1e-4. The start vector is fixed, so the result is the same in every run. An
/// underestimate: the largest Ritz value approaches from below.
/// inverse_mass [n, 4] is 0 for fixed directions and the unused fourth.
/// Collective among the ranks of a team; the same bits on all.
[[nodiscard]] Frequency largest_frequency(std::span<const double> inverse_mass,
                                          const StiffnessProduct& product, int products,
                                          const Team& team = {});

/// Largest step of the central difference scheme with bulk viscosity, dt = 2/omega (sqrt(1 + xi^2)
/// - xi), xi the damping ratio of the highest mode (Belytschko, Liu & Moran 2000, section 6.2).
[[nodiscard]] double critical_step(double omega, double damping_ratio);

}  // namespace ocublast::solid
