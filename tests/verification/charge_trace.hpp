#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "flow_solver/sources/radial_wave.hpp"

namespace ocublast::flow {

/// Overpressure at one distance, condensed: arrival at half of the first peak, impulse as the
/// largest value of the running integral.
struct Trace {
  double r = 0.0;
  double peak =
      0.0;  ///< Pa, largest value: what a captured front, smeared over cells, leaves of it
  double front =
      0.0;  ///< Pa, the decay behind the front continued back to the arrival, as gauges are read
  double arrival = 0.0;  ///< s
  double impulse = 0.0;  ///< Pa s
};

/// ln p at 2, 3.5 and 5 rise times behind the arrival (a front is flat no longer than two),
/// continued as a parabola to the arrival.
inline double front_of(const std::vector<double>& t, const std::vector<double>& p, double arrival) {
  const auto peak = static_cast<std::size_t>(std::max_element(p.begin(), p.end()) - p.begin());
  const double rise = t[peak] - arrival;
  const double place[3] = {2.0, 3.5, 5.0};
  double y[3];
  for (int k = 0; k < 3; ++k) {
    const auto above = std::lower_bound(t.begin(), t.end(), arrival + place[k] * rise);
    if (above == t.end()) return p[peak];
    const auto i = static_cast<std::size_t>(above - t.begin());
    if (!(p[i] > 0.0)) return p[peak];
    y[k] = std::log(p[i]);
  }
  double sum = 0.0;
  for (int k = 0; k < 3; ++k) {
    double weight = 1.0;
    for (int m = 0; m < 3; ++m)
      if (m != k) weight *= place[m] / (place[m] - place[k]);
    sum += weight * y[k];
  }
  return std::exp(sum);
}

/// Runs a wave to `end` [s] and traces it at distances.
inline std::vector<Trace> trace_wave(SteppedWave& wave, const std::vector<double>& radii,
                                     double end) {
  struct History {
    std::vector<double> t, p;
  };
  std::vector<History> histories(radii.size());
  while (wave.time() < end) {
    const double t = wave.time();
    wave.cover(t, std::nextafter(t, 1e300));
    for (std::size_t i = 0; i < radii.size(); ++i) {
      histories[i].t.push_back(wave.time());
      histories[i].p.push_back(wave.at(radii[i], wave.time()).p - wave.ambient().p);
    }
  }
  std::vector<Trace> out;
  for (std::size_t i = 0; i < radii.size(); ++i) {
    const History& h = histories[i];
    Trace trace{.r = radii[i]};
    trace.peak = *std::max_element(h.p.begin(), h.p.end());
    double sum = 0.0;
    bool arrived = false;
    for (std::size_t s = 1; s < h.t.size(); ++s) {
      if (!arrived && h.p[s] >= 0.5 * trace.peak) {
        arrived = true;
        trace.arrival = h.t[s];
      }
      if (!arrived) continue;
      sum += 0.5 * (h.p[s] + h.p[s - 1]) * (h.t[s] - h.t[s - 1]);
      trace.impulse = std::max(trace.impulse, sum);
    }
    trace.front = front_of(h.t, h.p, trace.arrival);
    out.push_back(trace);
  }
  return out;
}

}  // namespace ocublast::flow
