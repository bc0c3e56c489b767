#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "coupler/base/errors.hpp"
#include "tests/support/solid_runs.hpp"

namespace ocublast::solid::test {

struct StepLimit {
  double solver = 0.0;    ///< s, the solver's own choice
  double measured = 0.0;  ///< s, largest stable by bisection
  double transit = 0.0;   ///< s, smallest length / sound speed
};

/// Bisects on the step of a small free vibration of a block: stable when the energy stays bounded
/// over `steps` steps.
inline StepLimit find_step_limit(const ElementType& type, double nu, bool distorted, int steps) {
  auto mesh = make_block_of(
      type.shape,
      {.cells = {4, 4, 4}, .size = {1.0, 1.0, 1.0}, .distortion = distorted ? 0.2 : 0.0});
  auto setup = make_setup(mesh, make_neo_hookean(1e6, nu, 1000.0), type.name);
  setup.control.energy_error_limit = 1e300;
  setup.control.check_every = 1 << 30;
  StepLimit limit;
  {
    SolidRun solid(setup);
    limit.solver = solid.stable_step();
    limit.transit = solid.assembly().element_step(solid.state().displacement).transit;
  }
  const auto stable = [&](double factor) {
    auto forced = setup;
    forced.control.safety = 0.9 * factor;
    SolidRun solid(forced);
    for (std::size_t n = 0; n < mesh.n_nodes(); ++n)
      for (std::size_t i = 0; i < 3; ++i) {
        std::array<double, 3> v{};
        for (std::size_t k = 0; k < 3; ++k)
          v[k] = 1e-6 * std::sin(37.0 * static_cast<double>(n) + 11.0 * static_cast<double>(k));
        solid.set_velocity(static_cast<std::int32_t>(n), v);
      }
    const double begin = solid.sums().initial;
    CellResults cells;
    try {
      solid.advance({.t_begin = 0.0, .t_end = steps * solid.stable_step()});
    } catch (const NumericsError&) {
      return false;
    }
    double kinetic = 0.0;
    for (std::size_t n = 0; n < mesh.n_nodes(); ++n)
      for (std::size_t i = 0; i < 3; ++i)
        kinetic += 0.5 * solid.nodal_mass()[n] * std::pow(solid.state().velocity[4 * n + i], 2);
    return kinetic < 10.0 * begin;
  };
  double low = 0.9;
  double high = 1.6;
  if (!stable(low)) return limit;  // measured stays 0: below the solver's choice
  for (int i = 0; i < 6; ++i) {
    const double middle = 0.5 * (low + high);
    (stable(middle) ? low : high) = middle;
  }
  limit.measured = low * limit.solver;
  return limit;
}

inline void check_step_limit(const ElementType& type, double nu, bool distorted, int steps) {
  const auto limit = find_step_limit(type, nu, distorted, steps);
  std::printf("| %s | %.4f | %s | %.3f L/c | %.3f L/c | %+.1f %% |\n", type.name.c_str(), nu,
              distorted ? "yes" : "no", limit.measured / limit.transit,
              limit.solver / limit.transit, 100.0 * (limit.measured / limit.solver - 1.0));
  // Bisection stops at 1.1 % below; the Ritz value underestimates omega by less than the safety.
  EXPECT_GT(limit.measured, 1.05 * limit.solver) << type.name;
  EXPECT_LT(limit.measured, 1.30 * limit.solver) << type.name;
  // The rule of the element alone must not be above the limit either.
  EXPECT_GT(limit.measured, type.step_factor * limit.transit) << type.name;
}

}  // namespace ocublast::solid::test
