#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <random>

#include "coupler/base/errors.hpp"
#include "flow_solver/immersed/bodies.hpp"
#include "flow_solver/immersed/foot.hpp"
#include "flow_solver/immersed/line_cutting.hpp"
#include "tests/unit/immersed_shapes.hpp"

namespace ocublast::flow {
namespace {

using namespace testing;

CutGrid cut_for(const Grid& grid, const Bodies& bodies, double gap_block) {
  CutGrid cut;
  cut_grid(grid, bodies, gap_block, {}, cut);
  return cut;
}

Bodies make_bodies(const Grid& grid, std::vector<BodySurface> surfaces) {
  std::vector<Body> list;
  for (BodySurface& s : surfaces) {
    list.push_back({.name = "body" + std::to_string(list.size()), .surface = std::move(s)});
  }
  Bodies bodies(grid, std::move(list), 35.0);
  bodies.update_search(0.0);
  return bodies;
}

std::size_t count_tag(const CutGrid& cut, std::uint8_t tag) {
  return static_cast<std::size_t>(std::count(cut.tag.begin(), cut.tag.end(), tag));
}

std::string fault_of(Body body) {
  const Grid grid = uniform_grid(8, 8, 8, 1.0);
  try {
    Bodies bodies(grid, {std::move(body)}, 35.0);
  } catch (const CaseError& e) {
    return e.what();
  }
  return {};
}

TEST(ImmersedSurface, NamesTheFacetThatIsInvertedMissingOrEmpty) {
  const BodySurface good = make_box({.2, .2, .2}, {.7, .7, .7});
  EXPECT_EQ(fault_of({.name = "eye", .surface = good}), "");
  BodySurface inverted = good;
  std::swap(inverted.triangles[3 * 4 + 1], inverted.triangles[3 * 4 + 2]);
  EXPECT_NE(fault_of({.name = "eye", .surface = inverted}).find("inverted"), std::string::npos);
  EXPECT_NE(fault_of({.name = "eye", .surface = inverted}).find("'eye'"), std::string::npos);
  BodySurface open = good;
  open.triangles.resize(open.triangles.size() - 3);
  EXPECT_NE(fault_of({.name = "eye", .surface = open}).find("close the surface"),
            std::string::npos);
  BodySurface empty = good;
  empty.triangles[1] = empty.triangles[0];
  EXPECT_NE(fault_of({.name = "eye", .surface = empty}).find("facet 0"), std::string::npos);
  BodySurface outside = make_box({2, 2, 2}, {3, 3, 3});
  EXPECT_NE(fault_of({.name = "eye", .surface = outside}).find("grid"), std::string::npos);
}

TEST(ImmersedSurface, IsTurnedOutwardByTheSignOfItsVolume) {
  BodySurface s = make_sphere({.5, .5, .5}, .3, 2);
  const double volume = enclosed_volume(s);
  for (std::size_t f = 0; f < s.triangles.size(); f += 3)
    std::swap(s.triangles[f], s.triangles[f + 1]);
  EXPECT_DOUBLE_EQ(enclosed_volume(s), -volume);
  orient_outward(s);
  EXPECT_DOUBLE_EQ(enclosed_volume(s), volume);
}

TEST(ImmersedSurface, SmoothsNormalsOnASphereAndNotAcrossTheEdgesOfACube) {
  const Grid grid = uniform_grid(8, 8, 8, 1.0);
  const Bodies sphere = make_bodies(grid, {make_sphere({.5, .5, .5}, .3, 3)});
  const SurfaceTopology& t = sphere[0].topology;
  EXPECT_EQ(t.n_smooth_vertices, static_cast<std::int32_t>(sphere[0].n_vertices()));
  double worst = 0.0;
  for (std::size_t f = 0; f < t.facet.size(); ++f) {
    for (std::size_t c = 0; c < 3; ++c) {
      const Vec3 radial = unit(sphere[0].vertex(t.facet[f][c]) - Vec3{{.5, .5, .5}});
      worst =
          std::max(worst, norm(radial - sphere[0].geometry.smooth_normal[t.smooth_vertex[f][c]]));
    }
  }
  // Max's weights give the exact normal for vertices on a sphere, up to rounding of unit vectors.
  EXPECT_LT(worst, 1e-13);
  const Bodies cube = make_bodies(grid, {make_box({.2, .2, .2}, {.7, .7, .7}, 3)});
  for (std::size_t f = 0; f < cube[0].n_facets(); ++f) {
    for (const std::int32_t v : cube[0].topology.smooth_vertex[f]) {
      EXPECT_LT(norm(cube[0].geometry.smooth_normal[v] - cube[0].geometry.normal[f]), 1e-14);
    }
  }
}

TEST(ImmersedScan, ClosesEveryLineOfASphereWithVerticesOnNodes) {
  // Node spacing 1/16, nodes at odd multiples of 1/32: centre and the six axis vertices on nodes.
  const Grid grid = uniform_grid(16, 16, 16, 1.0);
  const Bodies bodies = make_bodies(grid, {make_sphere({17. / 32, 17. / 32, 17. / 32}, .25, 2)});
  const CutGrid cut = cut_for(grid, bodies, 0.0);
  EXPECT_EQ(cut.open_lines, 0U);
  for (int a = 0; a < 3; ++a) {
    // Every wall end of a direction without blocked gaps has its facet: tags and crossings agree.
    for (const WallEnd& wall : cut.walls[a]) EXPECT_GE(wall.facet, 0);
  }
  double expected = 0.0;
  for (int k = 0; k < 16; ++k)
    for (int j = 0; j < 16; ++j)
      for (int i = 0; i < 16; ++i)
        expected +=
            bodies.inside_any({{grid.axis[0].x(i), grid.axis[1].x(j), grid.axis[2].x(k)}}, -1);
  // Scan along lines and single-point test share rules except for nodes exactly on the surface:
  // at most the six axis vertices.
  EXPECT_NEAR(static_cast<double>(count_tag(cut, tag_body)), expected, 6.0);
}

TEST(ImmersedScan, CountsTheNodesOfACubeWithFacesOnNodesExactly) {
  const Grid grid = uniform_grid(40, 40, 40, 40.0);
  // From node to node over 20 spacings: one of the two faces counts, 20^3 nodes.
  const Bodies bodies = make_bodies(grid, {make_box({5.5, 5.5, 5.5}, {25.5, 25.5, 25.5}, 4)});
  const CutGrid cut = cut_for(grid, bodies, 0.0);
  EXPECT_EQ(cut.open_lines, 0U);
  EXPECT_EQ(count_tag(cut, tag_body), 8000U);
  for (int a = 0; a < 3; ++a) {
    EXPECT_EQ(cut.walls[a].size(), 2U * 20U * 20U);
    for (const WallEnd& wall : cut.walls[a]) {
      EXPECT_GE(wall.facet, 0);
      EXPECT_DOUBLE_EQ(wall.position, wall.side > 0 ? 5.5 : 25.5);
    }
  }
}

TEST(ImmersedScan, JoinsOverlappingSpheresToTheirUnion) {
  const Grid grid = uniform_grid(32, 32, 32, 1.0);
  const P3 c0 = {.4, .51, .52}, c1 = {.6, .49, .47};
  const Bodies bodies = make_bodies(grid, {make_sphere(c0, .25, 4), make_sphere(c1, .21, 4)});
  const CutGrid cut = cut_for(grid, bodies, 0.0);
  std::size_t wrong = 0;
  std::size_t n = 0;
  for (int k = 0; k < 32; ++k)
    for (int j = 0; j < 32; ++j)
      for (int i = 0; i < 32; ++i, ++n) {
        const Vec3 x = {{grid.axis[0].x(i), grid.axis[1].x(j), grid.axis[2].x(k)}};
        const double d0 = norm(x - Vec3{{c0[0], c0[1], c0[2]}}) - .25;
        const double d1 = norm(x - Vec3{{c1[0], c1[1], c1[2]}}) - .21;
        // Chord height of the facets (8 * 4^4 on the sphere): below 0.5 % of the radius.
        if (std::min(std::abs(d0), std::abs(d1)) < .005 * .25) continue;
        wrong += (std::min(d0, d1) < 0.0) != (cut.tag[n] == tag_body) ? 1 : 0;
      }
  EXPECT_EQ(wrong, 0U);
  // No wall end inside the union: each crossing point is exposed.
  for (int a = 0; a < 3; ++a) {
    for (const WallEnd& wall : cut.walls[a]) {
      ASSERT_GE(wall.facet, 0);
      EXPECT_EQ(bodies[wall.body].buried[wall.facet], 0);
    }
  }
}

TEST(ImmersedScan, CutsEveryLineThatAPlateOfATenthOfACellCrosses) {
  const Grid grid = uniform_grid(20, 20, 1, 1.0);
  const double h = .05;
  // Upright, between nodes and through nodes; spans the channel with room.
  for (const double x : {.5, .5 + .5 * h, .5 + .45 * h, .51}) {
    const Bodies bodies = make_bodies(grid, {make_box({x, -1, -1}, {x + .1 * h, 2, 2}, 1)});
    const CutGrid cut = cut_for(grid, bodies, 0.0);
    EXPECT_EQ(cut.lines[0].segments.size(), 40U);
    for (const Segment& s : cut.lines[0].segments) {
      EXPECT_EQ(s.wall_low >= 0, s.begin > 0);
      EXPECT_EQ(s.wall_high >= 0, s.end < 20);
    }
  }
  // Inclined by 10 degrees: all 20 x-lines are cut all the same.
  const double s10 = std::sin(10.0 * std::numbers::pi / 180),
               c10 = std::cos(10.0 * std::numbers::pi / 180);
  const auto at = [&](double u, double w) {
    return std::array<double, 2>{.5 + c10 * u - s10 * w, .5 + s10 * u + c10 * w};
  };
  const Bodies bodies =
      make_bodies(grid, {make_prism({at(0, -1), at(.1 * h, -1), at(.1 * h, 1), at(0, 1)}, -1, 2)});
  const CutGrid cut = cut_for(grid, bodies, 0.0);
  EXPECT_EQ(std::count(cut.lines[0].cut.begin(), cut.lines[0].cut.end(), 1), 20);
  EXPECT_EQ(cut.open_lines, 0U);
}

TEST(ImmersedScan, TagsTheSameOnAStretchedGridAsByDistance) {
  std::vector<double> nodes;
  for (int i = 0; i < 40; ++i) nodes.push_back(std::pow((i + .5) / 40.0, 2.0));
  const Grid grid{{make_axis_from_nodes(0.0, 1.0, nodes, false), make_uniform_axis(0, 1, 24),
                   make_uniform_axis(0, 1, 24)}};
  const Bodies bodies = make_bodies(grid, {make_sphere({.4, .5, .5}, .3, 5)});
  const CutGrid cut = cut_for(grid, bodies, 0.0);
  std::size_t n = 0, wrong = 0;
  for (int k = 0; k < 24; ++k)
    for (int j = 0; j < 24; ++j)
      for (int i = 0; i < 40; ++i, ++n) {
        const Vec3 x = {{grid.axis[0].x(i), grid.axis[1].x(j), grid.axis[2].x(k)}};
        const double d = norm(x - Vec3{{.4, .5, .5}}) - .3;
        if (std::abs(d) < 1e-3 * .3) continue;  // chord height at 8 * 4^5 facets: 6e-4 R
        wrong += (d < 0.0) != (cut.tag[n] == tag_body) ? 1 : 0;
      }
  EXPECT_EQ(wrong, 0U);
}

TEST(ImmersedGap, BlocksSegmentsNarrowerThanTheRuleOnly) {
  const Grid grid = uniform_grid(40, 20, 1, 2.0);  // h = 0.05
  // Gaps of 0.8 cells around the node column at 1.025.
  const auto boxes = [&](double gap) {
    return std::vector<BodySurface>{make_box({.5, -1, -1}, {1.025 - gap / 2, 2, 2}),
                                    make_box({1.025 + gap / 2, -1, -1}, {1.5, 2, 2})};
  };
  const Bodies narrow = make_bodies(grid, boxes(.04));
  const CutGrid blocked = cut_for(grid, narrow, 1.0);
  EXPECT_EQ(count_tag(blocked, tag_blocked), 20U);
  EXPECT_EQ(blocked.blocked_segments, 20U);
  EXPECT_EQ(blocked.smallest_gap, 0.0);
  const CutGrid open = cut_for(grid, narrow, 0.0);
  EXPECT_EQ(count_tag(open, tag_blocked), 0U);
  EXPECT_NEAR(open.smallest_gap, .8, 1e-4);  // snapping: 1e-6 of a cell per wall
  const Bodies wide = make_bodies(grid, boxes(.06));
  EXPECT_EQ(count_tag(cut_for(grid, wide, 1.0), tag_blocked), 0U);
}

TEST(ImmersedTree, FindsWhatBruteForceFinds) {
  const Grid grid = uniform_grid(8, 8, 8, 1.0);
  Bodies bodies = make_bodies(grid, {make_sphere({.5, .5, .5}, .3, 4)});
  BodyState& s = bodies[0];
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place(0.0, 1.0);
  for (int pass = 0; pass < 3; ++pass) {
    double worst = 0.0;
    for (int n = 0; n < 200; ++n) {
      const Vec3 x = {{place(random), place(random), place(random)}};
      const Vec3 side = unit(Vec3{{place(random) - .5, place(random) - .5, place(random) - .5}});
      const auto accept = [&](std::int32_t f, const Vec3&) {
        return dot(s.geometry.normal[f], side) > same_side_cosine;
      };
      double best2 = HUGE_VAL;
      TrianglePoint best;
      s.tree.nearest(x, best2, best, accept);
      double brute2 = HUGE_VAL;
      for (std::size_t f = 0; f < s.n_facets(); ++f) {
        if (!accept(static_cast<std::int32_t>(f), {})) continue;
        const Corners& v = s.topology.facet[f];
        const TrianglePoint p =
            nearest_on_triangle(x, s.vertex(v[0]), s.vertex(v[1]), s.vertex(v[2]));
        brute2 = std::min(brute2, norm2(p.point - x));
      }
      worst = std::max(worst, std::abs(best2 - brute2));
    }
    EXPECT_EQ(worst, 0.0);
    // A refit, then a change of shape large enough for a rebuild.
    for (double& x : s.position) x = pass == 0 ? x + .01 * std::sin(40 * x) : .5 + 2.0 * (x - .5);
    compute_facet_geometry(s.topology, s.position, s.geometry);
    s.tree.update(s.topology.facet, s.position);
  }
}

TEST(ImmersedFoot, OfAPointOnTheFarSideOfAThinPlateStaysOnTheCrossedSide) {
  const Grid grid = uniform_grid(20, 20, 1, 1.0);
  const Bodies bodies = make_bodies(grid, {make_box({.5, .2, -1}, {.505, .8, 2}, 4)});
  for (std::size_t f = 0; f < bodies[0].n_facets(); ++f) {
    if (bodies[0].geometry.normal[f][0] > -.9) continue;
    // Three cells behind the front wall, in the gas on the other side.
    const Foot foot = find_foot(bodies, {{.65, .5, .5}}, {{.5, .5, .5}}, 0,
                                static_cast<std::int32_t>(f), nullptr);
    EXPECT_NEAR(foot.normal[0], -1.0, 1e-14);
    EXPECT_NEAR(foot.depth, .15, 1e-14);
    EXPECT_NEAR(foot.point[0], .5, 1e-14);
  }
}

TEST(ImmersedFoot, OfABuriedFacetIsRefused) {
  const Grid grid = uniform_grid(20, 20, 20, 1.0);
  // A sphere half sunk into a block: below the block's top no foot lies on the sphere.
  const Bodies bodies = make_bodies(
      grid, {make_sphere({.5, .5, .5}, .2, 4), make_box({.1, .1, .1}, {.9, .9, .5}, 2)});
  // The sphere's own wall is .1 away, but covered; what is left of it begins at the block's top.
  const Foot foot = nearest_foot(bodies, {{.5, .5, .4}}, 1.0);
  EXPECT_EQ(foot.body, 0);
  EXPECT_GE(foot.point[2], .5 - 1e-6);
}

}  // namespace
}  // namespace ocublast::flow
