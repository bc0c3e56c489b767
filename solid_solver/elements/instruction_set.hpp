#pragma once

#include <cstddef>

namespace ocublast::solid {

/// Variants of the kernels; the best one the processor offers is taken at start. All give the same
/// bits: no contraction, the same operations in the same order per element.
enum class InstructionSet : std::size_t { baseline, avx2, avx512 };
inline constexpr std::size_t n_instruction_sets = 3;

}  // namespace ocublast::solid
