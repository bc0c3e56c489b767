#include "flow_solver/sources/radial_wave.hpp"

#include <algorithm>
#include <utility>

namespace ocublast::flow::inline OCU_PRECISION {
namespace {

// The front is the outermost place with this part of the largest overpressure, and of ambient
// pressure.
constexpr double front_part = 0.01;
constexpr double front_least = 1e-3;

RadialState blend(const RadialState& a, const RadialState& b, double f) {
  const auto mix = [f](double x, double y) { return (1.0 - f) * x + f * y; };
  return {mix(a.rho, b.rho), mix(a.u, b.u), mix(a.p, b.p),
          mix(a.internal_energy, b.internal_energy)};
}

}  // namespace

void SteppedWave::keep(Snapshot snapshot) {
  double largest = 0.0;
  for (const RadialState& s : snapshot.state) largest = std::max(largest, s.p - ambient_.p);
  const double limit = std::max(front_part * largest, front_least * ambient_.p);
  snapshot.front = 0.0;
  for (std::size_t i = snapshot.r.size(); i > 0; --i) {
    if (snapshot.state[i - 1].p - ambient_.p < limit) continue;
    snapshot.front = snapshot.r[std::min(i, snapshot.r.size() - 1)];
    break;
  }
  history_.push_back(std::move(snapshot));
}

void SteppedWave::cover(double begin, double end) {
  while (history_.back().t < end) {
    step();
    // The last one at or before `begin` is needed for the times after it.
    while (history_.size() > 2 && history_[1].t <= begin) history_.pop_front();
  }
  while (history_.size() > 2 && history_[1].t <= begin) history_.pop_front();
}

double SteppedWave::run_to_front(double radius) {
  while (history_.back().front < radius) {
    step();
    while (history_.size() > 2) history_.pop_front();
  }
  return history_.back().t;
}

RadialState SteppedWave::sample(const Snapshot& s, double r) const {
  const auto above = std::lower_bound(s.r.begin(), s.r.end(), r);
  if (above == s.r.begin()) {
    RadialState first = s.state.front();
    first.u *= s.r.front() > 0.0 ? r / s.r.front() : 0.0;  // odd about r = 0
    return first;
  }
  if (above == s.r.end() && r < 2.0 * s.r.back() - s.r[s.r.size() - 2]) return s.state.back();
  if (above == s.r.end())
    return {ambient_.rho, 0.0, ambient_.p, ambient_.p / (gas_.heat_capacity_ratio - 1.0)};
  const auto i = static_cast<std::size_t>(above - s.r.begin());
  return blend(s.state[i - 1], s.state[i], (r - s.r[i - 1]) / (s.r[i] - s.r[i - 1]));
}

std::size_t SteppedWave::step_after(double t) const {
  const auto above = std::lower_bound(history_.begin(), history_.end(), t,
                                      [](const Snapshot& s, double time) { return s.t < time; });
  return std::min(static_cast<std::size_t>(above - history_.begin()), history_.size() - 1);
}

RadialState SteppedWave::at(double r, double t) const {
  const std::size_t n = step_after(t);
  if (n == 0 || history_[n].t <= t) return sample(history_[n], r);
  const Snapshot &a = history_[n - 1], &b = history_[n];
  return blend(sample(a, r), sample(b, r), (t - a.t) / (b.t - a.t));
}

double SteppedWave::front_radius(double t) const {
  return history_[step_after(t)].front;
}

}  // namespace ocublast::flow
