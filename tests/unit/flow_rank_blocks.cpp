// How a grid is cut into the blocks of ranks.

#include <gtest/gtest.h>

#include <numeric>

#include "flow_solver/grid/make_grid.hpp"
#include "flow_solver/ranks/rank_part.hpp"

namespace ocublast::flow {
namespace {

Grid bar(int n_x, int n_y) {
  return {{make_uniform_axis(0.0, 1.0, n_x), make_uniform_axis(0.0, 1.0, n_y), make_absent_axis()}};
}

/// All nodes alike.
PlaneWork even_work(const Grid& grid) {
  PlaneWork work;
  for (std::size_t a = 0; a < 3; ++a) {
    const auto n = static_cast<std::size_t>(grid.axis[a].n);
    work.of_plane[a].assign(n, static_cast<double>(grid.n_cells() / n));
    work.of_border[a].assign(n, 0.0);
  }
  return work;
}

TEST(RankBlocks, AreCutAsWithoutWorkWhereAllNodesAreAlike) {
  const Grid grid = bar(90, 60);
  for (const int n : {2, 3, 4, 6}) {
    const RankBlocks plain = cut_grid(grid, n, {}),
                     by_work = cut_grid(grid, n, {}, even_work(grid));
    EXPECT_EQ(plain.parts, by_work.parts) << n;
    EXPECT_EQ(plain.begin, by_work.begin) << n;
  }
}

TEST(RankBlocks, ShareTheWorkNotTheNodes) {
  const Grid grid = bar(120, 30);
  PlaneWork work = even_work(grid);
  for (std::size_t i = 0; i < 40; ++i) work.of_plane[0][i] *= 4.0;
  const RankBlocks blocks = cut_grid(grid, 2, {2, 1, 1}, work);
  // 40 planes of four and 80 of one make 240: half of it lies below plane 30.
  EXPECT_EQ(blocks.begin[0], (std::vector<int>{0, 30, 120}));
}

TEST(RankBlocks, KeepBordersOffPlanesWhereTheyCost) {
  const Grid grid = bar(100, 20);
  PlaneWork work = even_work(grid);
  // A plane is 20 nodes: going 8 planes off the middle costs 160, a border there 1000.
  for (std::size_t i = 44; i < 58; ++i) work.of_border[0][i] = 1000.0;
  const RankBlocks blocks = cut_grid(grid, 2, {2, 1, 1}, work);
  EXPECT_EQ(blocks.begin[0], (std::vector<int>{0, 43, 100}));
  // Dearer than cutting along the longer border: the other axis is cut.
  work.of_border[0].assign(100, 1e5);
  EXPECT_EQ(cut_grid(grid, 2, {}, work).parts, (std::array<int, 3>{1, 2, 1}));
}

}  // namespace
}  // namespace ocublast::flow
