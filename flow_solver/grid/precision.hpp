#pragma once

namespace ocublast::flow {

// The flow is compiled twice from one source: in double precision, and with OCU_SINGLE in single.
// What depends on it lives in an inline namespace of its precision, so that a linker can never mix
// the two.
#ifdef OCU_SINGLE
#define OCU_PRECISION single_precision
using Real = float;
#else
#define OCU_PRECISION double_precision
using Real = double;
#endif

/// What fields and kernels hold. Grid, clock, surfaces, tables while they are made, sums and
/// read-outs are double in both.
inline namespace OCU_PRECISION {
inline constexpr bool is_single = sizeof(Real) == 4;
/// Of a program, and of what a case asks for.
enum class Precision { double_precision, single_precision };
inline constexpr Precision own_precision =
    is_single ? Precision::single_precision : Precision::double_precision;
inline constexpr const char* precision_name = is_single ? "single" : "double";
}  // namespace OCU_PRECISION

}  // namespace ocublast::flow
