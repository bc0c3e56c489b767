#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "coupler/relaxation.hpp"

using ocublast::coupler::make_relaxation;
using ocublast::coupler::RelaxationKind;

namespace {

/// H(x) = A x + b with the fixed point x* = 1 in every component; A is full, with entries up to
/// `size`.
struct Linear {
  std::size_t n;
  double size;
  [[nodiscard]] double a(std::size_t i, std::size_t j) const {
    return size * std::cos(1.0 + static_cast<double>(3 * i + 7 * j + i * j));
  }
  [[nodiscard]] std::vector<double> residual(const std::vector<double>& x) const {
    std::vector<double> r(n);
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = 0; j < n; ++j) r[i] += a(i, j) * (x[j] - 1.0);
      r[i] += 1.0 - x[i];
    }
    return r;
  }
};

double largest(const std::vector<double>& values) {
  double most = 0.0;
  for (const double v : values) most = std::max(most, std::abs(v));
  return most;
}

/// Largest residual after `iterations` steps from zero.
double residual_after(RelaxationKind kind, double factor, const Linear& problem, int iterations) {
  const auto relaxation = make_relaxation(kind, factor);
  relaxation->begin_window();
  std::vector<double> x(problem.n, 0.0);
  for (int k = 0; k < iterations; ++k) relaxation->advance(x, problem.residual(x));
  return largest(problem.residual(x));
}

}  // namespace

TEST(Relaxation, AitkenSolvesOneLinearEquationInTwoSteps) {
  // A factor of -5: the plain iteration diverges.
  EXPECT_NEAR(
      residual_after(RelaxationKind::aitken, 0.5, {.n = 1, .size = -5.0 / std::cos(1.0)}, 2), 0.0,
      1e-14);
}

TEST(Relaxation, InverseLeastSquaresSolvesNLinearEquationsInNPlusOneSteps) {
  const Linear problem{.n = 6, .size = 2.0};
  EXPECT_GT(residual_after(RelaxationKind::constant, 1.0, problem, 7), 1.0);
  // Round-off of the six-dimensional least squares, its condition some 1e3.
  EXPECT_LT(residual_after(RelaxationKind::iqn_ils, 0.1, problem, 7), 1e-10);
}

TEST(Relaxation, InverseLeastSquaresGoesOnAfterItHasConverged) {
  const Linear problem{.n = 3, .size = 0.5};
  // More iterations than dimensions: columns that depend on others are left out, nothing overflows.
  const double left = residual_after(RelaxationKind::iqn_ils, 0.5, problem, 40);
  EXPECT_TRUE(std::isfinite(left));
  EXPECT_LT(left, 1e-12);
}

TEST(Relaxation, EachWindowStartsAnew) {
  const Linear problem{.n = 4, .size = 0.7};
  for (const auto kind : {RelaxationKind::aitken, RelaxationKind::iqn_ils}) {
    const auto relaxation = make_relaxation(kind, 0.5);
    std::vector<std::vector<double>> ends;
    for (int window = 0; window < 2; ++window) {
      relaxation->begin_window();
      std::vector<double> x(problem.n, 0.0);
      for (int k = 0; k < 3; ++k) relaxation->advance(x, problem.residual(x));
      ends.push_back(x);
    }
    EXPECT_EQ(ends[0], ends[1]);
  }
}
