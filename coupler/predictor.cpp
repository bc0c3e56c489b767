#include "coupler/predictor.hpp"

#include <algorithm>

namespace ocublast::coupler {
namespace {

__attribute__((target_clones("avx512f", "avx2", "default"))) void predict_second_order(const WallHistory& history, double width, std::span<double> position,
                          std::span<double> velocity) noexcept {
  const double ratio = width / history.width_before;
  const double half_width = 0.5 * width;
  const double* x = history.position.data();
  const double* v = history.velocity.data();
  const double* v_before = history.velocity_before.data();
  double* __restrict x_star = position.data();
  double* __restrict v_star = velocity.data();
  const std::size_t n = position.size();
  for (std::size_t i = 0; i < n; ++i) {
    const double v_end = v[i] + ratio * (v[i] - v_before[i]);
    x_star[i] = x[i] + half_width * (v[i] + v_end);  // constant acceleration: trapezium is exact
    v_star[i] = v_end;
  }
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

void predict_wall(const WallHistory& history, int order, double width, std::span<double> position,
                  std::span<double> velocity) noexcept {
  if (order >= 2 && !history.acceleration.empty()) {
    predict_with_acceleration(history, width, position, velocity);
    return;
  }
  if (order >= 2 && history.width_before > 0.0) {
    predict_second_order(history, width, position, velocity);
    return;
  }
  const double w = order >= 1 ? width : 0.0;
  for (std::size_t i = 0; i < position.size(); ++i)
    position[i] = history.position[i] + w * history.velocity[i];
  std::copy(history.velocity.begin(), history.velocity.end(), velocity.begin());
}

void keep_to_path(std::span<double> path, double width, double share, std::span<double> motion) noexcept {
  const std::size_t n = motion.size() / 2;
  for (std::size_t i = 0; i < n; ++i) {
    const double on_path = path[i] + 0.5 * width * (path[n + i] + motion[n + i]);
    path[i] = motion[i] = on_path + share * (motion[i] - on_path);
    path[n + i] = motion[n + i];
  }
}

}  // namespace ocublast::coupler
