#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <string>

#include "tests/support/solid_runs.hpp"

namespace ocublast::solid::test {

struct Bent {
  double largest = 0.0;  ///< of the tip, m
  double energy_error = 0.0;
  double hourglass = 0.0;  ///< largest, over the initial energy
};

/// Bending column of Aguirre, Gil, Bonet & Carreno (2014): 1 x 1 x 6 m, n elements across, clamped
/// at z = 0, E = 17 MPa, rho = 1100 kg/m^3, thrown at 10 z/6 m/s, no load; `ratio` is K/G. The
/// largest motion of the tip converges to 2.87 m (2.88 m for K/G = 10), at 0.456 s.
inline Bent bend(const std::string& element, Shape shape, int n, double ratio) {
  const double nu = (3.0 * ratio - 2.0) / (2.0 * (3.0 * ratio + 1.0));
  auto setup = make_setup(make_block_of(shape, {.cells = {n, n, 6 * n}, .size = {1.0, 1.0, 6.0}}),
                          make_neo_hookean(17e6, nu, 1100.0), element);
  setup.fixed.push_back(fixed_set(*setup.mesh, "z0", {true, true, true}));
  SolidRun solid(setup);
  std::size_t corner = 0;
  for (std::size_t a = 0; a < solid.mesh().n_nodes(); ++a) {
    const double* x = &solid.mesh().nodes[3 * a];
    solid.set_velocity(static_cast<std::int32_t>(a), {10.0 * x[2] / 6.0, 0.0, 0.0});
    if (x[0] > 0.999 && x[1] > 0.999 && x[2] > 5.999) corner = a;
  }
  Bent bent;
  CellResults cells;
  bent.energy_error = run(solid, 0.5, 50, [&](double) {
    bent.largest = std::max(bent.largest, solid.state().displacement[4 * corner]);
    solid.assembly().evaluate(solid.state().displacement, cells);
    double sum = 0.0;
    for (std::size_t c = 0; c < solid.mesh().n_cells(); ++c)
      sum += cells[c * n_evaluated + hourglass_energy];
    bent.hourglass = std::max(bent.hourglass, sum / solid.sums().initial);
  });
  std::printf("| %s | %d | %g | %.3f | %+.1f %% | %.1e | %.1f %% |\n", element.c_str(), n, ratio,
              bent.largest, 100.0 * (bent.largest / 2.87 - 1.0), bent.energy_error,
              100.0 * bent.hourglass);
  std::fflush(stdout);
  return bent;
}

inline constexpr const char* bending_titles =
    "| element | N | K/G | largest u_x, m | to 2.87 | energy error | hourglass |\n";

}  // namespace ocublast::solid::test
