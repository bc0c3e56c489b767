#pragma once

#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "solid_solver/materials/law.hpp"

namespace ocublast::solid {

/// A law with its numbers and density: what a tissue is made of.
struct Material {
  std::string name;
  std::size_t law = 0;            ///< index into make_laws()
  std::vector<double> constants;  ///< of the law, SI
  double density = 0.0;           ///< kg/m^3
  ElasticModuli moduli;           ///< Pa

  /// Speed of pressure waves at zero strain, sqrt((K + 4 G / 3) / rho), m/s.
  [[nodiscard]] double sound_speed() const {
    return std::sqrt((moduli.bulk + 4.0 / 3.0 * moduli.shear) / density);
  }
};

}  // namespace ocublast::solid
