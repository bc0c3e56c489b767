#include <gtest/gtest.h>

#include "tests/support/solid_columns.hpp"

// The table of the bending column: elements over refinement and K/G, a test for each element and
// K/G.

namespace ocublast::solid {
namespace {

using namespace test;

using Row = std::tuple<ElementType, double>;
class BendingTable : public ::testing::TestWithParam<Row> {};
std::vector<ElementType> solid_elements() {
  auto elements = make_elements();
  std::erase_if(elements, [](const ElementType& type) { return type.planar; });
  return elements;
}
INSTANTIATE_TEST_SUITE_P(Elements, BendingTable,
                         ::testing::Combine(::testing::ValuesIn(solid_elements()),
                                            ::testing::Values(10.0, 1e3, 1e4, 1e5)),
                         [](const auto& row) {
                           return std::get<0>(row.param).name + "_" +
                                  std::to_string(static_cast<long>(std::get<1>(row.param)));
                         });

TEST_P(BendingTable, OverRefinement) {
  const auto& [type, ratio] = GetParam();
  const bool locks = type.name == "hex8_full" || type.name == "tet4" || type.shape == Shape::tet10;
  const bool proven = type.name == "hex8_q1p0" || type.name == "hex8_one_point";
  std::printf("%s", bending_titles);
  for (const int n : {2, 4, 8}) {
    // Cost grows by 16 with N and by the root of K/G: the corner of the table is left to the
    // elements that are to stand it.
    if (n == 8 && ((ratio > 1e3 && !proven) || type.shape == Shape::tet10)) continue;
    if (n == 4 && ratio > 1e4 && type.shape == Shape::tet10) continue;
    const double largest = bend(type.name, type.shape, n, ratio).largest;
    if (proven && n >= 4) {
      EXPECT_NEAR(largest, 2.87, 0.01 * 2.87);
    }
    if (!locks) {
      EXPECT_GT(largest, 1.4);  // half of the motion at any K/G
    }
    EXPECT_LT(largest, 3.0);
  }
}

}  // namespace
}  // namespace ocublast::solid
