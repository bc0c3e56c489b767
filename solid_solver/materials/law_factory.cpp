#include "solid_solver/materials/law_factory.hpp"

#include <cstdlib>
#include <string_view>

namespace ocublast::solid {

bool has_instruction_set(InstructionSet set) {
  using enum InstructionSet;
  if (make_laws().front().kernels[static_cast<std::size_t>(set)].stress == nullptr) return false;
#if defined(__x86_64__)
  if (set == avx2) return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  if (set == avx512)
    return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
           __builtin_cpu_supports("avx512vl");
#endif
  return true;
}

InstructionSet best_instruction_set() {
  using enum InstructionSet;
  const char* wish = std::getenv("OCUBLAST_ISA");
  const std::string_view word = wish != nullptr ? wish : "";
  const InstructionSet limit = word == "baseline" ? baseline : word == "avx2" ? avx2 : avx512;
  for (const auto set : {avx512, avx2, baseline})
    if (set <= limit && has_instruction_set(set)) return set;
  return has_instruction_set(avx2) ? avx2 : avx512;  // nothing that low was compiled
}

}  // namespace ocublast::solid
