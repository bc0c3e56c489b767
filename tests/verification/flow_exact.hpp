#pragma once

#include <algorithm>
#include <cmath>

#include "flow_solver/boundary/boundary.hpp"

namespace ocublast::flow {

/// Exact solution of the Riemann problem for an ideal gas (Toro 2009, chapter 4), one ratio of heat
/// capacities on both sides, no vacuum.
class ExactRiemann {
 public:
  ExactRiemann(const State& left, const State& right, double gamma)
      : l_(left), r_(right), g_(gamma) {
    double p = 0.5 * (l_.p + r_.p);
    for (int n = 0; n < 100; ++n) {
      const double f = side(p, l_) + side(p, r_) + r_.u - l_.u;
      const double h = 1e-7 * p;
      const double slope = (side(p + h, l_) + side(p + h, r_) - side(p, l_) - side(p, r_)) / h;
      const double next = std::max(1e-12, p - f / slope);
      const bool done = std::abs(next - p) < 1e-14 * p;
      p = next;
      if (done) break;
    }
    p_ = p;
    u_ = 0.5 * (l_.u + r_.u) + 0.5 * (side(p, r_) - side(p, l_));
  }

  [[nodiscard]] double pressure_star() const { return p_; }
  [[nodiscard]] double velocity_star() const { return u_; }

  /// State on the ray x/t = s.
  [[nodiscard]] State at(double s) const {
    if (s < u_) return sample(s, l_, 1.0);
    State mirrored = r_;
    mirrored.u = -r_.u;
    State out = sample(-s, mirrored, -1.0);
    out.u = -out.u;
    return out;
  }

  /// Mean density of the cell [a, b] at time t, discontinuity at x = 0: fine midpoint rule.
  [[nodiscard]] double mean_density(double a, double b, double t) const {
    constexpr int points = 200;
    double sum = 0.0;
    for (int m = 0; m < points; ++m) sum += at((a + (m + 0.5) * (b - a) / points) / t).rho;
    return sum / points;
  }

 private:
  [[nodiscard]] double sound(const State& s) const { return std::sqrt(g_ * s.p / s.rho); }
  [[nodiscard]] double side(double p, const State& s) const {
    if (p > s.p) {
      const double a = 2.0 / ((g_ + 1.0) * s.rho), b = (g_ - 1.0) / (g_ + 1.0) * s.p;
      return (p - s.p) * std::sqrt(a / (p + b));
    }
    return 2.0 * sound(s) / (g_ - 1.0) * (std::pow(p / s.p, (g_ - 1.0) / (2.0 * g_)) - 1.0);
  }
  /// Left side of the contact; `sign` turns the star velocity for the mirrored right side.
  [[nodiscard]] State sample(double s, const State& k, double sign) const {
    const double us = sign * u_, c = sound(k);
    State out = k;
    if (p_ > k.p) {
      const double speed =
          k.u - c * std::sqrt((g_ + 1.0) / (2.0 * g_) * p_ / k.p + (g_ - 1.0) / (2.0 * g_));
      if (s < speed) return k;
      const double q = (g_ - 1.0) / (g_ + 1.0);
      out.rho = k.rho * (p_ / k.p + q) / (q * p_ / k.p + 1.0);
      out.u = us;
      out.p = p_;
      return out;
    }
    if (s < k.u - c) return k;
    const double c_star = c * std::pow(p_ / k.p, (g_ - 1.0) / (2.0 * g_));
    if (s > us - c_star) {
      out.rho = k.rho * std::pow(p_ / k.p, 1.0 / g_);
      out.u = us;
      out.p = p_;
      return out;
    }
    out.u = 2.0 / (g_ + 1.0) * (c + 0.5 * (g_ - 1.0) * k.u + s);
    const double cf = 2.0 / (g_ + 1.0) * (c + 0.5 * (g_ - 1.0) * (k.u - s));
    out.rho = k.rho * std::pow(cf / c, 2.0 / (g_ - 1.0));
    out.p = k.p * std::pow(cf / c, 2.0 * g_ / (g_ - 1.0));
    return out;
  }

  State l_, r_;
  double g_, p_ = 0.0, u_ = 0.0;
};

}  // namespace ocublast::flow
