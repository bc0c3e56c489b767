#pragma once

#include <array>

namespace ocublast {

/// Weights of the corners a, b, c (they sum to 1) at the point of the triangle nearest to p
/// (Ericson, Real-Time Collision Detection, 2005, section 5.1.5). Points have three components [0],
/// [1], [2].
template <class Point>
[[nodiscard]] std::array<double, 3> closest_weights(const Point& p, const Point& a, const Point& b,
                                                    const Point& c) {
  using Vector = std::array<double, 3>;
  const auto between = [](const Point& from, const Point& to) {
    return Vector{to[0] - from[0], to[1] - from[1], to[2] - from[2]};
  };
  const auto dot = [](const Vector& u, const Vector& v) {
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
  };
  const Vector ab = between(a, b);
  const Vector ac = between(a, c);
  const Vector ap = between(a, p);
  const double d1 = dot(ab, ap);
  const double d2 = dot(ac, ap);
  if (d1 <= 0.0 && d2 <= 0.0) return {1.0, 0.0, 0.0};
  const Vector bp = between(b, p);
  const double d3 = dot(ab, bp);
  const double d4 = dot(ac, bp);
  if (d3 >= 0.0 && d4 <= d3) return {0.0, 1.0, 0.0};
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) {
    const double v = d1 / (d1 - d3);
    return {1.0 - v, v, 0.0};
  }
  const Vector cp = between(c, p);
  const double d5 = dot(ab, cp);
  const double d6 = dot(ac, cp);
  if (d6 >= 0.0 && d5 <= d6) return {0.0, 0.0, 1.0};
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) {
    const double w = d2 / (d2 - d6);
    return {1.0 - w, 0.0, w};
  }
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0) {
    const double w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return {0.0, 1.0 - w, w};
  }
  const double sum = va + vb + vc;
  const double v = vb / sum;
  const double w = vc / sum;
  return {1.0 - v - w, v, w};
}

}  // namespace ocublast
