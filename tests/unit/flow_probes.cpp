#include <gtest/gtest.h>

#include "coupler/base/errors.hpp"
#include "flow_solver/grid/make_grid.hpp"
#include "flow_solver/io/probes.hpp"

namespace ocublast::flow {
namespace {

constexpr double ambient = 1.0e5;

/// A field on a small grid, with one ghost-free array per primitive.
struct Field {
  Grid grid{{make_uniform_axis(0.0, 1.0, 10), make_uniform_axis(0.0, 2.0, 10), make_absent_axis()}};
  Gas gas{};
  std::vector<double> values = std::vector<double>(5 * 18 * 18);
  FieldsView<ocublast::flow::Real> view() {
    // [field][j][i] with 4 ghosts on each side
    return {values.data() + 4 * 18 + 4, 18 * 18, 18, 0};
  }
};

TEST(Probes, InterpolateALinearPressureExactly) {
  Field field;
  auto W = field.view();
  for (int j = 0; j < 10; ++j)
    for (int i = 0; i < 10; ++i) {
      const double p = ambient + 1e3 * field.grid.axis[0].x(i) - 5e2 * field.grid.axis[1].x(j);
      W(prim_T, i, j, 0) = 300.0;
      W(prim_rho, i, j, 0) = density(field.gas, p, 300.0);
    }
  Probes probes(field.grid, field.gas, {{"a", {0.37, 1.21, 0.0}}}, ambient);
  probes.sample(Ranks(), {{0, 0, 0}, {10, 10, 1}}, W, {}, 0.0);
  // Bilinear weights reproduce a linear function; 1e-9 is some 10 roundings of 1e5 Pa.
  EXPECT_NEAR(probes.history().at(0), 370.0 - 605.0, 1e-9);
}

TEST(Probes, RefuseAPlaceOutsideTheGridAndNameIt) {
  const Field field;
  try {
    const Probes probes(field.grid, field.gas, {{"far", {1.5, 0.5, 0.0}}}, ambient);
    FAIL() << "a probe outside must be refused";
  } catch (const CaseError& error) {
    EXPECT_NE(std::string(error.what()).find("'far': x = 1.5 m"), std::string::npos)
        << error.what();
  }
}

TEST(Probes, FindPeakArrivalAndImpulseOfATriangularPulse) {
  Field field;
  Probes probes(field.grid, field.gas, {{"a", {0.5, 1.0, 0.0}}}, ambient);
  // Jump to 1000 Pa between t = 1 and 2, then a linear fall through zero at t = 12, then suction.
  std::vector<double> times;
  std::vector<double> history;
  for (int s = 0; s <= 20; ++s) {
    times.push_back(s);
    history.push_back(s < 2 ? 0.0 : 1000.0 - 100.0 * (s - 2));
  }
  probes.restore(times, history);
  const auto result = probes.result(0);
  EXPECT_DOUBLE_EQ(result.peak, 1000.0);
  EXPECT_DOUBLE_EQ(result.arrival,
                   1.5);  // half of the peak on the straight line from (1, 0) to (2, 1000)
  EXPECT_DOUBLE_EQ(result.impulse, 500.0 + 0.5 * 10.0 * 1000.0);  // rise 1 s, fall 10 s
}

}  // namespace
}  // namespace ocublast::flow
