// Shocks against fixed immersed walls: reflection at any sub-cell position, plates that must let
// nothing through, the sphere's symmetry.
#include <gtest/gtest.h>

#include "tests/verification/immersed_rig.hpp"

namespace ocublast::flow {
namespace {

using namespace testing;

struct Reflection {
  double error = 0.0;       ///< of the plateau pressure
  double wall_error = 0.0;  ///< of the pressure read at the wall at the end
  double overshoot = 0.0;   ///< of the wall pressure, of p5
  int redone = 0;
};

Reflection reflect_shock(double Ms, double offset, Scheme scheme = Scheme::compact6) {
  const int n = 200;
  const double h = 1.0 / n;
  const Grid grid{{make_uniform_axis(0, 1, n), make_absent_axis(), make_absent_axis()}};
  const flow::State behind = behind_shock(Ms);
  FlowOptions options = unit_gas_options();
  options.scheme = scheme;
  Flow flow = shock_into_rest(grid, behind, .5, h, options);
  const double wall = (159 + .5 + offset) * h;
  ImmersedBoundary bodies(grid, flow.options().gas,
                          {{.name = "wall", .surface = make_box({wall, -1, -1}, {2, 2, 2})}}, {});
  immerse(flow, bodies);
  const double p5 = reflected_pressure(behind.p);
  Reflection result;
  // To the wall, and .25 back.
  const double t_end = (wall - .5) / (Ms * std::sqrt(g)) + .25 / reflected_speed(behind);
  double last = 0.0;
  result.redone = run(flow, bodies, t_end, nothing_before, [&](double) {
                    const BodyLoad load = bodies.load(flow.primitives(), 0, 0.0);
                    last = load.force[0] / load.exposed_area;
                    result.overshoot = std::max(result.overshoot, last / p5 - 1.0);
                  }).redone;
  result.wall_error = last / p5 - 1.0;
  double mean = 0.0;
  int count = 0;
  for (int i = 0; i < n; ++i) {
    const double x = grid.axis[0].x(i);
    if (x < wall - .15 || x > wall - .03) continue;
    mean += pressure_at(flow, i);
    ++count;
  }
  result.error = std::abs(mean / count / p5 - 1.0);
  return result;
}

TEST(ImmersedShock, ReflectsAtAnySubCellPositionOfTheWall) {
  for (const double Ms : {1.2, 1.5, 3.0, 5.0, 10.0}) {
    for (const double offset : {.05, .30, .45, .50, .70, .95}) {
      const Reflection r = reflect_shock(Ms, offset);
      std::printf(
          "shock Ms %.1f, wall at node + %.2f h: p5 error %.2e, at the wall %+.2e, overshoot %.2f "
          "%%, steps redone %d\n",
          Ms, offset, r.error, r.wall_error, 100 * r.overshoot, r.redone);
      // The demand on the wall treatment.
      EXPECT_LT(r.error, 2e-3);
      EXPECT_LT(r.overshoot, .08);
    }
  }
}

TEST(ImmersedShock, ReflectsWithTheSecondSchemeToo) {
  for (const double Ms : {1.5, 5.0}) {
    double error = 0.0, overshoot = 0.0;
    for (const double offset : {.05, .30, .50, .70, .95}) {
      const Reflection r = reflect_shock(Ms, offset, Scheme::muscl);
      error = std::max(error, r.error);
      overshoot = std::max(overshoot, r.overshoot);
    }
    std::printf(
        "muscl, shock Ms %.1f at five places of a wall: p5 error at most %.2e, overshoot %.2f %%\n",
        Ms, error, 100 * overshoot);
    // Without the mirrored flux where gas streams at the wall, a wall on a node swallows the
    // stream.
    EXPECT_LT(error, 2e-3);
  }
}

/// A plate through the channel, its front face through (.5137, 4 h), turned by `degrees`.
struct PlateShock {
  double leak = 0.0;   ///< largest |p - p0| behind the plate
  double front = 0.0;  ///< error of the plateau pressure in front (square plates)
  double peak = 0.0;   ///< largest load in front, of p5 - p0
  std::uint64_t fallbacks = 0;
};

PlateShock hit_plate(double Ms, double cells, double degrees) {
  const int n = 200;
  const double h = 1.0 / n;
  const Grid grid{{make_uniform_axis(0, 1, n), make_uniform_axis(0, 8 * h, 8), make_absent_axis()}};
  const flow::State behind = behind_shock(Ms);
  Flow flow = shock_into_rest(grid, behind, .35, h);
  const double c = std::cos(degrees * std::numbers::pi / 180),
               s = std::sin(degrees * std::numbers::pi / 180);
  const auto at = [&](double t, double d) {
    return std::array<double, 2>{.5137 + c * d - s * t, 4 * h + s * d + c * t};
  };
  // Faces in pieces of a cell, so that the load finds facets inside the channel.
  std::vector<std::array<double, 2>> polygon;
  for (int q = 15; q >= -15; --q) polygon.push_back(at(q * h, 0));
  for (int q = -15; q <= 15; ++q) polygon.push_back(at(q * h, cells * h));
  ImmersedBoundary bodies(grid, flow.options().gas,
                          {{.name = "plate", .surface = make_prism(polygon, -1, 2)}}, {});
  immerse(flow, bodies);
  PlateShock result;
  const double p5 = reflected_pressure(behind.p);
  // To the plate, and until the reflected shock is .2 away from it.
  run(flow, bodies, .1637 / (Ms * std::sqrt(g)) + .2 / reflected_speed(behind), nothing_before,
      [&](double) {
        const BodyLoad load = bodies.load(flow.primitives(), 0, 1.0);
        result.peak = std::max(result.peak, load.force[0] / (8 * h) / 3.0 / (p5 - 1));  // 3 deep
      });
  double mean = 0.0;
  int count = 0;
  for (int j = 0; j < 8; ++j) {
    for (int i = 0; i < n; ++i) {
      const double d = c * (grid.axis[0].x(i) - .5137) + s * (grid.axis[1].x(j) - 4 * h);
      if (d > cells * h)
        result.leak = std::max(result.leak, std::abs(pressure_at(flow, i, j) - 1.0));
      if (d > -.12 && d < -.03) {
        mean += pressure_at(flow, i, j);
        ++count;
      }
    }
  }
  result.front = mean / count / p5 - 1.0;
  result.fallbacks = bodies.n_fallbacks();
  return result;
}

TEST(ImmersedPlate, LetsNothingThroughHoweverThin) {
  for (const double Ms : {1.5, 3.0, 5.0, 8.0}) {
    for (const double cells : {8.0, 1.0, .5, .1}) {
      for (const double degrees : {0.0, 10.0}) {
        if (degrees > 0.0 && (cells == .5 || Ms == 5.0)) continue;
        const PlateShock r = hit_plate(Ms, cells, degrees);
        std::printf(
            "plate of %.1f cells at %.0f degrees, Ms %.1f: behind it |p - p0| <= %.1e, plateau in "
            "front %+.2e, peak load in front %.3f of p5 - p0, fallbacks %llu\n",
            cells, degrees, Ms, r.leak, r.front, r.peak,
            static_cast<unsigned long long>(r.fallbacks));
        EXPECT_LE(r.leak, 1e-12);
        EXPECT_GT(r.peak, .9);
        if (degrees == 0.0) {
          EXPECT_LT(std::abs(r.front), 2e-3);
        }
      }
    }
  }
}

/// A stream that strikes a wall at supersonic speed has a second steady solution on the grid, in
/// which it vanishes in the wall: whether that one is met depends on where the wall lies.
TEST(ImmersedShock, IsSwallowedByNoWallWhereverItLies) {
  double worst = 0.0;
  for (const double Ms : {2.0, 4.0, 8.0, 20.0}) {
    for (int q = 0; q < 20; ++q) {
      const int n = 100;
      const double h = 1.0 / n;
      const Grid grid{{make_uniform_axis(0, 1, n), make_absent_axis(), make_absent_axis()}};
      const flow::State behind = behind_shock(Ms);
      Flow flow = shock_into_rest(grid, behind, .4, h);
      const double wall = (60.5 + .05 * q + .01) * h;
      ImmersedBoundary bodies(
          grid, flow.options().gas,
          {{.name = "wall", .surface = make_box({wall, -1, -1}, {wall + 8 * h, 2, 2})}}, {});
      immerse(flow, bodies);
      run(flow, bodies, (wall - .4) / (Ms * std::sqrt(g)) + .2 / reflected_speed(behind),
          nothing_before, nothing_after);
      const BodyLoad load = bodies.load(flow.primitives(), 0, 1.0);
      worst =
          std::max(worst, std::abs(load.force[0] / 9.0 / (reflected_pressure(behind.p) - 1) - 1));
    }
  }
  std::printf("shocks of Ms 2 to 20 at 20 places of a wall: load within %.1e of p5 - p0\n", worst);
  // Ringing on 100 cells; a swallowed stream leaves half of the load or less.
  EXPECT_LT(worst, .01);
}

TEST(ImmersedSphere, IsHitByAShockSymmetrically) {
  const int n = 24;
  const double h = 1.0 / n;
  const Grid grid{
      {make_uniform_axis(0, 1.5, 36), make_uniform_axis(0, 1, n), make_uniform_axis(0, 1, n)}};
  const flow::State behind = behind_shock(1.8);
  Flow flow = shock_into_rest(grid, behind, .3, h);
  ImmersedBoundary bodies(grid, flow.options().gas,
                          {{.name = "ball", .surface = make_sphere({.75, .5, .5}, .23, 4)}}, {});
  immerse(flow, bodies);
  double peak = 0.0;
  std::vector<double> p(bodies.position(0).size() / 3);
  run(flow, bodies, .5, nothing_before, [&](double) {
    bodies.read_overpressure(flow.primitives(), 0, 1.0, p);
    peak = std::max(peak, *std::max_element(p.begin(), p.end()));
  });
  double mirror = 0.0, turn = 0.0;
  std::size_t node = 0;
  for (int k = 0; k < n; ++k)
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < 36; ++i, ++node) {
        if (bodies.tags()[node] != tag_fluid) continue;
        mirror = std::max(
            mirror, std::abs(pressure_at(flow, i, j, k) - pressure_at(flow, i, n - 1 - j, k)));
        turn = std::max(turn, std::abs(pressure_at(flow, i, j, k) - pressure_at(flow, i, k, j)));
      }
  const BodyLoad load = bodies.load(flow.primitives(), 0, 1.0);
  std::printf(
      "sphere hit by Ms 1.8, R/h 5.5: peak %.3f of p5 - p0, asymmetry y %.1e, y-z %.1e, force %.3f "
      "%.1e %.1e, fallbacks %llu\n",
      peak / (reflected_pressure(behind.p) - 1), mirror, turn, load.force[0], load.force[1],
      load.force[2], static_cast<unsigned long long>(bodies.n_fallbacks()));
  EXPECT_GT(peak / (reflected_pressure(behind.p) - 1), .6);
  // Nothing but rounding breaks the mirror symmetry; shocks amplify it by some orders in 100 steps.
  EXPECT_LT(mirror, 1e-8);
  // The filter takes the directions one after the other, which commutes away from walls only: y and
  // z differ by a part of what it removes there (without the filter by 2e-13).
  EXPECT_LT(turn, .01 * reflected_pressure(behind.p));
}

}  // namespace
}  // namespace ocublast::flow
