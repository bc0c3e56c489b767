#pragma once

// What the unit tests of the immersed boundary share.

#include <numbers>

#include "flow_solver/immersed/surface.hpp"
#include "tests/unit/immersed_shapes.hpp"

namespace ocublast::flow::testing {

inline constexpr double p0 = 1e5;
inline constexpr double T0 = 300.0;

/// Half space below a line inclined by `degrees`, as a block much larger than the grid.
inline Body make_ramp(double degrees, WallSlip slip, double T_wall, bool moves) {
  const double angle = degrees * std::numbers::pi / 180.0;
  const double c = std::cos(angle), s = std::sin(angle);
  const auto at = [&](double t, double n) {
    return std::array<double, 2>{.5 + c * t - s * n, .37 + s * t + c * n};
  };
  // The wall in pieces of two cells, so that the read-out finds facets inside the grid.
  std::vector<std::array<double, 2>> polygon = {at(-3, -2), at(3, -2)};
  for (int n = 96; n >= -96; --n) polygon.push_back(at(n / 32.0, 0));
  return {.name = "ramp",
          .surface = make_prism(polygon, -1.0, 2.0),
          .slip = slip,
          .wall_temperature = T_wall,
          .moves = moves};
}

struct RampFrame {
  Vec3 n, t, foot;
  explicit RampFrame(double degrees) {
    const double angle = degrees * std::numbers::pi / 180.0;
    t = {{std::cos(angle), std::sin(angle), 0}};
    n = {{-std::sin(angle), std::cos(angle), 0}};
    foot = {{.5, .37, 0}};
  }
  [[nodiscard]] double height(double x, double y) const { return dot(Vec3{{x, y, 0}} - foot, n); }
};

/// Calls check(height of the ghost node above the wall, ghost state, layer) for all ghosts.
template <class Check>
void for_all_ghosts(const Grid& grid, const ImmersedBoundary& bodies, const RampFrame& frame,
                    const Check& check) {
  for (int a = 0; a < 2; ++a) {
    const CutLines& lines = bodies.lines(a);
    for (const Segment& s : lines.segments) {
      for (const int side : {-1, 1}) {
        const int wall = side < 0 ? s.wall_low : s.wall_high;
        if (wall < 0) continue;
        for (int layer = 0; layer < n_ghost; ++layer) {
          const int along = side < 0 ? s.begin - 1 - layer : s.end + layer;
          const double x = a == 0 ? grid.axis[0].x(along) : grid.axis[0].x(s.b);
          const double y = a == 1 ? grid.axis[1].x(along) : grid.axis[1].x(s.b);
          // Near the grid's rim the image lies beyond its ghosts.
          if (std::min({x, y, 1 - x, 1 - y}) < .2) continue;
          check(frame.height(x, y),
                &lines.ghost[(static_cast<std::size_t>(wall) * n_ghost + layer) * n_primitive],
                layer);
        }
      }
    }
  }
}

/// Moves all vertices by the same path of constant acceleration over [0, t].
inline void set_uniform_acceleration(ImmersedBoundary& bodies, std::size_t b, double t,
                                     const Vec3& a) {
  std::vector<double> x(bodies.position(b).begin(), bodies.position(b).end());
  std::vector<double> v(x.size());
  for (std::size_t n = 0; n < x.size(); ++n) {
    x[n] += .5 * a.c[n % 3] * t * t;
    v[n] = a.c[n % 3] * t;
  }
  bodies.set_path(b, 0.0, t, x, v);
}

}  // namespace ocublast::flow::testing
