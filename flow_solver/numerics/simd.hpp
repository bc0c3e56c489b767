#pragma once

// A tile of values (a cache line: eight doubles, sixteen floats) as one vector, for the kernel
// files only.

#include <type_traits>

#include "flow_solver/numerics/kernel.hpp"
#ifdef OCU_SINGLE
#include "flow_solver/numerics/simd_single.hpp"
#else
#include "flow_solver/numerics/simd_double.hpp"
#endif

namespace ocublast::flow::inline OCU_PRECISION::OCU_ISA {

#if !(defined(__AVX512F__) && defined(__AVX512DQ__))

/// Two halves that act alike; nested until the half is a register of the machine.
template <class Half>
struct Pair {
  Half lo, hi;
};
template <class H>
OCU_INLINE Pair<H> operator+(Pair<H> a, Pair<H> b) {
  return {a.lo + b.lo, a.hi + b.hi};
}
template <class H>
OCU_INLINE Pair<H> operator-(Pair<H> a, Pair<H> b) {
  return {a.lo - b.lo, a.hi - b.hi};
}
template <class H>
OCU_INLINE Pair<H> operator*(Pair<H> a, Pair<H> b) {
  return {a.lo * b.lo, a.hi * b.hi};
}
template <class H>
OCU_INLINE Pair<H> operator/(Pair<H> a, Pair<H> b) {
  return {a.lo / b.lo, a.hi / b.hi};
}
template <class H>
OCU_INLINE Pair<H> operator-(Pair<H> a) {
  return {-a.lo, -a.hi};
}
template <class H>
OCU_INLINE Pair<H>& operator+=(Pair<H>& a, Pair<H> b) {
  return a = a + b;
}
template <class H>
OCU_INLINE Pair<H>& operator-=(Pair<H>& a, Pair<H> b) {
  return a = a - b;
}
template <class H>
OCU_INLINE Pair<H>& operator*=(Pair<H>& a, Pair<H> b) {
  return a = a * b;
}

using Vec = std::conditional_t<2 * native_lanes == tile_width, Pair<Native>, Pair<Pair<Native>>>;

// Recursion over halves ends at the machine's register.
OCU_INLINE Native madd(Native a, Native b, Native c) {
  return native_madd(a, b, c);
}
OCU_INLINE Native nmadd(Native a, Native b, Native c) {
  return native_nmadd(a, b, c);
}
OCU_INLINE Native vmax(Native a, Native b) {
  return native_max(a, b);
}
OCU_INLINE Native vmin(Native a, Native b) {
  return native_min(a, b);
}
OCU_INLINE Native vsqrt(Native a) {
  return native_sqrt(a);
}
OCU_INLINE unsigned less(Native a, Native b) {
  return native_less(a, b);
}
OCU_INLINE unsigned not_at_least(Native a, Native b) {
  return native_not_at_least(a, b);
}
OCU_INLINE Native select(unsigned mask, Native a, Native b) {
  return native_select(mask, a, b);
}
OCU_INLINE void spread(Native& v, Real s) {
  v = native_splat(s);
}
OCU_INLINE void load_into(Native& v, const Real* p) {
  v = native_load(p);
}
OCU_INLINE void store(Real* p, Native v) {
  native_store(p, v);
}
OCU_INLINE void store_past_caches(Real* p, Native v) {
  native_stream(p, v);
}
template <class T>
inline constexpr int lanes_of = native_lanes;
template <class H>
inline constexpr int lanes_of<Pair<H>> = 2 * lanes_of<H>;
template <class H>
OCU_INLINE void spread(Pair<H>& v, Real s) {
  spread(v.lo, s);
  spread(v.hi, s);
}
template <class H>
OCU_INLINE void load_into(Pair<H>& v, const Real* p) {
  load_into(v.lo, p);
  load_into(v.hi, p + lanes_of<H>);
}
template <class H>
OCU_INLINE void store(Real* p, Pair<H> v) {
  store(p, v.lo);
  store(p + lanes_of<H>, v.hi);
}
template <class H>
OCU_INLINE void store_past_caches(Real* p, Pair<H> v) {
  store_past_caches(p, v.lo);
  store_past_caches(p + lanes_of<H>, v.hi);
}
template <class H>
OCU_INLINE Pair<H> madd(Pair<H> a, Pair<H> b, Pair<H> c) {
  return {madd(a.lo, b.lo, c.lo), madd(a.hi, b.hi, c.hi)};
}
template <class H>
OCU_INLINE Pair<H> nmadd(Pair<H> a, Pair<H> b, Pair<H> c) {
  return {nmadd(a.lo, b.lo, c.lo), nmadd(a.hi, b.hi, c.hi)};
}
template <class H>
OCU_INLINE Pair<H> vmax(Pair<H> a, Pair<H> b) {
  return {vmax(a.lo, b.lo), vmax(a.hi, b.hi)};
}
template <class H>
OCU_INLINE Pair<H> vmin(Pair<H> a, Pair<H> b) {
  return {vmin(a.lo, b.lo), vmin(a.hi, b.hi)};
}
template <class H>
OCU_INLINE Pair<H> vsqrt(Pair<H> a) {
  return {vsqrt(a.lo), vsqrt(a.hi)};
}
template <class H>
OCU_INLINE unsigned less(Pair<H> a, Pair<H> b) {
  return less(a.lo, b.lo) | (less(a.hi, b.hi) << lanes_of<H>);
}
template <class H>
OCU_INLINE unsigned not_at_least(Pair<H> a, Pair<H> b) {
  return not_at_least(a.lo, b.lo) | (not_at_least(a.hi, b.hi) << lanes_of<H>);
}
template <class H>
OCU_INLINE Pair<H> select(unsigned mask, Pair<H> a, Pair<H> b) {
  return {select(mask, a.lo, b.lo), select(mask >> lanes_of<H>, a.hi, b.hi)};
}
OCU_INLINE Vec splat(Real s) {
  Vec v;
  spread(v, s);
  return v;
}
OCU_INLINE Vec load(const Real* p) {
  Vec v;
  load_into(v, p);
  return v;
}
OCU_INLINE void load_columns(const Real* const* row, Index offset, Native node[4]) {
  native_load_columns(row, offset, node);
}
OCU_INLINE void store_four_columns(Real* const* row, Index offset, const Native node[4],
                                   unsigned rows) {
  native_store_columns(row, offset, node, rows);
}
template <class H>
OCU_INLINE void load_columns(const Real* const* row, Index offset, Pair<H> node[4]) {
  H lo[4], hi[4];
  load_columns(row, offset, lo);
  load_columns(row + lanes_of<H>, offset, hi);
  for (int a = 0; a < 4; ++a) node[a] = {lo[a], hi[a]};
}
template <class H>
OCU_INLINE void store_four_columns(Real* const* row, Index offset, const Pair<H> node[4],
                                   unsigned rows) {
  H lo[4], hi[4];
  for (int a = 0; a < 4; ++a) {
    lo[a] = node[a].lo;
    hi[a] = node[a].hi;
  }
  store_four_columns(row, offset, lo, rows);
  store_four_columns(row + lanes_of<H>, offset, hi, rows >> lanes_of<H>);
}
OCU_INLINE void load_four_columns(const Real* const row[tile_width], Index offset, Vec node[4]) {
  load_columns(row, offset, node);
}
OCU_INLINE void store_columns(Real* const row[tile_width], Index offset, const Vec node[tile_width],
                              unsigned rows) {
  for (int a = 0; a < tile_width; a += 4) store_four_columns(row, offset + a, node + a, rows);
}
#endif

#ifdef OCU_SINGLE
OCU_INLINE Vec splat(double s) {
  return splat(static_cast<float>(s));
}
#endif
/// Makes results below the smallest normal number zero while it lives. The tails of filter and
/// compact differences fall by 0.4 to 0.7 per node: within 250 nodes they leave the range of a
/// float, and such numbers cost the machine a hundred times the time.
class TinyIsZero {
 public:
  TinyIsZero() : saved_(_mm_getcsr()) { _mm_setcsr(saved_ | flush_results | flush_operands); }
  ~TinyIsZero() { _mm_setcsr(saved_); }
  TinyIsZero(const TinyIsZero&) = delete;
  TinyIsZero& operator=(const TinyIsZero&) = delete;

 private:
  static constexpr unsigned flush_results = 0x8000,
                            flush_operands = 0x0040;  // of the register MXCSR
  unsigned saved_;
};
/// A kernel as the time step calls it.
template <auto Kernel>
struct Entry;
template <class Result, class... Arguments, Result (*Kernel)(Arguments...)>
struct Entry<Kernel> {
  static Result tiny_is_zero(Arguments... arguments) {
    const TinyIsZero guard;
    return Kernel(arguments...);
  }
  static constexpr auto call = is_single ? &tiny_is_zero : Kernel;
};
template <auto Kernel>
inline constexpr auto entry = Entry<Kernel>::call;

/// A value as fields hold it.
OCU_INLINE Real rounded(double s) {
  return static_cast<Real>(s);
}

OCU_INLINE Vec vabs(Vec a) {
  return vmax(a, -a);
}
/// Largest of the lanes.
OCU_INLINE double largest_lane(Vec a) {
  Real v[tile_width];
  store(v, a);
  Real m = v[0];
  for (int l = 1; l < tile_width; ++l) m = v[l] > m ? v[l] : m;
  return m;
}
OCU_INLINE double smallest_lane(Vec a) {
  return -largest_lane(-a);
}

}  // namespace ocublast::flow::OCU_ISA
