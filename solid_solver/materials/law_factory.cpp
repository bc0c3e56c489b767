#include "solid_solver/materials/law_factory.hpp"

#include <algorithm>
#include <cstdlib>
#include <string_view>

namespace ocublast::solid {

InstructionSet best_instruction_set() {
  using enum InstructionSet;
  InstructionSet best = baseline;
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2")) best = avx2;
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
      __builtin_cpu_supports("avx512vl"))
    best = avx512;
#endif
  const char* wish = std::getenv("OCUBLAST_ISA");
  const std::string_view word = wish != nullptr ? wish : "";
  if (word == "baseline") return baseline;
  if (word == "avx2") return std::min(best, avx2);
  return best;
}

}  // namespace ocublast::solid
