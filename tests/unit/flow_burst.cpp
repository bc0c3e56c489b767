#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <numbers>

#include "coupler/base/errors.hpp"
#include "flow_solver/grid/make_grid.hpp"
#include "flow_solver/sources/burst.hpp"

namespace ocublast::flow {
namespace {

constexpr double p0 = 101325.0;
constexpr double T0 = 288.15;

Grid cube(double half, int n) {
  return {{make_uniform_axis(-half, half, n), make_uniform_axis(-half, half, n),
           make_uniform_axis(-half, half, n)}};
}

double energy_on_grid(const Grid& grid, const Gas& gas, const BurstOnGrid& burst) {
  const State outside{.rho = density(gas, p0, T0), .p = p0};
  double sum = 0.0;
  std::size_t cell = 0;
  for (int k = 0; k < grid.axis[2].n; ++k)
    for (int j = 0; j < grid.axis[1].n; ++j)
      for (int i = 0; i < grid.axis[0].n; ++i)
        sum += (mix_burst(outside, burst, burst.fraction[cell++]).p - p0) /
               (gas.heat_capacity_ratio - 1.0) * cell_volume(grid, i, j, k);
  return sum;
}

TEST(Burst, BringsTheEnergyAskedForAlsoToACoarseGrid) {
  const Gas gas;
  for (const int n : {8, 20, 40}) {
    const Grid grid = cube(0.05, n);
    const auto burst = make_burst(
        grid, gas,
        {.center = {0.003, -0.001, 0.002}, .radius = 0.01, .energy = 100.0, .temperature = 2000.0},
        p0, density(gas, p0, T0));
    const double energy = energy_on_grid(grid, gas, burst);
    std::printf("n = %d: energy %.15g J of 100\n", n, energy);
    // Exact by construction: what remains is the rounding of the sum over n^3 cells.
    EXPECT_NEAR(energy, 100.0, 1e-9);
  }
}

TEST(Burst, GivesAnOctantItsEighthOfTheEnergy) {
  const Gas gas;
  const Grid grid{{make_uniform_axis(0.0, 0.05, 20), make_uniform_axis(0.0, 0.05, 20),
                   make_uniform_axis(0.0, 0.05, 20)}};
  const auto burst = make_burst(grid, gas, {.radius = 0.01, .energy = 100.0, .temperature = 2000.0},
                                p0, density(gas, p0, T0));
  EXPECT_NEAR(burst.energy, 12.5, 1e-9);
}

TEST(Burst, FillsTheVolumeOfTheBall) {
  const Gas gas;
  const Grid grid = cube(0.05, 40);
  const auto burst = make_burst(grid, gas, {.radius = 0.02, .pressure = 1e7, .temperature = 2000.0},
                                p0, density(gas, p0, T0));
  const double exact = 4.0 / 3.0 * std::numbers::pi * std::pow(0.02, 3);
  // 4 pi (r/h)^2 = 804 cells are cut; each fraction is wrong by at most about 1/16, at random: the
  // relative error of the volume is 1/16 / sqrt(804) x 804 / 268 cells = 0.7 %.
  EXPECT_NEAR(burst.volume / exact, 1.0, 7e-3);
  EXPECT_NEAR(burst.energy, (1e7 - p0) / 0.4 * burst.volume, 1e-9 * burst.energy);
}

TEST(Burst, RefusesABallBetweenTheCells) {
  const Grid grid = cube(0.05, 8);
  EXPECT_THROW(static_cast<void>(make_burst(grid, Gas{},
                                            {.center = {0.00625, 0.00625, 0.00625},
                                             .radius = 1e-5,
                                             .energy = 1.0,
                                             .temperature = 300.0},
                                            p0, 1.2)),
               CaseError);
}

}  // namespace
}  // namespace ocublast::flow
