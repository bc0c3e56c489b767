#pragma once

#include <algorithm>
#include <vector>

#include "flow_solver/sources/radial_wave.hpp"

namespace ocublast::flow {

/// Overpressure at one distance, condensed: arrival at half of the first peak, impulse as the largest
/// value of the running integral.
struct Trace {
  double r = 0.0;
  double peak = 0.0;     ///< Pa
  double arrival = 0.0;  ///< s
  double impulse = 0.0;  ///< Pa s
};

/// Runs a wave to `end` [s] and traces it at distances.
inline std::vector<Trace> trace_wave(SteppedWave& wave, const std::vector<double>& radii, double end) {
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
    out.push_back(trace);
  }
  return out;
}

}  // namespace ocublast::flow
