#pragma once

#include <cmath>
#include <vector>

#include "tests/support/solid_runs.hpp"

namespace ocublast::solid::test {

/// The elastic beam of Turek & Hron (2006): 0.35 x 0.02 m, clamped at its left end, plane strain,
/// rho = 1000 kg/m^3, mu = 0.5 MPa, nu = 0.4, St-Venant-Kirchhoff; `across` quads over its height.
/// Its root is straight, or, as published, on the cylinder of radius 0.05 m that bears it: 0.35 m
/// are those of the middle line, the outer fibres are 1 mm longer.
enum class BeamRoot { straight, round };
inline SolidSetup make_beam(int across, BeamRoot root) {
  auto mesh = make_block_of(Shape::quad4,
                            {.cells = {35 * across / 2, across, 1}, .size = {0.35, 0.02, 1.0}});
  if (root == BeamRoot::round)
    for (std::size_t n = 0; n < mesh.n_nodes(); ++n) {
      const double y = mesh.nodes[3 * n + 1] - 0.01;
      const double start = std::sqrt(0.05 * 0.05 - y * y) - 0.05;
      mesh.nodes[3 * n] += (1.0 - mesh.nodes[3 * n] / 0.35) * start;
    }
  const double mu = 0.5e6;
  const double bulk = 2.0 * mu * 1.4 / (3.0 * (1.0 - 0.8));
  auto setup = make_setup(mesh, make_material("st_venant_kirchhoff", mu, bulk, 1000.0));
  setup.fixed.push_back(fixed_set(*setup.mesh, "x0", {true, true, true}));
  return setup;
}

/// The node in the middle of the right end.
inline std::size_t beam_tip(const SolidMesh& mesh) {
  std::size_t tip = 0;
  for (std::size_t n = 0; n < mesh.n_nodes(); ++n)
    if (std::hypot(mesh.nodes[3 * n] - 0.35, mesh.nodes[3 * n + 1] - 0.01) < 1e-9) tip = n;
  return tip;
}

}  // namespace ocublast::solid::test
