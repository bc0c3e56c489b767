#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <span>

namespace ocublast::flow {

/// Three components; what they mean (m, m/s, 1) is said where one is declared.
struct Vec3 {
  std::array<double, 3> c{};
  [[nodiscard]] constexpr double operator[](int a) const { return c[static_cast<std::size_t>(a)]; }
  [[nodiscard]] constexpr double& operator[](int a) { return c[static_cast<std::size_t>(a)]; }
};

[[nodiscard]] constexpr Vec3 operator+(const Vec3& a, const Vec3& b) noexcept {
  return {{a.c[0] + b.c[0], a.c[1] + b.c[1], a.c[2] + b.c[2]}};
}
[[nodiscard]] constexpr Vec3 operator-(const Vec3& a, const Vec3& b) noexcept {
  return {{a.c[0] - b.c[0], a.c[1] - b.c[1], a.c[2] - b.c[2]}};
}
[[nodiscard]] constexpr Vec3 operator*(double s, const Vec3& a) noexcept {
  return {{s * a.c[0], s * a.c[1], s * a.c[2]}};
}
[[nodiscard]] constexpr double dot(const Vec3& a, const Vec3& b) noexcept {
  return a.c[0] * b.c[0] + a.c[1] * b.c[1] + a.c[2] * b.c[2];
}
[[nodiscard]] constexpr Vec3 cross(const Vec3& a, const Vec3& b) noexcept {
  return {{a.c[1] * b.c[2] - a.c[2] * b.c[1], a.c[2] * b.c[0] - a.c[0] * b.c[2],
           a.c[0] * b.c[1] - a.c[1] * b.c[0]}};
}
[[nodiscard]] constexpr double norm2(const Vec3& a) noexcept {
  return dot(a, a);
}
[[nodiscard]] inline double norm(const Vec3& a) noexcept {
  return std::sqrt(norm2(a));
}
/// a / |a|; a itself where it is zero.
[[nodiscard]] inline Vec3 unit(const Vec3& a) noexcept {
  const double length = norm(a);
  return length > 0.0 ? (1.0 / length) * a : a;
}
/// Row v of an array [n, 3].
[[nodiscard]] inline Vec3 row(std::span<const double> array, std::int32_t v) noexcept {
  const std::size_t o = 3 * static_cast<std::size_t>(v);
  return {{array[o], array[o + 1], array[o + 2]}};
}

/// Axis-parallel box, m.
struct Box {
  Vec3 low{{HUGE_VAL, HUGE_VAL, HUGE_VAL}};
  Vec3 high{{-HUGE_VAL, -HUGE_VAL, -HUGE_VAL}};
  void include(const Vec3& x) noexcept {
    for (int a = 0; a < 3; ++a) {
      low[a] = x[a] < low[a] ? x[a] : low[a];
      high[a] = x[a] > high[a] ? x[a] : high[a];
    }
  }
  void include(const Box& b) noexcept {
    include(b.low);
    include(b.high);
  }
  [[nodiscard]] bool contains(const Vec3& x, double margin) const noexcept {
    for (int a = 0; a < 3; ++a) {
      if (x[a] < low[a] - margin || x[a] > high[a] + margin) return false;
    }
    return true;
  }
  [[nodiscard]] bool overlaps(const Box& b, double margin) const noexcept {
    for (int a = 0; a < 3; ++a) {
      if (b.high[a] < low[a] - margin || b.low[a] > high[a] + margin) return false;
    }
    return true;
  }
  /// Square of the distance [m] of x from the box, 0 inside.
  [[nodiscard]] double distance2(const Vec3& x) const noexcept {
    double d2 = 0.0;
    for (int a = 0; a < 3; ++a) {
      const double d = x[a] < low[a] ? low[a] - x[a] : (x[a] > high[a] ? x[a] - high[a] : 0.0);
      d2 += d * d;
    }
    return d2;
  }
};

}  // namespace ocublast::flow
