#pragma once

#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "solid_solver/materials/moduli.hpp"

namespace ocublast::solid {

/// A law with its numbers and density: what a tissue is made of.
struct Material {
  std::string name;
  std::size_t law = 0;            ///< index into make_laws()
  std::vector<double> constants;  ///< of the law, SI
  double density = 0.0;           ///< kg/m^3
  ElasticModuli moduli;           ///< Pa
  /// Prony series of the isochoric stress: parts that relax and their times (s). The law's
  /// constants are the instantaneous ones; the long-term shear modulus is (1 - sum of ratios) G.
  std::vector<double> prony_ratios;
  std::vector<double> prony_times;
  double viscosity = 0.0;          ///< Newtonian shear viscosity, Pa s
  double stiffness_damping = 0.0;  ///< s: damping stress = this times the rate of the elastic one

  /// Speed of pressure waves at zero strain, sqrt((K + 4 G / 3) / rho), m/s.
  [[nodiscard]] double sound_speed() const {
    return std::sqrt((moduli.bulk + 4.0 / 3.0 * moduli.shear) / density);
  }
  /// Shear viscosity of both kinds, Pa s.
  [[nodiscard]] double shear_viscosity() const {
    return viscosity + stiffness_damping * moduli.shear;
  }
  [[nodiscard]] bool rate_dependent() const {
    return !prony_ratios.empty() || shear_viscosity() > 0.0;
  }
};

}  // namespace ocublast::solid
