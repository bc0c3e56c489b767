// Radial coordinates: conservation, gas at rest, order towards r = 0, Sedov's point blast.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <numbers>
#include <vector>

#include "coupler/base/errors.hpp"
#include "tests/verification/flow_run.hpp"

namespace ocublast::flow {
namespace {

Grid radial_grid(Geometry geometry, int n, double r_max, double r_min = 0.0) {
  Grid g = uniform_grid({n, geometry == Geometry::axisymmetric ? n : 1, 1}, {r_min, 0, 0},
                        {r_max, r_max, 1});
  g.geometry = geometry;
  return g;
}

FlowOptions options_of(Scheme scheme) {
  FlowOptions o = unit_options();
  o.scheme = scheme;
  return o;
}

const char* name_of(Scheme s) {
  return s == Scheme::muscl ? "muscl" : (s == Scheme::compact8 ? "compact8" : "compact6");
}
const char* name_of(Geometry g) {
  return g == Geometry::spherical ? "spherical"
                                  : (g == Geometry::cylindrical ? "cylindrical" : "axisymmetric");
}

constexpr Scheme schemes[] = {Scheme::compact6, Scheme::compact8, Scheme::muscl};
constexpr Geometry geometries[] = {Geometry::spherical, Geometry::cylindrical,
                                   Geometry::axisymmetric};

TEST(RadialGrid, KeepsGasAtRest) {
  for (const Scheme scheme : schemes) {
    for (const Geometry geometry : geometries) {
      AxisSpec spec{.min = 0.0,
                    .max = 1.0,
                    .spacing = 0.05,
                    .refined = true,
                    .zone_min = 0.2,
                    .zone_max = 0.4,
                    .zone_spacing = 0.02,
                    .growth = 1.1,
                    .low = {},
                    .high = {}};
      Grid g{{make_axis(spec),
              geometry == Geometry::axisymmetric ? make_uniform_axis(0, 1, 16) : make_absent_axis(),
              make_absent_axis()},
             geometry};
      Boundaries faces = all_faces(BoundaryKind::outflow);
      faces[0].kind = BoundaryKind::symmetry;
      Flow flow(g, faces, options_of(scheme));
      flow.set_state([](double, double, double) { return State{}; });
      for (int s = 0; s < 20; ++s) flow.advance(0.0, 0.5 * flow.stable_step());
      double worst = 0.0;
      for (int i = 0; i < g.axis[0].n; ++i)
        worst = std::max(worst, std::abs(flow.primitives()(1, i, 0, 0)));
      // The pressure enters as a plain difference of equal values; round-off of 20 steps.
      EXPECT_LT(worst, 1e-13) << name_of(scheme) << " " << name_of(geometry);
    }
  }
}

TEST(RadialGrid, KeepsMassAndEnergyInAClosedVessel) {
  for (const Scheme scheme : schemes) {
    for (const Geometry geometry : geometries) {
      const int n = geometry == Geometry::axisymmetric ? 48 : 200;
      Flow flow(radial_grid(geometry, n, 1.0), all_faces(BoundaryKind::symmetry),
                options_of(scheme));
      flow.set_state([](double x, double y, double) {
        const bool in = x * x + (y - 0.5) * (y - 0.5) < 0.35 * 0.35;
        return in ? State{.rho = 1.0, .p = 100.0} : State{.rho = 1.0, .p = 1.0};
      });
      const Totals before = flow.totals();
      const RunSummary run = run_to(flow, 0.1);
      const Totals after = flow.totals();
      std::printf("%s %s vessel: mass %.1e, energy %.1e relative, %d steps, %d redone\n",
                  name_of(scheme), name_of(geometry), after.mass / before.mass - 1.0,
                  after.energy / before.energy - 1.0, run.steps, run.redone);
      // Telescoping sums of area-weighted fluxes: round-off of some 1000 steps.
      EXPECT_NEAR(after.mass / before.mass, 1.0, 1e-12);
      EXPECT_NEAR(after.energy / before.energy, 1.0, 1e-12);
    }
  }
}

}  // namespace
}  // namespace ocublast::flow
