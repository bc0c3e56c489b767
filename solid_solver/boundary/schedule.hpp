#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace ocublast::solid {

/// Piecewise linear function of time, constant before its first and after its last point. Two
/// points at one time make a jump (the later value holds from that time on).
struct Schedule {
  std::vector<double> times;  ///< s, ascending
  std::vector<double> values;

  [[nodiscard]] double value(double t) const {
    if (times.empty()) return 0.0;
    const auto next = std::upper_bound(times.begin(), times.end(), t);
    if (next == times.begin()) return values.front();
    if (next == times.end()) return values.back();
    const auto k = static_cast<std::size_t>(next - times.begin());
    const double s = (t - times[k - 1]) / (times[k] - times[k - 1]);
    return values[k - 1] + s * (values[k] - values[k - 1]);
  }
  [[nodiscard]] double slope(double t) const {
    const auto next = std::upper_bound(times.begin(), times.end(), t);
    if (next == times.begin() || next == times.end()) return 0.0;
    const auto k = static_cast<std::size_t>(next - times.begin());
    return (values[k] - values[k - 1]) / (times[k] - times[k - 1]);
  }
  /// Integral from the first point's time to t.
  [[nodiscard]] double integral(double t) const {
    double sum = 0.0;
    for (std::size_t k = 1; k < times.size() && times[k - 1] < t; ++k) {
      const double end = std::min(t, times[k]);
      const double s =
          times[k] > times[k - 1] ? (end - times[k - 1]) / (times[k] - times[k - 1]) : 0.0;
      const double at_end = values[k - 1] + s * (values[k] - values[k - 1]);
      sum += 0.5 * (end - times[k - 1]) * (values[k - 1] + at_end);
    }
    if (!times.empty() && t > times.back()) sum += (t - times.back()) * values.back();
    return sum;
  }
  /// Integral of the integral, from the first point's time to t.
  [[nodiscard]] double double_integral(double t) const {
    double sum = 0.0;
    double slope_sum = 0.0;  // the integral at the end of what is done
    for (std::size_t k = 1; k < times.size() && times[k - 1] < t; ++k) {
      const double h = std::min(t, times[k]) - times[k - 1];
      const double s = times[k] > times[k - 1] ? h / (times[k] - times[k - 1]) : 0.0;
      const double end = values[k - 1] + s * (values[k] - values[k - 1]);
      sum += h * slope_sum + h * h * (values[k - 1] / 3.0 + end / 6.0);
      slope_sum += 0.5 * h * (values[k - 1] + end);
    }
    if (!times.empty() && t > times.back()) {
      const double h = t - times.back();
      sum += h * slope_sum + 0.5 * h * h * values.back();
    }
    return sum;
  }
  /// Whether the value is zero everywhere in [begin, end].
  [[nodiscard]] bool zero_in(double begin, double end) const {
    if (value(begin) != 0.0 || value(end) != 0.0) return false;
    for (std::size_t k = 0; k < times.size(); ++k)
      if (times[k] >= begin && times[k] <= end && values[k] != 0.0) return false;
    return true;
  }
};

}  // namespace ocublast::solid
