#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <vector>

#include "tests/unit/immersed_shapes.hpp"
#include "tests/verification/flow_reflection.hpp"

namespace ocublast::flow {
namespace {

TEST(CutLines, ReflectAShockAtEverySubCellPositionAndLetNothingThrough) {
  for (double mach : {1.5, 3.0}) {
    for (double offset : {0.05, 0.3, 0.55, 0.7, 0.95}) {
      for (double thickness : {20.3, 0.5}) {
        const Reflection r = reflect(mach, 0.6 + offset / 200, thickness / 200, 0);
        std::printf(
            "Ms %.1f, offset %.2f, thickness %4.1f h: p5 error %+.1e, peak %+.3f, leak %.1e, "
            "redone %d\n",
            mach, offset, thickness, r.plateau_error, r.peak, r.leak, r.redone);
        // Prototype: 7e-4 in front of plates of every thickness (Ms 1.5 and 3), 1e-15 behind.
        EXPECT_LT(std::abs(r.plateau_error), 2.5e-3);
        EXPECT_LT(r.leak, 1e-12);
      }
    }
  }
}

TEST(CutLines, GiveTheSameAlongEveryDirection) {
  const Reflection x = reflect(2.0, 0.6018, 0.03, 0);
  for (int axis : {1, 2}) {
    const Reflection r = reflect(2.0, 0.6018, 0.03, axis);
    std::printf("along %c: p5 error %+.3e (x %+.3e), leak %.1e\n", "xyz"[axis], r.plateau_error,
                x.plateau_error, r.leak);
    EXPECT_NEAR(r.plateau_error, x.plateau_error, 1e-9);
    EXPECT_LT(r.leak, 1e-12);
  }
}

constexpr double short_filter =
    0.38;  // its solve's root is 0.461 per node: the faces stay out of it

/// Pressures round two balls some steps after a burst in the middle, with the given far faces.
std::vector<double> scattered(BoundaryKind far, Scheme scheme, bool filter) {
  constexpr int n = 64;
  FlowOptions o = unit_options();
  o.scheme = scheme;
  o.filter = filter;
  o.filter_alpha = short_filter;
  const State quiet{.rho = 1.0, .p = 1.0};
  const Grid grid = uniform_grid({n, n, n}, {0, 0, 0}, {1, 1, 1});
  Flow flow(grid, all_faces(far, quiet), o);
  flow.set_state([&](double x, double y, double z) {
    const double r = std::hypot(x - 0.52, y - 0.43, z - 0.47);
    return State{.rho = 1.0, .p = 1.0 + 2.0 * (1.0 - std::tanh((r - 0.04) / 0.01))};
  });
  // Lines of a tile meet both balls, one, or neither.
  std::vector<Body> bodies(2);
  bodies[0] = {.name = "large", .surface = testing::make_sphere({0.47, 0.52, 0.55}, 0.08, 3)};
  bodies[1] = {.name = "small", .surface = testing::make_sphere({0.55, 0.62, 0.44}, 0.05, 3)};
  ImmersedBoundary ib(grid, o.gas, bodies, {});
  ib.move_to(0.0);
  ib.update_topology(flow.primitives());
  flow.immerse(&ib);
  for (int step = 0; step < 6; ++step) flow.advance(0.0, 0.002);
  std::vector<double> p;
  const auto W = flow.primitives();
  for (int k = 0; k < n; ++k) {
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) {
        const bool gas = ib.tags()[static_cast<std::size_t>((k * n + j) * n + i)] == 0;
        p.push_back(gas ? W(0, i, j, k) * W(4, i, j, k) : 1.0);
      }
    }
  }
  return p;
}

