// Sedov's point blast in one dimension (spherical, cylindrical, planar) and in three.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <numbers>
#include <vector>

#include "tests/verification/flow_run.hpp"

namespace ocublast::flow {
namespace {

// Energy of Sedov's solution for gamma = 1.4 with the front at t^(2/(m + 3)), rho = 1: Kamm and
// Timmes (2007), LA-UR-07-2849; both sides of the plane.
constexpr double energy_of[3] = {1.07748558, 0.98407402, 0.85107185};
// Ambient pressure: that of a shock of Mach 52 at the end (spherical); it changes the front by
// M^-2.
constexpr double ambient = 1e-4;
constexpr double front = 0.75;
// Loaded cells of a line of 800: the gas in them at the start is 3e-5 (sphere), 1e-4 (cylinder) and
// 3e-3 (plane) of what the front has swept at the end, so the source counts as a point.
constexpr int loaded_cells[3] = {2, 8, 24};

const char* name_of(Scheme s) {
  return s == Scheme::muscl ? "muscl" : "compact6";
}

/// Radius at which p falls through half of its maximum, from the outside, along a line of values.
double half_height(const std::vector<double>& r, const std::vector<double>& p) {
  const double peak = *std::max_element(p.begin(), p.end());
  for (std::size_t i = p.size() - 1; i > 0; --i) {
    if (p[i - 1] < 0.5 * peak) continue;
    return r[i] - (r[i] - r[i - 1]) * (0.5 * peak - p[i]) / (p[i - 1] - p[i]);
  }
  return 0.0;
}

FlowOptions sedov_options(Scheme scheme) {
  FlowOptions o = unit_options();
  o.scheme = scheme;
  return o;
}

/// Ratio of the front's radius to Sedov's on a line of n cells with the energy in the first ones.
double front_ratio(int m, Scheme scheme, RunSummary* run) {
  constexpr int n = 800;
  const double p0 = ambient;
  Grid g = uniform_grid({n, 1, 1}, {0, 0, 0}, {1, 1, 1});
  g.geometry =
      m == 2 ? Geometry::spherical : (m == 1 ? Geometry::cylindrical : Geometry::cartesian);
  const int loaded = loaded_cells[m];
  double volume = 0.0;
  for (int i = 0; i < loaded; ++i) volume += cell_volume(g, i, 0, 0);
  const double energy = m == 0 ? 0.5 * energy_of[0] : energy_of[m];
  Boundaries faces = all_faces(BoundaryKind::outflow, {.rho = 1.0, .p = p0});
  faces[0].kind = BoundaryKind::symmetry;
  Flow flow(g, faces, sedov_options(scheme));
  flow.set_state_by_index([&](int i, int, int) {
    return State{.rho = 1.0, .p = p0 + (i < loaded ? 0.4 * energy / volume : 0.0)};
  });
  *run = run_to(flow, std::pow(front, 0.5 * (m + 3)));
  std::vector<double> r, p;
  for (int i = 0; i < n; ++i) {
    r.push_back(g.axis[0].x(i));
    p.push_back(flow.primitives()(0, i, 0, 0) * flow.primitives()(4, i, 0, 0));
  }
  return half_height(r, p) / front;
}

void check_line(int m, Scheme scheme) {
  RunSummary run;
  const double ratio = front_ratio(m, scheme, &run);
  std::printf("sedov %s, m = %d, 800 cells: R/R exact %.5f, %d steps, %d redone\n", name_of(scheme),
              m, ratio, run.steps, run.redone);
  // The half height of a front smeared over three cells of 1/600 of its radius lies up to one cell
  // out.
  EXPECT_NEAR(ratio, 1.0, 3e-3);
}

#ifndef OCU_LONG_TESTS
TEST(Sedov, LineFrontOfMuscl) {
  for (int m = 2; m >= 0; --m) check_line(m, Scheme::muscl);
}

#else
TEST(Sedov, LineFrontOfCompact6) {
  for (int m = 2; m >= 0; --m) check_line(m, Scheme::compact6);
}
#endif

struct Cube {
  double mean = 0.0, axis = 0.0, diagonal = 0.0;
};

/// Octant of 64^3 cells, m + 1 directions present, the energy in the innermost cell of each.
Cube cube_front(int m, Scheme scheme, RunSummary* run) {
  constexpr int n = 32;
  const Grid g = uniform_grid({n, m > 0 ? n : 1, m > 1 ? n : 1}, {0, 0, 0}, {1, 1, 1});
  const double h = 1.0 / n, share = m == 2 ? 0.125 : (m == 1 ? 0.25 : 0.5);
  const double loaded = share * energy_of[m] / cell_volume(g, 0, 0, 0);
  constexpr double p0 = 1e-3;
  Boundaries faces = all_faces(BoundaryKind::outflow, {.rho = 1.0, .p = p0});
  faces[0].kind = faces[2].kind = faces[4].kind = BoundaryKind::symmetry;
  FlowOptions o = sedov_options(scheme);
  Flow flow(g, faces, o);
  flow.set_state_by_index([&](int i, int j, int k) {
    const bool in = i == 0 && j == 0 && k == 0;
    return State{.rho = 1.0, .p = p0 + (in ? 0.4 * loaded : 0.0)};
  });
  *run = run_to(flow, std::pow(front, 0.5 * (m + 3)));
  const auto W = flow.primitives();
  const auto p = [&](int i, int j, int k) { return W(0, i, j, k) * W(4, i, j, k); };
  const int nj = g.axis[1].n, nk = g.axis[2].n;
  // Means over shells of one cell; the axis from the cells beside it.
  std::vector<double> r, shell(static_cast<std::size_t>(n), 0.0),
      count(static_cast<std::size_t>(n), 0.0);
  std::vector<double> along, r_diagonal, diagonal;
  for (int i = 0; i < n; ++i) {
    r.push_back((i + 0.5) * h);
    along.push_back(p(i, 0, 0));
    r_diagonal.push_back((i + 0.5) * h * std::sqrt(m + 1.0));
    diagonal.push_back(p(i, std::min(i, nj - 1), std::min(i, nk - 1)));
  }
  for (int k = 0; k < nk; ++k)
    for (int j = 0; j < nj; ++j)
      for (int i = 0; i < n; ++i) {
        const double x = (i + 0.5) * h, y = m > 0 ? (j + 0.5) * h : 0.0,
                     z = m > 1 ? (k + 0.5) * h : 0.0;
        const auto s = static_cast<std::size_t>(std::sqrt(x * x + y * y + z * z) / h);
        if (s >= shell.size()) continue;
        shell[s] += p(i, j, k);
        count[s] += 1.0;
      }
  for (std::size_t s = 0; s < shell.size(); ++s) shell[s] /= std::max(1.0, count[s]);
  // The cells beside the axis lie h / sqrt 2 (h / 2) off it.
  const double off = m == 2 ? 0.5 : (m == 1 ? 0.25 : 0.0);
  for (double& x : r) x = std::sqrt(x * x + off * h * h);
  const double on_axis = half_height(r, along) / front;
  for (std::size_t i = 0; i < r.size(); ++i) r[i] = (static_cast<double>(i) + 0.5) * h;
  return {half_height(r, shell) / front, on_axis, half_height(r_diagonal, diagonal) / front};
}

void check_cube(int m, Scheme scheme) {
  RunSummary run;
  const Cube c = cube_front(m, scheme, &run);
  std::printf(
      "sedov %s, 64 cells a side, %d-D: R/R exact mean %.4f, axis %.4f, diagonal %.4f, %d steps, "
      "%d redone\n",
      name_of(scheme), m + 1, c.mean, c.axis, c.diagonal, run.steps, run.redone);
  // The half height of a captured front lies out by up to half a cell, 2.1 % of R (aimed at: 1.5
  // %); along the axis, where a start in single cells leaves its imprint, by a cell.
  EXPECT_NEAR(c.mean, 1.0, 0.021);
  EXPECT_NEAR(c.axis, 1.0, scheme == Scheme::muscl ? 0.045 : 0.04);
  EXPECT_NEAR(c.diagonal, 1.0, 0.04);
}

#ifndef OCU_LONG_TESTS
TEST(Sedov, MusclSurvivesWithTheEnergyInTheInnermostCells) {
  for (int m = 2; m >= 0; --m) check_cube(m, Scheme::muscl);
}
#else
TEST(Sedov, Compact6SurvivesWithTheEnergyInTheInnermostCells) {
  for (int m = 2; m >= 0; --m) check_cube(m, Scheme::compact6);
}
#endif

}  // namespace
}  // namespace ocublast::flow
