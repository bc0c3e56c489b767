// Bodies that move through cells: what a crossing costs in force, pressure and mass, in two and
// three dimensions, and the same body at rest in moving gas.
#include <gtest/gtest.h>

#include <utility>

#include "tests/verification/immersed_rig.hpp"

namespace ocublast::flow {
namespace {

using namespace testing;

/// Largest deviation of a pressure from the line through its last two values, of p0: a spike of one
/// step.
class SpikeMeter {
 public:
  /// NaN: no value now.
  void add(const std::vector<double>& p, double dt) {
    if (before_.size() == p.size()) {
      for (std::size_t v = 0; v < p.size(); ++v) {
        const double off = std::abs(p[v] - last_[v] - dt / dt_ * (last_[v] - before_[v]));
        if (off > largest_) largest_ = off;
      }
    }
    before_ = std::exchange(last_, p);
    dt_ = dt;
  }
  [[nodiscard]] double largest() const { return largest_; }

 private:
  std::vector<double> before_, last_;
  double dt_ = 1.0, largest_ = 0.0;
};

/// Pressures at nodes that came out of the body at most eight steps ago, NaN elsewhere.
class FreshNodes {
 public:
  std::vector<double> pressures(const Flow& flow, const ImmersedBoundary& bodies) {
    const Grid& grid = flow.grid();
    if (age_.empty()) age_.assign(grid.n_cells(), 1000);
    std::vector<double> p(grid.n_cells(), NAN);
    for (std::size_t node = 0; node < age_.size(); ++node) {
      age_[node] = bodies.tags()[node] == tag_fluid ? age_[node] + 1 : 0;
      if (age_[node] == 0 || age_[node] > 8) continue;
      const int n_i = grid.axis[0].n, n_j = grid.axis[1].n, at = static_cast<int>(node);
      p[node] = pressure_at(flow, at % n_i, at / n_i % n_j, at / n_i / n_j);
    }
    return p;
  }

