#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>

#include "solid_solver/mesh/cell_geometry.hpp"
#include "tests/support/solid_runs.hpp"

namespace ocublast::solid::test {

struct Cook {
  double ux = 0.0;
  double uy = 0.0;
  std::size_t steps = 0;
};

/// Cook's membrane at finite strain, plane strain, n x n quads: 48 wide, 44 high on the clamped
/// left, 16 on the right, which bears a shear force of 100; mu = 80.194, K = 400 889.8 (any
/// consistent units).
inline Cook solve_cook(int n) {
  auto mesh = make_block_of(Shape::quad4, {.cells = {n, n, 1}, .size = {1.0, 1.0, 1.0}});
  for (std::size_t a = 0; a < mesh.n_nodes(); ++a) {
    const double s = mesh.nodes[3 * a];
    const double t = mesh.nodes[3 * a + 1];
    mesh.nodes[3 * a] = 48.0 * s;
    mesh.nodes[3 * a + 1] = 44.0 * s + t * (44.0 + s * (16.0 - 44.0));
  }
  auto setup = make_setup(mesh, make_material("neo_hookean", 80.194, 400889.8, 1.0));
  setup.fixed.push_back(fixed_set(*setup.mesh, "x0", {true, true, true}));
  NodeLoad load{.nodes = setup.mesh->node_sets.at("x1"),
                .force = {0.0, 100.0, 0.0},
                .factor = {{0.0}, {1.0}}};
  for (const auto node : load.nodes) {
    const double y = setup.mesh->nodes[3 * static_cast<std::size_t>(node) + 1];
    const bool end = y < 44.0 + 1e-9 || y > 60.0 - 1e-9;
    load.share.push_back((end ? 0.5 : 1.0) / n);
  }
  setup.node_loads.push_back(load);
  SolidRun solid(setup);
  Cook cook;
  cook.steps = solid.relax(1e-5, 2000000).steps;
  const std::size_t tip = solid.mesh().n_nodes() - 1;
  cook.ux = solid.state().displacement[4 * tip];
  cook.uy = solid.state().displacement[4 * tip + 1];
  return cook;
}

/// Per cell of a turned sphere, fibres along the parallel and along the meridian: both lie in the
/// surface and are alike in an inflation, which so keeps its spherical symmetry.
inline std::vector<double> make_surface_fibres(const SolidMesh& mesh) {
  std::vector<double> fibres;
  for (std::size_t c = 0; c < mesh.n_cells(); ++c) {
    const auto x = cell_centre(mesh, c);
    const double r = std::hypot(x[0], x[1]);
    fibres.insert(fibres.end(), {0.0, 0.0, 1.0, -x[1] / r, x[0] / r, 0.0});
  }
  return fibres;
}

/// Inflates a thick sphere (radii 1 and 2 m, axisymmetric quads over a quarter) by `pressure` Pa
/// and compares with the exact pressure of the stretch it takes, incompressible:
/// p = int_lb^la W'(l) / (l^3 - 1) dl, W the energy at stretches (l^-2, l, l). Laws with fibres get
/// those of make_surface_fibres.
inline void check_inflation(const std::string& law, std::vector<double> constants, int around,
                            int across, double pressure,
                            const std::function<double(double)>& slope) {
  auto mesh = make_block_of(Shape::quad4, {.cells = {across, around, 1}, .size = {1.0, 1.0, 1.0}});
  for (std::size_t n = 0; n < mesh.n_nodes(); ++n) {
    const double r = std::pow(2.0, mesh.nodes[3 * n]);  // finer inside
    const double angle = 0.5 * pi * mesh.nodes[3 * n + 1];
    mesh.nodes[3 * n] = r * std::cos(angle);
    mesh.nodes[3 * n + 1] = r * std::sin(angle);
  }
  for (const auto n : mesh.node_sets.at("y1")) mesh.nodes[3 * static_cast<std::size_t>(n)] = 0.0;
  Material material{.name = law, .constants = std::move(constants), .density = 1000.0};
  const auto laws = make_laws();
  while (laws[material.law].name != law) ++material.law;
  if (laws[material.law].n_fields > 0) mesh.fibres = make_surface_fibres(mesh);
  material.moduli = laws[material.law].moduli(material.constants.data());
  auto setup = make_setup(mesh, material, "quad4_axisymmetric");
  setup.fixed.push_back(fixed_set(*setup.mesh, "y0", {false, true, false}));
  setup.fixed.push_back(fixed_set(*setup.mesh, "y1", {true, false, false}));
  setup.pressures.push_back(
      {.facets = setup.mesh->face_sets.at("x0"), .pressure = {{0.0}, {pressure}}});
  SolidRun solid(setup);
  const auto steps = solid.relax(1e-5, 2000000).steps;
  const auto stretch = [&](const char* set) {
    double sum = 0.0;
    const auto& nodes = solid.mesh().node_sets.at(set);
    for (const auto n : nodes) {
      const double* X = &solid.mesh().nodes[3 * static_cast<std::size_t>(n)];
      const double* d = &solid.state().displacement[4 * static_cast<std::size_t>(n)];
      sum += std::hypot(X[0] + d[0], X[1] + d[1]) / std::hypot(X[0], X[1]);
    }
    return sum / static_cast<double>(nodes.size());
  };
  const double la = stretch("x0");
  const double lb = std::cbrt((8.0 + la * la * la - 1.0) / 8.0);
  double exact = 0.0;  // midpoint rule, 2000 intervals: 1e-7
  for (int k = 0; k < 2000; ++k) {
    const double l = lb + (la - lb) * (k + 0.5) / 2000.0;
    exact += slope(l) / (l * l * l - 1.0) * (la - lb) / 2000.0;
  }
  std::printf("%s: inner stretch %.4f, pressure %.6g of exact %.6g Pa (%+.2f %%), %zu steps\n",
              law.c_str(), la, pressure, exact, 100.0 * (pressure / exact - 1.0), steps);
  EXPECT_GT(la, 1.05);
  EXPECT_NEAR(pressure, exact, 0.005 * exact);
}

}  // namespace ocublast::solid::test
