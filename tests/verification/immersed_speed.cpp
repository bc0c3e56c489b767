#include <gtest/gtest.h>

#include <cstdio>
#include <ctime>

#include "flow_solver/immersed/immersed_boundary.hpp"
#include "tests/unit/immersed_shapes.hpp"

namespace ocublast::flow {
namespace {

using namespace testing;

class Clock {
 public:
  /// Processor milliseconds (all threads) since the last call: a busy machine disturbs these least.
  double lap() {
    const std::clock_t now = std::clock();
    const double ms = 1e3 * static_cast<double>(now - last_) / CLOCKS_PER_SEC;
    last_ = now;
    return ms;
  }

 private:
  std::clock_t last_ = std::clock();
};

/// Prints what geometry and ghosts cost at 128^3 with 33 k triangles; times are no test.
TEST(ImmersedSpeed, OfTopologyAndGhostsAt128Cubed) {
  const Gas gas;
  const int n = 128;
  const Grid grid = uniform_grid(n, n, n, 1.0);
  for (const bool moves : {false, true}) {
    Clock clock;
    ImmersedBoundary bodies(
        grid, gas, {{.name = "ball", .surface = make_sphere({.5, .5, .5}, .36, 6), .moves = moves}},
        {});
    const double prepare = clock.lap();
    Fields W(grid);
    W.set(grid, gas, [](double, double, double) {
      return std::array<double, 5>{1e5, 300, 0, 0, 0};
    });
    clock.lap();
    bodies.update_topology(W.view());
    const double first = clock.lap();
    const int ghosts =
        n_ghost * (bodies.lines(0).n_walls + bodies.lines(1).n_walls + bodies.lines(2).n_walls);
    bodies.compute_ghosts(W.view());
    clock.lap();
    bodies.compute_ghosts(W.view());
    const double stage = clock.lap();
    std::vector<double> p(bodies.position(0).size() / 3);
    bodies.read_overpressure(W.view(), 0, 1e5, p);
    const double read = clock.lap();
    std::printf(
        "processor time, 128^3, 32768 facets, %d ghosts, %s: prepare %.0f ms, first topology %.0f "
        "ms, stage %.1f ms "
        "(%.0f ns per ghost), read-out %.1f ms",
        ghosts, moves ? "moving" : "static", prepare, first, stage, 1e6 * stage / ghosts, read);
    if (moves) {
      std::vector<double> x(bodies.position(0).begin(), bodies.position(0).end());
      for (std::size_t v = 0; v < x.size(); v += 3) x[v] += .015 / n;
      bodies.set_straight_path(0, 0.0, 1.0, x);
      clock.lap();
      bodies.move_to(.5);
      const double move = clock.lap();
      bodies.compute_ghosts(W.view());
      const double moved_stage = clock.lap();
      bodies.move_to(1.0);
      clock.lap();
      bodies.update_topology(W.view());
      const double again = clock.lap();
      std::printf(", move %.1f ms, stage after it %.1f ms (%.0f ns per ghost), topology %.0f ms",
                  move, moved_stage, 1e6 * moved_stage / ghosts, again);
    } else {
      // Many of them: threads that still wait after the last parallel work would count in one.
      constexpr int times = 200;
      int renewed = 0;
      for (int call = 0; call < times; ++call)
        renewed += bodies.update_topology(W.view()).renewed ? 1 : 0;
      const double again = clock.lap() / times;
      std::printf(", topology again %.4f ms", again);
      EXPECT_EQ(renewed, 0);  // bodies at rest cost nothing after the start
    }
    std::printf("\n");
    EXPECT_GT(ghosts, 0);
  }
}

}  // namespace
}  // namespace ocublast::flow