 private:
  std::vector<int> age_;
};

struct Motion {
  std::function<double(double)> shift, rate;
};

/// Speed reached within `ramp` seconds, then constant; acceleration continuous: its jump would be a
/// kink of the pressure that is no error.
Motion ramped(double speed, double ramp) {
  const double w = std::numbers::pi / ramp;
  return {[=](double t) {
            return t < ramp ? .5 * speed * (t - std::sin(w * t) / w) : speed * (t - .5 * ramp);
          },
          [=](double t) { return t < ramp ? .5 * speed * (1 - std::cos(w * t)) : speed; }};
}

struct Crossing {
  double noise = 0.0;          ///< rms of the drag, of p0 times the frontal area / 2
  double spike = 0.0;          ///< of p0, at nodes that have just come out of the body
  double surface_spike = 0.0;  ///< of p0, at vertices of the body
  double leak = 0.0;           ///< largest, of the gas in the box
  double drag = 0.0;
  RunCounts counts;
  std::uint64_t fallbacks = 0;
};

/// Body 0 in a closed box of gas at rest, driven along (1, slant, slant).
Crossing drive(const Grid& grid, const BodySurface& surface, double frontal, double depth,
               const Motion& motion, double slant, double t_begin, double t_end,
               double cfl = FlowOptions{}.cfl) {
  FlowOptions options = unit_gas_options();
  options.cfl = cfl;
  Flow flow(grid, walls_all_round(), options);
  flow.set_state([](double, double, double) { return flow::State{.rho = 1, .p = 1}; });
  ImmersedBoundary bodies(grid, options.gas, {{.name = "body", .surface = surface, .moves = true}},
                          {});
  immerse(flow, bodies);
  // A rigid body takes no volume from the gas: its mean density, cells cut at the wall, stays.
  const auto density_now = [&] {
    const Totals totals = flow.totals();
    const WallCells cells = bodies.wall_cells(flow.primitives());
    return (totals.mass + cells.mass) / (totals.volume + cells.volume);
  };
  const double before = density_now();
  Crossing result;
  SpikeMeter meter, surface_meter;
  FreshNodes fresh;
  std::vector<double> drag, p(surface.vertices.size() / 3);
  double step = 0.0;
  const double lateral = grid.axis[2].present ? slant : 0.0;
  result.counts = run(
      flow, bodies, t_end,
      [&](double t, double& dt) {
        step = dt;
        const double s = motion.shift(t + dt), u = motion.rate(t + dt);
        translate(bodies, 0, t, dt, {s, slant * s, lateral * s}, {u, slant * u, lateral * u});
      },
      [&](double t) {
        result.leak = std::max(result.leak, std::abs(density_now() / before - 1.0));
        const std::vector<double> emerged = fresh.pressures(flow, bodies);
        if (t < t_begin) return;
        bodies.read_overpressure(flow.primitives(), 0, 1.0, p);
        surface_meter.add(p, step);
        meter.add(emerged, step);
        drag.push_back(bodies.load(flow.primitives(), 0, 1.0).force[0] / depth);
      });
  result.noise = noise_of(drag).rms / (.5 * frontal);
  result.spike = meter.largest();
  result.surface_spike = surface_meter.largest();
  result.drag = drag.back();
  result.fallbacks = bodies.n_fallbacks();
  return result;
}

void print(const char* what, const Crossing& c) {
  std::printf(
      "%s: pressure spikes at fresh nodes %.2f %%, on the body %.2f %% of p0, drag noise %.1e of "
      "p0 A / 2, mass leaked %.1e, %zu fresh "
      "nodes in %d steps, fallbacks %llu\n",
      what, 100 * c.spike, 100 * c.surface_spike, c.noise, c.leak, c.counts.fresh, c.counts.steps,
      static_cast<unsigned long long>(c.fallbacks));
}

TEST(ImmersedCrossing, OfACylinderMakesNoSpikes) {
  const double h = 1.0 / 16;
  const Grid grid{{make_uniform_axis(0, 7, 112), make_uniform_axis(0, 5, 80), make_absent_axis()}};
  const double speed = .3 * std::sqrt(g);
  for (const bool accelerating : {false, true}) {
    // Constant speed is reached soon, its pulse has passed when the measurement begins; or never.
    const Motion motion = ramped(speed, accelerating ? 3.2 : 1.2);
    const Crossing c =
        drive(grid, make_cylinder(2.003, 2.197, 1.0, static_cast<int>(2 * std::numbers::pi / h)),
              2.0, 3.0, motion, .2, accelerating ? .2 : 1.6, 3.2);
    print(accelerating ? "cylinder, R/h 16, accelerating to .3 c" : "cylinder, R/h 16, at .3 c", c);
    EXPECT_LT(c.spike, .005);
    EXPECT_LT(c.surface_spike, .005);
    EXPECT_LT(c.leak, 1e-3);
    EXPECT_EQ(c.fallbacks, 0U);
  }
}

TEST(ImmersedCrossing, OfASphereMakesNoSpikes) {
  // A fresh node answers to what its ghosts are off within a sound time of a cell: the longer the
  // step, the more of it in one. (Its own first value does not matter: held, or interpolated anew,
  // it goes the same way.) So half a per cent is asked of a Courant number of 0.9, and at 1.2 (0.08
  // cells of way per step) as much more as the square of the step; on the body it is asked of both.
  const double h = 1.0 / 8;
  const Grid grid{
      {make_uniform_axis(0, 4, 32), make_uniform_axis(0, 3.5, 28), make_uniform_axis(0, 3.5, 28)}};
  for (const double cfl : {.9, FlowOptions{}.cfl}) {
    const Crossing c = drive(grid, make_sphere({1.503, 1.697, 1.711}, 8 * h, 3), std::numbers::pi,
                             1.0, ramped(.2 * std::sqrt(g), 1.5), .1, .1, 2.0, cfl);
    std::printf("R/h 8, Courant number %.1f, ", cfl);
    print("sphere accelerating to .2 c", c);
    EXPECT_LT(c.spike, .005 * (cfl / .9) * (cfl / .9));
    EXPECT_LT(c.surface_spike, .005);
    EXPECT_LT(c.leak, 1e-3);
    EXPECT_EQ(c.fallbacks, 0U);
  }
}

/// Drag of a cylinder set going at once: moving through gas at rest, or held in gas that moves.
/// Walls far enough that no wave comes back.
std::vector<std::pair<double, double>> drag_history(int n, double speed, bool moves, double t_end) {
  const double half = 1.0 + 1.1 * t_end;
  const double length = 2 * half + speed * t_end;
  const int n_i = static_cast<int>(length * n), n_j = static_cast<int>(half * n);
  // Half of the problem, above the plane of symmetry through the axis.
  const Grid grid{{make_uniform_axis(0, n_i / double(n), n_i),
                   make_uniform_axis(0, n_j / double(n), n_j), make_absent_axis()}};
  const flow::State gas{.rho = 1, .u = moves ? 0.0 : -speed, .p = 1};
  Boundaries boundaries = walls_all_round();
  boundaries[0] = boundaries[1] = boundaries[3] = {.kind = BoundaryKind::fixed_state, .state = gas};
  const FlowOptions options = unit_gas_options();
  Flow flow(grid, boundaries, options);
  flow.set_state([&](double, double, double) { return gas; });
  // The fixed one stays where the moving one is half-way.
  const double x = half + .4137 / n + (moves ? 0.0 : .5 * speed * t_end);
  ImmersedBoundary bodies(grid, options.gas,
                          {{.name = "cylinder",
                            .surface = make_cylinder(x, 0, 1, static_cast<int>(6.4 * n)),
                            .moves = moves}},
                          {});
  immerse(flow, bodies);
  std::vector<std::pair<double, double>> drag;
  run(
      flow, bodies, t_end,
      [&](double t, double& dt) {
        dt = std::min(dt, .3 / n / speed);
        if (moves) translate(bodies, 0, t, dt, {speed * (t + dt), 0, 0}, {speed, 0, 0});
      },
      [&](double t) {
        drag.emplace_back(t, -2 * bodies.load(flow.primitives(), 0, 1.0).force[0] / 3.0);
      });
  return drag;
}

TEST(ImmersedTwin, MovingInGasAtRestHasTheDragOfABodyAtRestInMovingGas) {
  const int n = 16;
  const double speed = .5 * std::sqrt(g), t_end = 2.5, t_begin = .5;
  double mean[2], noise[2];
  for (const bool moves : {false, true}) {
    const auto drag = drag_history(n, speed, moves, t_end);
    double sum = 0.0;
    std::vector<double> series;
    for (std::size_t s = 1; s < drag.size(); ++s) {
      if (drag[s - 1].first < t_begin) continue;
      sum += .5 * (drag[s].second + drag[s - 1].second) * (drag[s].first - drag[s - 1].first);
      series.push_back(drag[s].second);
    }
    mean[moves] = sum / (t_end - t_begin);
    noise[moves] = noise_of(series).rms;
  }
  std::printf(
      "cylinder at .5 c, R/h %d: mean drag %.4f at rest in moving gas, %.4f moving (%+.2f %%), "
      "noise "
      "%.2f %% and %.2f %% of it\n",
      n, mean[0], mean[1], 100 * (mean[1] / mean[0] - 1), 100 * noise[0] / mean[0],
      100 * noise[1] / mean[0]);
  EXPECT_LT(std::abs(mean[1] / mean[0] - 1), .01);
  EXPECT_LT(noise[1], .01 * mean[0]);
}

/// A bar whose faces contain the direction of the stream passes through a stretched grid from end
/// to end: nothing happens.
TEST(ImmersedFreeStream, AlongASlipBodyOnAStretchedGridIsKeptToRoundOff) {
  const auto axis = [](double refined_at) {
    return make_axis({.min = 0,
                      .max = 1,
                      .spacing = .06,
                      .refined = true,
                      .zone_min = refined_at - .1,
                      .zone_max = refined_at + .1,
                      .zone_spacing = .03,
                      .growth = 1.1});
  };
  const Grid grid{{axis(.5), axis(.4), axis(.6)}};
  const flow::State stream{.rho = 1, .u = 1.0, .v = .3, .w = .2, .p = 1};
  Boundaries boundaries;
  for (Boundary& face : boundaries) face = {.kind = BoundaryKind::fixed_state, .state = stream};
  const FlowOptions options = unit_gas_options();
  Flow flow(grid, boundaries, options);
  flow.set_state([&](double, double, double) { return stream; });
  BodySurface bar = make_box({-1, .22, .33}, {2, .42, .55}, 1);
  for (std::size_t v = 0; v < bar.vertices.size(); v += 3) {  // sheared along the stream
    bar.vertices[v + 1] += .3 * bar.vertices[v];
    bar.vertices[v + 2] += .2 * bar.vertices[v];
  }
  ImmersedBoundary bodies(grid, options.gas, {{.name = "bar", .surface = bar}}, {});
  immerse(flow, bodies);
  double t = 0.0;
  for (int s = 0; s < 20; ++s) {
    const double dt = flow.stable_step();
    flow.advance(t, dt);
    t += dt;
  }
  double worst = 0.0;
  std::size_t node = 0;
  const FieldsView<const Real> W = flow.primitives();
  for (int k = 0; k < grid.axis[2].n; ++k)
    for (int j = 0; j < grid.axis[1].n; ++j)
      for (int i = 0; i < grid.axis[0].n; ++i, ++node) {
        if (bodies.tags()[node] != tag_fluid) continue;
        worst = std::max({worst, std::abs(W(0, i, j, k) - 1), std::abs(W(1, i, j, k) - 1),
                          std::abs(W(2, i, j, k) - .3), std::abs(W(3, i, j, k) - .2),
                          std::abs(W(4, i, j, k) - 1)});
      }
  std::printf("free stream along a bar, %d x %d x %d stretched nodes, %d walls, 20 steps: %.1e\n",
              grid.axis[0].n, grid.axis[1].n, grid.axis[2].n,
              bodies.lines(0).n_walls + bodies.lines(1).n_walls + bodies.lines(2).n_walls, worst);
  // Rounding of the wall's distance and of 20 steps of line solves.
  EXPECT_LT(worst, 1e-12);
}

}  // namespace
}  // namespace ocublast::flow
