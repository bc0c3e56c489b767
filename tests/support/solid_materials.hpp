#pragma once

#include <string>
#include <vector>

#include "solid_solver/materials/law_factory.hpp"
#include "solid_solver/materials/material.hpp"

namespace ocublast::solid::test {

/// Material of a law whose constants are shear and bulk modulus (Pa), in that order.
inline Material make_material(const std::string& law, double shear, double bulk, double density) {
  const auto laws = make_laws();
  for (std::size_t i = 0; i < laws.size(); ++i)
    if (laws[i].name == law)
      return {.name = law,
              .law = i,
              .constants = {shear, bulk},
              .density = density,
              .moduli = {.shear = shear, .bulk = bulk}};
  return {};
}

/// Neo-Hookean material from Young's modulus (Pa) and Poisson's ratio.
inline Material make_neo_hookean(double young, double nu, double density) {
  return make_material("neo_hookean", young / (2.0 * (1.0 + nu)), young / (3.0 * (1.0 - 2.0 * nu)),
                       density);
}

}  // namespace ocublast::solid::test