TEST(CutLines, ScatterTheSameInTilesAndOneByOne) {
  // With open faces the cut lines are solved by tiles (kernel_aligned.hpp), with mirrors one by
  // one; the gas near the faces is still at rest.
  for (const Scheme scheme : {Scheme::compact6, Scheme::compact8}) {
    for (const bool filter : {false, true}) {
      const std::vector<double> tiles = scattered(BoundaryKind::outflow, scheme, filter);
      const std::vector<double> lines = scattered(BoundaryKind::symmetry, scheme, filter);
      double worst = 0.0, most = 0.0;
      for (std::size_t i = 0; i < tiles.size(); ++i) {
        worst = std::max(worst, std::abs(tiles[i] - lines[i]));
        most = std::max(most, std::abs(tiles[i] - 1.0));
      }
      std::printf("two balls, order %d%s: pressures differ by %.1e of %.2f\n",
                  scheme == Scheme::compact8 ? 8 : 6, filter ? ", filtered" : "", worst, most);
      EXPECT_GT(most, 0.5);
      // The burst's pressure, 4, reaches the faces some 22 nodes away with the root of the solve's
      // matrix per node in each of 24 stages: 24 x 4 x 0.38^22, at eighth order 24 x 4 x 0.45^22;
      // in six applications of the filter 6 x 4 x 0.461^22.
      EXPECT_LT(worst, (scheme == Scheme::compact8 ? 2.3e-6 : 5.6e-8) + (filter ? 9.6e-7 : 0.0));
    }
  }
}

/// Relative error of the decay of u = sin(pi (y - y0)/H) between two immersed no-slip walls.
double immersed_shear_decay(int n) {
  constexpr double nu = 0.02, end = 1.0, amplitude = 0.01, low = 0.1037, high = 0.8963;
  FlowOptions o = unit_options();
  o.viscosity = Viscosity::constant;
  o.dynamic_viscosity = nu;
  o.artificial_diffusivity = false;
  Boundaries faces = all_faces(BoundaryKind::symmetry);
  faces[0].kind = faces[1].kind = BoundaryKind::periodic;
  const Grid grid = uniform_grid({8, n, 1}, {0, 0, 0}, {8.0 / n, 1, 1}, true);
  Grid g = grid;
  g.axis[1] = make_uniform_axis(0.0, 1.0, n);
  Flow flow(g, faces, o);
  const double height = high - low, pi = std::acos(-1.0);
  const auto exact = [&](double y, double t) {
    return amplitude * std::sin(pi * (y - low) / height) *
           std::exp(-nu * pi * pi / (height * height) * t);
  };
  flow.set_state(
      [&](double, double y, double) { return State{.rho = 1.0, .u = exact(y, 0.0), .p = 1.0}; });
  const double below_lo[3] = {-1, -1, -1}, below_hi[3] = {2, low, 2}, above_lo[3] = {-1, high, -1},
               above_hi[3] = {2, 2, 2};
  std::vector<Body> bodies(2);
  bodies[0] = {.name = "below", .surface = make_box(below_lo, below_hi), .slip = WallSlip::no_slip};
  bodies[1] = {.name = "above", .surface = make_box(above_lo, above_hi), .slip = WallSlip::no_slip};
  ImmersedBoundary ib(g, o.gas, bodies, {});
  ib.move_to(0.0);
  static_cast<void>(ib.update_topology(flow.primitives()));
  flow.immerse(&ib);
  run_to(flow, end);
  double largest = 0.0;
  for (int j = 0; j < n; ++j) {
    const double y = g.axis[1].x(j);
    if (y > low && y < high)
      largest =
          std::max(largest, std::abs(std::as_const(flow).primitives()(1, 3, j, 0) - exact(y, end)));
  }
  return largest / amplitude;
}

TEST(CutLines, HoldShearBetweenImmersedNoSlipWalls) {
  const double coarse = immersed_shear_decay(24), fine = immersed_shear_decay(48);
  std::printf("shear between immersed no-slip walls: error %.2e (24) -> %.2e (48), order %.2f\n",
              coarse, fine, std::log2(coarse / fine));
  // Second order at the walls, in stress and in their ghosts: h = H/19 and H/38.
  EXPECT_LT(fine, 0.6 * coarse);
  EXPECT_LT(fine, 1e-2);
}

}  // namespace
}  // namespace ocublast::flow
