#include "coupler/predictor.hpp"

#include <algorithm>
#include <cstddef>

#include "coupler/base/wide_clones.hpp"
#include "coupler/link/payload.hpp"

namespace ocublast::coupler {
namespace {

inline double pull(const PathBegin& path, double x_before, double v_before, double x_end,
                   double v_end) noexcept {
  const double on_path = x_before + 0.5 * path.width * (v_before + v_end);
  return on_path + path.share * (x_end - on_path);
}

/// One pass over all: at large meshes memory is the limit.
template <bool follows>
inline __attribute__((always_inline)) bool predict_second_order(const WallHistory& history,
                                                                double width,
                                                                std::span<double> position,
                                                                std::span<double> velocity,
                                                                PathBegin path) noexcept {
  const double ratio = width / history.width_before;
  const double half_width = 0.5 * width;
  const double* x = history.position.data();
  const double* v = history.velocity.data();
  const double* v_before = history.velocity_before.data();
  double* __restrict x_star = position.data();
  double* __restrict v_star = velocity.data();
  const std::size_t n = position.size();
  const double* x_path = path.motion.data();
  const double* v_path = x_path + (follows ? n : 0);
  // 0 x is 0 for a finite x and not a number else. Eight sums, so that the loop vectorises without
  // reordering any of them.
  constexpr std::size_t lanes = 8;
  double sums[lanes] = {};
  std::size_t i = 0;
  for (; i + lanes <= n; i += lanes)
    for (std::size_t k = 0; k < lanes; ++k) {
      const double v_end = v[i + k] + ratio * (v[i + k] - v_before[i + k]);
      double x_end =
          x[i + k] + half_width * (v[i + k] + v_end);  // constant acceleration: trapezium is exact
      if constexpr (follows) x_end = pull(path, x_path[i + k], v_path[i + k], x_end, v_end);
      x_star[i + k] = x_end;
      v_star[i + k] = v_end;
      sums[k] += 0.0 * (x_end + v_end);
    }
  for (; i < n; ++i) {
    const double v_end = v[i] + ratio * (v[i] - v_before[i]);
    double x_end = x[i] + half_width * (v[i] + v_end);
    if constexpr (follows) x_end = pull(path, x_path[i], v_path[i], x_end, v_end);
    x_star[i] = x_end;
    v_star[i] = v_end;
    sums[0] += 0.0 * (x_end + v_end);
  }
  double sum = 0.0;
  for (const double s : sums) sum += s;
  return sum == 0.0;
}

OCU_WIDE_CLONES bool predict_free(const WallHistory& history, double width,
                                  std::span<double> position, std::span<double> velocity) noexcept {
  return predict_second_order<false>(history, width, position, velocity, {});
}

OCU_WIDE_CLONES bool predict_on_path(const WallHistory& history, double width,
                                     std::span<double> position, std::span<double> velocity,
                                     const PathBegin& path) noexcept {
  return predict_second_order<true>(history, width, position, velocity, path);
}

void predict_with_acceleration(const WallHistory& history, double width, std::span<double> position,
                               std::span<double> velocity) noexcept {
  for (std::size_t i = 0; i < position.size(); ++i) {
    const double dv = width * history.acceleration[i];
    position[i] = history.position[i] + width * (history.velocity[i] + 0.5 * dv);
    velocity[i] = history.velocity[i] + dv;
  }
}

}  // namespace

bool predict_wall(const WallHistory& history, int order, double width, std::span<double> position,
                  std::span<double> velocity, const PathBegin& path) noexcept {
  const bool accelerated = order >= 2 && !history.acceleration.empty();
  if (order >= 2 && !accelerated && history.width_before > 0.0)
    return path.motion.empty() ? predict_free(history, width, position, velocity)
                               : predict_on_path(history, width, position, velocity, path);
  if (accelerated) {
    predict_with_acceleration(history, width, position, velocity);
  } else {
    const double w = order >= 1 ? width : 0.0;
    for (std::size_t i = 0; i < position.size(); ++i)
      position[i] = history.position[i] + w * history.velocity[i];
    std::copy(history.velocity.begin(), history.velocity.end(), velocity.begin());
  }
  if (!path.motion.empty())
    for (std::size_t i = 0; i < position.size(); ++i)
      position[i] =
          pull(path, path.motion[i], path.motion[position.size() + i], position[i], velocity[i]);
  return link::all_finite(position) && link::all_finite(velocity);
}

}  // namespace ocublast::coupler
