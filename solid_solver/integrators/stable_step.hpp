#pragma once

#include <cstddef>
#include <functional>
#include <span>

#include "solid_solver/parallel/team.hpp"

namespace ocublast::solid {

/// Takes s y [n, 4] as a part of a product.
using TakePart = std::function<void(std::span<const double> y, double s)>;
/// K x of x [n, 4], in as many parts as it comes in: the caller adds them where it needs them.
using StiffnessProduct = std::function<void(std::span<const double> x, const TakePart& take)>;

struct Frequency {
  double omega = 0.0;  ///< largest angular frequency, rad/s
  int products = 0;
  double last_change = 0.0;  ///< relative change of omega by the last product
};

/// Largest angular frequency of M^-1 K by Lanczos in the M inner product: at least `products`
/// products, at most twice as many, until omega changes by less than 1e-4. Keeps two vectors. The
/// start vector is fixed, so the result is the same in every run. An underestimate: the largest
/// Ritz value approaches from below.
/// inverse_mass [n, 4] is 0 for fixed directions and the unused fourth.
/// Collective among the ranks of a team; the same bits on all.
[[nodiscard]] Frequency largest_frequency(std::span<const double> inverse_mass,
                                          const StiffnessProduct& product, int products,
                                          const Team& team = {});

/// Largest step of the central difference scheme with bulk viscosity, dt = 2/omega (sqrt(1 + xi^2)
/// - xi), xi the damping ratio of the highest mode (Belytschko, Liu & Moran 2000, section 6.2).
[[nodiscard]] double critical_step(double omega, double damping_ratio);

}  // namespace ocublast::solid
