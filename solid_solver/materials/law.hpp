#pragma once

#include "solid_solver/elements/lanes.hpp"

// How a material law is written: one header with a struct of static members
//   name, finite_strain (kinematics of Gradient), enum of constants, their description, moduli(),
//   volumetric_stress(c, j), isochoric_stress(c, gradient, P), volumetric_energy, isochoric_energy.
// The stress is P = isochoric + volumetric_stress * g.cof; both are derivatives of the energies.
// The name is added to OCU_SOLID_LAWS in CMakeLists.txt, which compiles the law into every element
// for every instruction set and puts it into the factory.
#define OCU_LAW_INLINE static inline __attribute__((always_inline))

namespace ocublast::solid {

/// One constant of a law as it stands in the case file.
struct LawConstant {
  const char* key;
  const char* unit;
  const char* help;
};

/// Moduli at zero strain, Pa; they set wave speeds and steps.
struct ElasticModuli {
  double shear = 0.0;
  double bulk = 0.0;
};

}  // namespace ocublast::solid
