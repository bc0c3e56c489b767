#include "flow_solver/immersed/wall_path.hpp"

#include <algorithm>
#include <cmath>

#include "coupler/base/errors.hpp"

namespace ocublast::flow {
namespace {

/// Rounding of a time handed over as a product of step number and step length.
constexpr double time_rounding = 1e-9;

}  // namespace

WallPath::WallPath(std::span<const double> position)
    : x0_(position.begin(), position.end()), v0_(position.size(), 0.0), x1_(x0_), v1_(v0_) {}

void WallPath::begin_interval(double t_begin, double t_end) {
  OCU_ASSERT(t_end > t_begin);
  t_begin_ = t_begin;
  t_end_ = t_end;
  x0_.swap(x1_);
  v0_.swap(v1_);
}

void WallPath::set_cubic(double t_begin, double t_end, std::span<const double> position_end,
                         std::span<const double> velocity_end) {
  OCU_ASSERT(position_end.size() == x0_.size() && velocity_end.size() == x0_.size());
  begin_interval(t_begin, t_end);
  x1_.assign(position_end.begin(), position_end.end());
  v1_.assign(velocity_end.begin(), velocity_end.end());
  kind_ = Kind::cubic;
}

void WallPath::set_straight(double t_begin, double t_end, std::span<const double> position_end) {
  OCU_ASSERT(position_end.size() == x0_.size());
  begin_interval(t_begin, t_end);
  x1_.assign(position_end.begin(), position_end.end());
  const double per_time = 1.0 / (t_end - t_begin);
  for (std::size_t n = 0; n < x1_.size(); ++n) v0_[n] = v1_[n] = per_time * (x1_[n] - x0_[n]);
  kind_ = Kind::straight;
}

void WallPath::set_state(std::span<const double> position, std::span<const double> velocity,
                         std::span<const double> acceleration) {
  OCU_ASSERT(position.size() == x0_.size() && velocity.size() == x0_.size());
  x1_.assign(position.begin(), position.end());
  v1_.assign(velocity.begin(), velocity.end());
  acceleration_.assign(acceleration.begin(), acceleration.end());
  kind_ = Kind::given;
}

void WallPath::evaluate(double t, std::vector<double>& position, std::vector<double>& velocity,
                        std::vector<double>& acceleration) const {
  const double duration = t_end_ - t_begin_;
  const double slack = time_rounding * duration;
  position.resize(x0_.size());
  velocity.resize(x0_.size());
  acceleration.resize(x0_.size());
  if (kind_ == Kind::given) {
    position = x1_;
    velocity = v1_;
    acceleration = acceleration_;
    return;
  }
  if (kind_ == Kind::rest || t < t_begin_ - slack || t > t_end_ + slack) {
    const bool before = kind_ != Kind::rest && t < t_begin_;
    std::copy_n((before ? x0_ : x1_).begin(), x0_.size(), position.begin());
    std::fill(velocity.begin(), velocity.end(), 0.0);
    std::fill(acceleration.begin(), acceleration.end(), 0.0);
    return;
  }
  if (t >= t_end_ - slack || t <= t_begin_ + slack) {
    // The end states themselves, so that an interval ends where it was told to, to the last bit.
    const bool last = t >= t_end_ - slack;
    std::copy_n((last ? x1_ : x0_).begin(), x0_.size(), position.begin());
    std::copy_n((last ? v1_ : v0_).begin(), x0_.size(), velocity.begin());
    for (std::size_t n = 0; n < x0_.size(); ++n) {
      const double mean = (x1_[n] - x0_[n]) / duration;
      acceleration[n] = kind_ == Kind::straight ? 0.0
                        : last ? (2.0 * v0_[n] + 4.0 * v1_[n] - 6.0 * mean) / duration
                               : (6.0 * mean - 4.0 * v0_[n] - 2.0 * v1_[n]) / duration;
    }
    return;
  }
  const double s = (t - t_begin_) / duration;
  for (std::size_t n = 0; n < x0_.size(); ++n) {
    const double mean = (x1_[n] - x0_[n]) / duration;
    // Velocity v0 + 2 b s + 3 c s^2 of the cubic Hermite polynomial in s.
    const double b = 3.0 * mean - 2.0 * v0_[n] - v1_[n];
    const double c = v0_[n] + v1_[n] - 2.0 * mean;
    position[n] = x0_[n] + duration * s * (v0_[n] + s * (b + s * c));
    velocity[n] = v0_[n] + s * (2.0 * b + 3.0 * s * c);
    acceleration[n] = (2.0 * b + 6.0 * s * c) / duration;
  }
}

double WallPath::largest_speed(std::size_t v) const {
  if (kind_ == Kind::rest) return 0.0;
  double begin2 = 0.0;
  double middle2 = 0.0;
  double end2 = 0.0;
  for (std::size_t n = 3 * v; n < 3 * v + 3; ++n) {
    if (kind_ == Kind::given) {
      end2 += v1_[n] * v1_[n];
      continue;
    }
    const double middle = 1.5 * (x1_[n] - x0_[n]) / (t_end_ - t_begin_) - 0.25 * (v0_[n] + v1_[n]);
    begin2 += v0_[n] * v0_[n];
    middle2 += middle * middle;
    end2 += v1_[n] * v1_[n];
  }
  return std::sqrt(std::max({begin2, middle2, end2}));
}

}  // namespace ocublast::flow
