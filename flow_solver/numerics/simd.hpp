#pragma once

// Eight doubles as one value, for the kernel files only. They are compiled once per instruction set
// with OCU_ISA set to a name of its own, so nothing here may have external linkage under a shared
// name: a function compiled for AVX-512 must never be picked by the linker for an older machine.

#include <immintrin.h>

#ifndef OCU_ISA
#error "simd.hpp belongs to kernel files that define OCU_ISA"
#endif
#define OCU_INLINE [[gnu::always_inline]] inline
#define OCU_FORCE __attribute__((always_inline))  // for lambdas

namespace ocublast::flow::OCU_ISA {

using Index = long;

#if defined(__AVX512F__) && defined(__AVX512DQ__)

using Vec = __m512d;
OCU_INLINE Vec splat(double s) { return _mm512_set1_pd(s); }
OCU_INLINE Vec load(const double* p) { return _mm512_loadu_pd(p); }
OCU_INLINE void store(double* p, Vec v) { _mm512_storeu_pd(p, v); }
/// Past the caches, for results that are not read soon; p must be aligned to 64 bytes.
OCU_INLINE void store_past_caches(double* p, Vec v) { _mm512_stream_pd(p, v); }
/// a b + c and c - a b with one rounding, where the machine has it.
OCU_INLINE Vec madd(Vec a, Vec b, Vec c) { return _mm512_fmadd_pd(a, b, c); }
OCU_INLINE Vec nmadd(Vec a, Vec b, Vec c) { return _mm512_fnmadd_pd(a, b, c); }
OCU_INLINE Vec vmax(Vec a, Vec b) { return _mm512_max_pd(a, b); }
OCU_INLINE Vec vmin(Vec a, Vec b) { return _mm512_min_pd(a, b); }
OCU_INLINE Vec vsqrt(Vec a) { return _mm512_sqrt_pd(a); }
/// Bit l is set where a < b in lane l.
OCU_INLINE unsigned less(Vec a, Vec b) {
  return static_cast<unsigned>(_mm512_cmp_pd_mask(a, b, _CMP_LT_OQ));
}
/// Bit l is set unless a >= b in lane l (also for not-a-number).
OCU_INLINE unsigned not_at_least(Vec a, Vec b) {
  return static_cast<unsigned>(_mm512_cmp_pd_mask(a, b, _CMP_NGE_UQ));
}
/// Lane l is a where bit l of the mask is set, else b.
OCU_INLINE Vec select(unsigned mask, Vec a, Vec b) {
  return _mm512_mask_blend_pd(static_cast<__mmask8>(mask), b, a);
}
/// Four rows to columns in both halves: out[a] lane 4 h + b = r[b] lane 4 h + a.
OCU_INLINE void transpose_halves(const Vec r[4], Vec out[4]) {
  const Vec a0 = _mm512_unpacklo_pd(r[0], r[1]), a1 = _mm512_unpackhi_pd(r[0], r[1]);
  const Vec a2 = _mm512_unpacklo_pd(r[2], r[3]), a3 = _mm512_unpackhi_pd(r[2], r[3]);
  const __m512i low = _mm512_setr_epi64(0, 1, 8, 9, 4, 5, 12, 13), high = _mm512_setr_epi64(2, 3, 10, 11, 6, 7, 14, 15);
  out[0] = _mm512_permutex2var_pd(a0, low, a2);
  out[1] = _mm512_permutex2var_pd(a1, low, a3);
  out[2] = _mm512_permutex2var_pd(a0, high, a2);
  out[3] = _mm512_permutex2var_pd(a1, high, a3);
}
/// Eight nodes of eight rows as a vector per node: the halves of the rows are put together by loads.
OCU_INLINE void load_columns(const double* const row[8], Index offset, Vec node[8]) {
  for (int half = 0; half < 2; ++half) {
    Vec r[4];
    for (int l = 0; l < 4; ++l) {
      const Vec low = _mm512_castpd256_pd512(_mm256_loadu_pd(row[l] + offset + 4 * half));
      r[l] = _mm512_insertf64x4(low, _mm256_loadu_pd(row[l + 4] + offset + 4 * half), 1);
    }
    transpose_halves(r, node + 4 * half);
  }
}
/// The way back, into the rows whose bit is set.
OCU_INLINE void store_columns(double* const row[8], Index offset, const Vec node[8], unsigned rows) {
  for (int half = 0; half < 2; ++half) {
    Vec r[4];
    transpose_halves(node + 4 * half, r);
    for (int l = 0; l < 4; ++l) {
      if (((rows >> l) & 1u) != 0) _mm256_storeu_pd(row[l] + offset + 4 * half, _mm512_castpd512_pd256(r[l]));
      if (((rows >> (l + 4)) & 1u) != 0) _mm256_storeu_pd(row[l + 4] + offset + 4 * half, _mm512_extractf64x4_pd(r[l], 1));
    }
  }
}

#else

/// Two halves that act alike; nested until the half is a register of the machine.
template <class Half>
struct Pair {
  Half lo, hi;
};
template <class H>
OCU_INLINE Pair<H> operator+(Pair<H> a, Pair<H> b) { return {a.lo + b.lo, a.hi + b.hi}; }
template <class H>
OCU_INLINE Pair<H> operator-(Pair<H> a, Pair<H> b) { return {a.lo - b.lo, a.hi - b.hi}; }
template <class H>
OCU_INLINE Pair<H> operator*(Pair<H> a, Pair<H> b) { return {a.lo * b.lo, a.hi * b.hi}; }
template <class H>
OCU_INLINE Pair<H> operator/(Pair<H> a, Pair<H> b) { return {a.lo / b.lo, a.hi / b.hi}; }
template <class H>
OCU_INLINE Pair<H> operator-(Pair<H> a) { return {-a.lo, -a.hi}; }
template <class H>
OCU_INLINE Pair<H>& operator+=(Pair<H>& a, Pair<H> b) { return a = a + b; }
template <class H>
OCU_INLINE Pair<H>& operator-=(Pair<H>& a, Pair<H> b) { return a = a - b; }
template <class H>
OCU_INLINE Pair<H>& operator*=(Pair<H>& a, Pair<H> b) { return a = a * b; }

#if defined(__AVX2__)
using Native = __m256d;
using Vec = Pair<Native>;
inline constexpr int native_lanes = 4;
OCU_INLINE Native native_splat(double s) { return _mm256_set1_pd(s); }
OCU_INLINE Native native_load(const double* p) { return _mm256_loadu_pd(p); }
OCU_INLINE void native_store(double* p, Native v) { _mm256_storeu_pd(p, v); }
OCU_INLINE Native native_madd(Native a, Native b, Native c) { return _mm256_fmadd_pd(a, b, c); }
OCU_INLINE Native native_nmadd(Native a, Native b, Native c) { return _mm256_fnmadd_pd(a, b, c); }
OCU_INLINE Native native_max(Native a, Native b) { return _mm256_max_pd(a, b); }
OCU_INLINE Native native_min(Native a, Native b) { return _mm256_min_pd(a, b); }
OCU_INLINE Native native_sqrt(Native a) { return _mm256_sqrt_pd(a); }
OCU_INLINE unsigned native_less(Native a, Native b) {
  return static_cast<unsigned>(_mm256_movemask_pd(_mm256_cmp_pd(a, b, _CMP_LT_OQ)));
}
OCU_INLINE unsigned native_not_at_least(Native a, Native b) {
  return static_cast<unsigned>(_mm256_movemask_pd(_mm256_cmp_pd(a, b, _CMP_NGE_UQ)));
}
OCU_INLINE Native native_select(unsigned mask, Native a, Native b) {
  const __m256i bits = _mm256_set_epi64x(8, 4, 2, 1);
  const __m256i set =
      _mm256_cmpeq_epi64(_mm256_and_si256(_mm256_set1_epi64x(static_cast<long long>(mask)), bits), bits);
  return _mm256_blendv_pd(b, a, _mm256_castsi256_pd(set));
}
OCU_INLINE Vec splat(double s) { return {native_splat(s), native_splat(s)}; }
OCU_INLINE Vec load(const double* p) { return {native_load(p), native_load(p + 4)}; }
OCU_INLINE void store(double* p, Vec v) {
  native_store(p, v.lo);
  native_store(p + 4, v.hi);
}
OCU_INLINE void store_past_caches(double* p, Vec v) {
  _mm256_stream_pd(p, v.lo);
  _mm256_stream_pd(p + 4, v.hi);
}
#else
using Native = __m128d;
using Vec = Pair<Pair<Native>>;
inline constexpr int native_lanes = 2;
OCU_INLINE Native native_madd(Native a, Native b, Native c) { return a * b + c; }
OCU_INLINE Native native_nmadd(Native a, Native b, Native c) { return c - a * b; }
OCU_INLINE Native native_max(Native a, Native b) { return _mm_max_pd(a, b); }
OCU_INLINE Native native_min(Native a, Native b) { return _mm_min_pd(a, b); }
OCU_INLINE Native native_sqrt(Native a) { return _mm_sqrt_pd(a); }
OCU_INLINE unsigned native_less(Native a, Native b) {
  return static_cast<unsigned>(_mm_movemask_pd(_mm_cmplt_pd(a, b)));
}
OCU_INLINE unsigned native_not_at_least(Native a, Native b) {
  return static_cast<unsigned>(_mm_movemask_pd(_mm_cmpnge_pd(a, b)));
}
OCU_INLINE Native native_select(unsigned mask, Native a, Native b) {
  const __m128d set = _mm_castsi128_pd(_mm_set_epi64x((mask & 2u) != 0 ? -1 : 0, (mask & 1u) != 0 ? -1 : 0));
  return _mm_or_pd(_mm_and_pd(set, a), _mm_andnot_pd(set, b));
}
OCU_INLINE Vec splat(double s) {
  const Native n = _mm_set1_pd(s);
  return {{n, n}, {n, n}};
}
OCU_INLINE Vec load(const double* p) {
  return {{_mm_loadu_pd(p), _mm_loadu_pd(p + 2)}, {_mm_loadu_pd(p + 4), _mm_loadu_pd(p + 6)}};
}
OCU_INLINE void store(double* p, Vec v) {
  _mm_storeu_pd(p, v.lo.lo);
  _mm_storeu_pd(p + 2, v.lo.hi);
  _mm_storeu_pd(p + 4, v.hi.lo);
  _mm_storeu_pd(p + 6, v.hi.hi);
}
OCU_INLINE void store_past_caches(double* p, Vec v) {
  _mm_stream_pd(p, v.lo.lo);
  _mm_stream_pd(p + 2, v.lo.hi);
  _mm_stream_pd(p + 4, v.hi.lo);
  _mm_stream_pd(p + 6, v.hi.hi);
}
#endif

// Recursion over halves ends at the machine's register.
OCU_INLINE Native madd(Native a, Native b, Native c) { return native_madd(a, b, c); }
OCU_INLINE Native nmadd(Native a, Native b, Native c) { return native_nmadd(a, b, c); }
OCU_INLINE Native vmax(Native a, Native b) { return native_max(a, b); }
OCU_INLINE Native vmin(Native a, Native b) { return native_min(a, b); }
OCU_INLINE Native vsqrt(Native a) { return native_sqrt(a); }
OCU_INLINE unsigned less(Native a, Native b) { return native_less(a, b); }
OCU_INLINE unsigned not_at_least(Native a, Native b) { return native_not_at_least(a, b); }
OCU_INLINE Native select(unsigned mask, Native a, Native b) { return native_select(mask, a, b); }
template <class T>
inline constexpr int lanes_of = native_lanes;
template <class H>
inline constexpr int lanes_of<Pair<H>> = 2 * lanes_of<H>;
template <class H>
OCU_INLINE Pair<H> madd(Pair<H> a, Pair<H> b, Pair<H> c) { return {madd(a.lo, b.lo, c.lo), madd(a.hi, b.hi, c.hi)}; }
template <class H>
OCU_INLINE Pair<H> nmadd(Pair<H> a, Pair<H> b, Pair<H> c) { return {nmadd(a.lo, b.lo, c.lo), nmadd(a.hi, b.hi, c.hi)}; }
template <class H>
OCU_INLINE Pair<H> vmax(Pair<H> a, Pair<H> b) { return {vmax(a.lo, b.lo), vmax(a.hi, b.hi)}; }
template <class H>
OCU_INLINE Pair<H> vmin(Pair<H> a, Pair<H> b) { return {vmin(a.lo, b.lo), vmin(a.hi, b.hi)}; }
template <class H>
OCU_INLINE Pair<H> vsqrt(Pair<H> a) { return {vsqrt(a.lo), vsqrt(a.hi)}; }
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
OCU_INLINE void load_columns(const double* const row[8], Index offset, Vec node[8]) {
  double column[8][8];
  for (int l = 0; l < 8; ++l) {
    for (int a = 0; a < 8; ++a) column[a][l] = row[l][offset + a];
  }
  for (int a = 0; a < 8; ++a) node[a] = load(column[a]);
}
OCU_INLINE void store_columns(double* const row[8], Index offset, const Vec node[8], unsigned rows) {
  double column[8][8];
  for (int a = 0; a < 8; ++a) store(column[a], node[a]);
  for (int l = 0; l < 8; ++l) {
    if (((rows >> l) & 1u) == 0) continue;
    for (int a = 0; a < 8; ++a) row[l][offset + a] = column[a][l];
  }
}
#endif

OCU_INLINE Vec vabs(Vec a) { return vmax(a, -a); }
/// Largest of the eight lanes.
OCU_INLINE double largest_lane(Vec a) {
  double v[8];
  store(v, a);
  double m = v[0];
  for (int l = 1; l < 8; ++l) m = v[l] > m ? v[l] : m;
  return m;
}
OCU_INLINE double smallest_lane(Vec a) { return -largest_lane(-a); }

}  // namespace ocublast::flow::OCU_ISA
