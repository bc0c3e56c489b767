#pragma once

#include <array>
#include <string>
#include <vector>

#include "solid_solver/elements/kernel_table.hpp"
#include "solid_solver/materials/law.hpp"

namespace ocublast::solid {

/// Variants of the kernels; the best one the processor offers is taken at start. All give the same
/// bits: no contraction, the same operations in the same order per element.
enum class InstructionSet : std::size_t { baseline, avx2, avx512 };
inline constexpr std::size_t n_instruction_sets = 3;

/// A law as the factory knows it.
struct MaterialLaw {
  std::string name;
  std::vector<LawConstant> constants;
  ElasticModuli (*moduli)(const double* constants) = nullptr;
  std::array<KernelTable, n_instruction_sets> kernels{};
};

/// All laws, in the order of OCU_SOLID_LAWS.
[[nodiscard]] std::vector<MaterialLaw> make_laws();

/// The widest instruction set of this processor; the environment variable OCUBLAST_ISA (baseline,
/// avx2, avx512) lowers it, for comparisons.
[[nodiscard]] InstructionSet best_instruction_set();

}  // namespace ocublast::solid
