#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "coupler/base/errors.hpp"
#include "flow_solver/grid/make_grid.hpp"
#include "flow_solver/step.hpp"

namespace ocublast::flow {
namespace {

TEST(MakeAxis, UniformSpacingGivesEqualJacobians) {
  const Axis axis = make_uniform_axis(-1.0, 1.0, 40);
  ASSERT_EQ(axis.n, 40);
  // Face positions carry a few roundings of values near 1: 1e-15 each.
  for (int i = -n_ghost; i < 44; ++i) EXPECT_NEAR(axis.h(i), 0.05, 5e-15);
  EXPECT_DOUBLE_EQ(axis.x(0), -0.975);
}

TEST(MakeAxis, JacobiansSumToTheLengthOnARefinedGrid) {
  const AxisSpec spec{.min = 0.0,
                      .max = 2.0,
                      .spacing = 0.05,
                      .refined = true,
                      .zone_min = 0.7,
                      .zone_max = 1.1,
                      .zone_spacing = 0.01,
                      .growth = 1.1,
                      .low = {.cells = 6, .ratio = 1.2},
                      .high = {.cells = 12, .ratio = 1.1}};
  const Axis axis = make_axis(spec);
  double sum = 0.0;
  double finest = 1.0;
  for (int i = 0; i < axis.n; ++i) {
    sum += axis.h(i);
    finest = std::min(finest, axis.h(i));
    EXPECT_GT(axis.x(i + 1), axis.x(i));
    // Neighbouring cells differ by no more than the largest ratio asked for, with 5 % for rounding
    // to whole cells and kinks of the map.
    EXPECT_LT(axis.h(i + 1) / axis.h(i), 1.2 * 1.05);
    EXPECT_GT(axis.h(i + 1) / axis.h(i), 1.0 / (1.2 * 1.05));
  }
  // Mirror symmetry puts the end faces exactly on the domain's ends; n roundings in the sum.
  EXPECT_NEAR(sum, axis.max - axis.min, 1e-13);
  EXPECT_LE(finest, 0.0101);
  EXPECT_GT(finest, 0.0090);
  EXPECT_LT(axis.min, 0.0);
  EXPECT_GT(axis.max, 2.0);
}

TEST(MakeAxis, RefusesTooFewCells) {
  EXPECT_THROW(static_cast<void>(make_uniform_axis(0.0, 1.0, 4)), CaseError);
}

}  // namespace
}  // namespace ocublast::flow
