#pragma once

#include <array>
#include <string>
#include <vector>

#include "solid_solver/elements/instruction_set.hpp"
#include "solid_solver/elements/point_buffer.hpp"
#include "solid_solver/materials/moduli.hpp"

namespace ocublast::solid {

/// A law as the factory knows it.
struct MaterialLaw {
  std::string name;
  std::string help;
  std::vector<LawConstant> constants;
  std::size_t n_fields = 0;  ///< numbers per element behind the constants
  bool finite_strain = true;
  ElasticModuli (*moduli)(const double* constants) = nullptr;
  std::array<LawKernels, n_instruction_sets> kernels{};

  [[nodiscard]] std::size_t n_values() const { return constants.size() + n_fields; }
};

/// All laws, in the order of their names.
[[nodiscard]] std::vector<MaterialLaw> make_laws();

/// The widest instruction set of this processor that was compiled; the environment variable
/// OCUBLAST_ISA (baseline, avx2, avx512) lowers it, for comparisons.
[[nodiscard]] InstructionSet best_instruction_set();
/// Whether the kernels of a set were compiled (OCU_KERNEL_SETS) and run here.
[[nodiscard]] bool has_instruction_set(InstructionSet set);

}  // namespace ocublast::solid
