#pragma once

// Transport of the gas, for one value and for a vector.

#include "flow_solver/numerics/kernel.hpp"
#include "flow_solver/numerics/simd.hpp"

namespace ocublast::flow::inline OCU_PRECISION::OCU_ISA {

/// One value where a vector does not fit: ends of x-lines, lanes of cut lines.
struct Scalar {
  double v;
};
OCU_INLINE Scalar operator+(Scalar a, Scalar b) {
  return {a.v + b.v};
}
OCU_INLINE Scalar operator-(Scalar a, Scalar b) {
  return {a.v - b.v};
}
OCU_INLINE Scalar operator*(Scalar a, Scalar b) {
  return {a.v * b.v};
}
OCU_INLINE Scalar operator/(Scalar a, Scalar b) {
  return {a.v / b.v};
}
OCU_INLINE Scalar vsqrt(Scalar a) {
  return {__builtin_sqrt(a.v)};
}

/// Reads, writes and makes either kind.
template <class T>
struct Access;
template <>
struct Access<Scalar> {
  OCU_INLINE static Scalar get(const Real* p) { return {*p}; }
  OCU_INLINE static void put(Real* p, Scalar s) { *p = rounded(s.v); }
  OCU_INLINE static Scalar all(double s) { return {s}; }
};
template <>
struct Access<Vec> {
  OCU_INLINE static Vec get(const Real* p) { return load(p); }
  OCU_INLINE static void put(Real* p, Vec s) { store(p, s); }
  OCU_INLINE static Vec all(double s) { return splat(s); }
};

/// Shear viscosity of the gas [Pa s] at temperature T [K]: constant, or Sutherland's law (needs
/// T^1.5 = T sqrt T).
template <class T>
OCU_INLINE T gas_viscosity(const Context& ctx, T temperature) {
  using A = Access<T>;
  if (!ctx.sutherland) return A::all(ctx.mu0);
  const T ratio = temperature * A::all(1.0 / ctx.sutherland_T0);
  return A::all(ctx.mu0) * ratio * vsqrt(ratio) *
         (A::all(ctx.sutherland_T0 + ctx.sutherland_S) / (temperature + A::all(ctx.sutherland_S)));
}

}  // namespace ocublast::flow::OCU_ISA
