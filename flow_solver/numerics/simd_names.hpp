#pragma once

// What every kernel file starts from. They are compiled once per instruction set with OCU_ISA set
// to a name of its own, so nothing in them may have external linkage under a shared name: a
// function compiled for AVX-512 must never be picked by the linker for an older machine.

#include "flow_solver/grid/precision.hpp"

#ifndef OCU_ISA
#error "kernel files define OCU_ISA"
#endif
#define OCU_INLINE [[gnu::always_inline]] inline
#define OCU_FORCE __attribute__((always_inline))  // for lambdas

namespace ocublast::flow::inline OCU_PRECISION::OCU_ISA {

using Index = long;

}  // namespace ocublast::flow::OCU_ISA
