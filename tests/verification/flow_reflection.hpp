#pragma once

// A shock reflected from an immersed slab, in either precision.

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "tests/verification/flow_run.hpp"

namespace ocublast::flow::inline OCU_PRECISION {

/// Box as a closed surface, outward triangles.
inline BodySurface make_box(const double lo[3], const double hi[3]) {
  BodySurface s;
  for (int c = 0; c < 8; ++c) {
    for (int a = 0; a < 3; ++a) s.vertices.push_back(((c >> a) & 1) != 0 ? hi[a] : lo[a]);
  }
  const std::int32_t quads[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                                    {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  for (const auto& q : quads) {
    for (int v : {0, 1, 2, 0, 2, 3}) s.triangles.push_back(q[v]);
  }
  return s;
}

struct Reflection {
  double plateau_error = 0.0;
  double peak = 0.0;
  double leak = 0.0;
  int redone = 0;
};

/// Shock of the given Mach number against an immersed slab that spans the channel; the gas behind
/// it must stay at rest. `axis`: direction of the shock.
inline Reflection reflect(double mach, double wall, double thickness, int axis, int threads = 1) {
  constexpr double g = 1.4;
  const double p2 = 1.0 + 2.0 * g / (g + 1.0) * (mach * mach - 1.0);
  const double rho2 = (g + 1.0) * mach * mach / ((g - 1.0) * mach * mach + 2.0);
  const double u2 = std::sqrt(g) * 2.0 / (g + 1.0) * (mach - 1.0 / mach);
  const double p5 = p2 * ((3.0 * g - 1.0) * p2 - (g - 1.0)) / ((g - 1.0) * p2 + (g + 1.0));
  constexpr int n = 200, across = 10;
  std::array<int, 3> cells{across, across, 1};
  if (axis == 2) cells = {across, 1, across};
  const auto a = static_cast<std::size_t>(axis);
  cells[a] = n;
  const double h = 1.0 / n;
  std::array<double, 3> lo{}, hi{1, 1, 1};
  for (std::size_t d = 0; d < 3; ++d) hi[d] = cells[d] == across ? across * h : 1.0;
  FlowOptions o = unit_options();
  o.threads = threads;
  Boundaries faces = all_faces(BoundaryKind::symmetry);
  State behind{.rho = rho2, .p = p2};
  (axis == 0 ? behind.u : (axis == 1 ? behind.v : behind.w)) = u2;
  faces[2 * a] = {.kind = BoundaryKind::fixed_state, .state = behind};
  const Grid grid = uniform_grid(cells, lo, hi);
  Flow flow(grid, faces, o);
  flow.set_state([&](double x, double y, double z) {
    const double s = ((axis == 0 ? x : (axis == 1 ? y : z)) - 0.4) / (0.5 * h);
    const double f = 0.5 * (1.0 - std::tanh(s));
    State m{.rho = 1.0 + f * (rho2 - 1.0), .p = 1.0 + f * (p2 - 1.0)};
    (axis == 0 ? m.u : (axis == 1 ? m.v : m.w)) = f * u2;
    return m;
  });
  double box_lo[3] = {-1, -1, -1}, box_hi[3] = {2, 2, 2};
  box_lo[a] = wall;
  box_hi[a] = wall + thickness;
  std::vector<Body> bodies(1);
  bodies[0].name = "slab";
  bodies[0].surface = make_box(box_lo, box_hi);
  ImmersedBoundary ib(grid, o.gas, bodies, {});
  ib.move_to(0.0);
  ib.update_topology(flow.primitives());
  flow.immerse(&ib);
  const double arrival = (wall - 0.4) / (mach * std::sqrt(g));
  const RunSummary run = run_to(flow, 2.0 * arrival);
  Reflection r;
  r.redone = run.redone;
  const auto W = flow.primitives();
  const int last = static_cast<int>(std::floor(wall / h - 0.5));
  double sum = 0.0;
  for (int i = 0; i < n; ++i) {
    for (int c = 0; c < across; ++c) {
      const int x[3] = {axis == 0 ? i : c, axis == 1 ? i : (axis == 0 ? c : 0), axis == 2 ? i : 0};
      const double p = W(0, x[0], x[1], x[2]) * W(4, x[0], x[1], x[2]);
      if (i > last - 10 && i <= last) sum += p / (10 * across);
      if (i <= last) r.peak = std::max(r.peak, p / p5 - 1.0);
      if ((i + 0.5) * h > wall + thickness) r.leak = std::max(r.leak, std::abs(p - 1.0));
    }
  }
  r.plateau_error = sum / p5 - 1.0;
  return r;
}

}  // namespace ocublast::flow
