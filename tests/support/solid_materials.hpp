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

/// Material of a law with the example constants of its description.
inline Material make_example(const MaterialLaw& law, double density) {
  const auto laws = make_laws();
  Material material{.name = law.name, .density = density};
  for (std::size_t i = 0; i < laws.size(); ++i)
    if (laws[i].name == law.name) material.law = i;
  for (const auto& constant : law.constants) material.constants.push_back(constant.example);
  material.moduli = law.moduli(material.constants.data());
  return material;
}

/// Two families of fibres along x and y turned by 40 degrees each way, for every cell.
inline std::vector<double> make_fibres(std::size_t n_cells) {
  const double c = 0.76604444311897803520;  // cos 40 deg
  const double s = 0.64278760968653932632;
  std::vector<double> fibres;
  for (std::size_t k = 0; k < n_cells; ++k) fibres.insert(fibres.end(), {c, s, 0.0, c, -s, 0.0});
  return fibres;
}

/// Neo-Hookean material from Young's modulus (Pa) and Poisson's ratio.
inline Material make_neo_hookean(double young, double nu, double density) {
  return make_material("neo_hookean", young / (2.0 * (1.0 + nu)), young / (3.0 * (1.0 - 2.0 * nu)),
                       density);
}

}  // namespace ocublast::solid::test
