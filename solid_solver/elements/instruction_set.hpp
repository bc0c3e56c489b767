#pragma once

#include <cstddef>

namespace ocublast::solid {

/// Variants of the kernels; the best one the processor offers is taken at start. They do the same
/// operations in the same order per element, but the wider ones fuse multiplications with
/// additions: results differ by rounding. Each gives the same bits for any number of threads.
enum class InstructionSet : std::size_t { baseline, avx2, avx512 };
inline constexpr std::size_t n_instruction_sets = 3;

}  // namespace ocublast::solid
