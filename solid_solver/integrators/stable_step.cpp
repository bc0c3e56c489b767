#include "solid_solver/integrators/stable_step.hpp"

#include <Eigen/Dense>
#include <cmath>
#include <vector>

#include "solid_solver/fields/aligned.hpp"

namespace ocublast::solid {
namespace {

using Vector = AlignedVector<double>;

/// a.M b over the directions that may move.
double mass_product(const Vector& a, const Vector& b, std::span<const double> inverse_mass,
                    const Team& team) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i)
    if (inverse_mass[i] > 0.0 && team.counts(i / 4)) sum += a[i] * b[i] / inverse_mass[i];
  return team.sum(sum);
}

void scale(Vector& y, double s) {
  for (auto& value : y) value *= s;
}

/// Rough in space, so that the stiffest modes are in it; the same in every run, by the numbers of
/// the whole mesh's nodes.
Vector start_vector(std::span<const double> inverse_mass, const Team& team) {
  Vector v(inverse_mass.size());
  std::uint64_t bits = 0x9e3779b97f4a7c15u;
  std::size_t drawn = 0;
  for (std::size_t i = 0; i < v.size(); ++i) {
    for (const std::size_t number = 4 * team.number(i / 4) + i % 4; drawn <= number; ++drawn)
      bits = bits * 6364136223846793005u + 1442695040888963407u;
    v[i] = (static_cast<double>(bits >> 11) * 0x1p-53 - 0.5) * std::sqrt(inverse_mass[i]);
  }
  return v;
}

double largest_eigenvalue(const std::vector<double>& alpha, const std::vector<double>& beta) {
  const auto n = static_cast<int>(alpha.size());
  Eigen::MatrixXd T = Eigen::MatrixXd::Zero(n, n);
  for (int i = 0; i < n; ++i) {
    T(i, i) = alpha[static_cast<std::size_t>(i)];
    if (i > 0) T(i, i - 1) = T(i - 1, i) = beta[static_cast<std::size_t>(i - 1)];
  }
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(T, Eigen::EigenvaluesOnly)
      .eigenvalues()(n - 1);
}

constexpr double converged_change =
    1e-4;  // of omega; the safety factor leaves a thousand times more

}  // namespace

Frequency largest_frequency(std::span<const double> inverse_mass, const StiffnessProduct& product,
                            int products, const Team& team) {
  Vector v = start_vector(inverse_mass, team);
  const double norm = std::sqrt(mass_product(v, v, inverse_mass, team));
  if (norm == 0.0) return {};
  scale(v, 1.0 / norm);
  // Three terms only, the last of which is made where the one before the last was: orthogonality
  // against older vectors is lost by and by, which repeats Ritz values already found but moves the
  // largest by no more than rounding (Paige 1972, whose order of operations this is).
  std::vector<double> alpha;
  std::vector<double> beta;
  Frequency found;
  Vector next(v.size());
  const TakePart take = [&](std::span<const double> y, double s) {
    for (std::size_t i = 0; i < y.size(); ++i) next[i] += s * inverse_mass[i] * y[i];
  };
  for (int k = 0; k < 2 * products; ++k) {
    scale(next, k > 0 ? -beta.back() : 0.0);
    product(v, take);
    alpha.push_back(mass_product(v, next, inverse_mass, team));
    for (std::size_t i = 0; i < v.size(); ++i) next[i] -= alpha.back() * v[i];
    const double omega = std::sqrt(std::max(0.0, largest_eigenvalue(alpha, beta)));
    found.last_change = omega > 0.0 ? std::abs(omega - found.omega) / omega : 0.0;
    found.omega = omega;
    found.products = k + 1;
    const double length = std::sqrt(mass_product(next, next, inverse_mass, team));
    if (k + 1 >= products && found.last_change < converged_change) break;
    if (length <= 1e-10 * std::abs(alpha.front())) break;  // the whole space is spanned
    beta.push_back(length);
    scale(next, 1.0 / length);
    v.swap(next);
  }
  return found;
}

double critical_step(double omega, double damping_ratio) {
  return 2.0 / omega * (std::sqrt(1.0 + damping_ratio * damping_ratio) - damping_ratio);
}

}  // namespace ocublast::solid
