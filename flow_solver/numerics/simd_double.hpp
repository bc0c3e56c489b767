#pragma once

// The machine's registers of doubles. The AVX-512 registers are whole vectors, those of
// the other sets parts of one (simd.hpp).

#include <immintrin.h>

#include "flow_solver/numerics/simd_names.hpp"

namespace ocublast::flow::inline OCU_PRECISION::OCU_ISA {

#if defined(__AVX512F__) && defined(__AVX512DQ__)

using Vec = __m512d;
OCU_INLINE Vec splat(double s) {
  return _mm512_set1_pd(s);
}
OCU_INLINE Vec load(const double* p) {
  return _mm512_loadu_pd(p);
}
OCU_INLINE void store(double* p, Vec v) {
  _mm512_storeu_pd(p, v);
}
/// Past the caches, for results that are not read soon; p must be aligned to 64 bytes.
OCU_INLINE void store_past_caches(double* p, Vec v) {
  _mm512_stream_pd(p, v);
}
/// a b + c and c - a b with one rounding, where the machine has it.
OCU_INLINE Vec madd(Vec a, Vec b, Vec c) {
  return _mm512_fmadd_pd(a, b, c);
}
OCU_INLINE Vec nmadd(Vec a, Vec b, Vec c) {
  return _mm512_fnmadd_pd(a, b, c);
}
OCU_INLINE Vec vmax(Vec a, Vec b) {
  return _mm512_max_pd(a, b);
}
OCU_INLINE Vec vmin(Vec a, Vec b) {
  return _mm512_min_pd(a, b);
}
OCU_INLINE Vec vsqrt(Vec a) {
  return _mm512_sqrt_pd(a);
}
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
  const __m512i low = _mm512_setr_epi64(0, 1, 8, 9, 4, 5, 12, 13),
                high = _mm512_setr_epi64(2, 3, 10, 11, 6, 7, 14, 15);
  out[0] = _mm512_permutex2var_pd(a0, low, a2);
  out[1] = _mm512_permutex2var_pd(a1, low, a3);
  out[2] = _mm512_permutex2var_pd(a0, high, a2);
  out[3] = _mm512_permutex2var_pd(a1, high, a3);
}
/// Four nodes of eight rows as a vector per node: loads put halves of two rows together.
OCU_INLINE void load_four_columns(const double* const row[8], Index offset, Vec node[4]) {
  Vec r[4];
  for (int l = 0; l < 4; ++l) {
    const Vec low = _mm512_castpd256_pd512(_mm256_loadu_pd(row[l] + offset));
    r[l] = _mm512_insertf64x4(low, _mm256_loadu_pd(row[l + 4] + offset), 1);
  }
  transpose_halves(r, node);
}
/// The way back, into the rows whose bit is set.
OCU_INLINE void store_columns(double* const row[8], Index offset, const Vec node[8],
                              unsigned rows) {
  for (int half = 0; half < 2; ++half) {
    Vec r[4];
    transpose_halves(node + 4 * half, r);
    for (int l = 0; l < 4; ++l) {
      if (((rows >> l) & 1u) != 0)
        _mm256_storeu_pd(row[l] + offset + 4 * half, _mm512_castpd512_pd256(r[l]));
      if (((rows >> (l + 4)) & 1u) != 0)
        _mm256_storeu_pd(row[l + 4] + offset + 4 * half, _mm512_extractf64x4_pd(r[l], 1));
    }
  }
}

#elif defined(__AVX2__)

using Native = __m256d;
inline constexpr int native_lanes = 4;
OCU_INLINE Native native_splat(double s) {
  return _mm256_set1_pd(s);
}
OCU_INLINE Native native_load(const double* p) {
  return _mm256_loadu_pd(p);
}
OCU_INLINE void native_store(double* p, Native v) {
  _mm256_storeu_pd(p, v);
}
OCU_INLINE Native native_madd(Native a, Native b, Native c) {
  return _mm256_fmadd_pd(a, b, c);
}
OCU_INLINE Native native_nmadd(Native a, Native b, Native c) {
  return _mm256_fnmadd_pd(a, b, c);
}
OCU_INLINE Native native_max(Native a, Native b) {
  return _mm256_max_pd(a, b);
}
OCU_INLINE Native native_min(Native a, Native b) {
  return _mm256_min_pd(a, b);
}
OCU_INLINE Native native_sqrt(Native a) {
  return _mm256_sqrt_pd(a);
}
OCU_INLINE unsigned native_less(Native a, Native b) {
  return static_cast<unsigned>(_mm256_movemask_pd(_mm256_cmp_pd(a, b, _CMP_LT_OQ)));
}
OCU_INLINE unsigned native_not_at_least(Native a, Native b) {
  return static_cast<unsigned>(_mm256_movemask_pd(_mm256_cmp_pd(a, b, _CMP_NGE_UQ)));
}
OCU_INLINE Native native_select(unsigned mask, Native a, Native b) {
  const __m256i bits = _mm256_set_epi64x(8, 4, 2, 1);
  const __m256i set = _mm256_cmpeq_epi64(
      _mm256_and_si256(_mm256_set1_epi64x(static_cast<long long>(mask)), bits), bits);
  return _mm256_blendv_pd(b, a, _mm256_castsi256_pd(set));
}
OCU_INLINE void native_stream(double* p, Native v) {
  _mm256_stream_pd(p, v);
}
/// Four rows to columns: out[a] lane b = r[b] lane a.
OCU_INLINE void native_transpose(const Native r[4], Native out[4]) {
  const Native a0 = _mm256_unpacklo_pd(r[0], r[1]), a1 = _mm256_unpackhi_pd(r[0], r[1]);
  const Native a2 = _mm256_unpacklo_pd(r[2], r[3]), a3 = _mm256_unpackhi_pd(r[2], r[3]);
  out[0] = _mm256_permute2f128_pd(a0, a2, 0x20);
  out[1] = _mm256_permute2f128_pd(a1, a3, 0x20);
  out[2] = _mm256_permute2f128_pd(a0, a2, 0x31);
  out[3] = _mm256_permute2f128_pd(a1, a3, 0x31);
}
/// Four nodes of a register's rows as a register per node.
OCU_INLINE void native_load_columns(const double* const row[4], Index offset, Native node[4]) {
  Native r[4];
  for (int l = 0; l < 4; ++l) r[l] = native_load(row[l] + offset);
  native_transpose(r, node);
}
/// The way back, into the rows whose bit is set.
OCU_INLINE void native_store_columns(double* const row[4], Index offset, const Native node[4],
                                     unsigned rows) {
  Native r[4];
  native_transpose(node, r);
  for (int l = 0; l < 4; ++l) {
    if (((rows >> l) & 1u) != 0) native_store(row[l] + offset, r[l]);
  }
}

#else

using Native = __m128d;
inline constexpr int native_lanes = 2;
OCU_INLINE Native native_splat(double s) {
  return _mm_set1_pd(s);
}
OCU_INLINE Native native_load(const double* p) {
  return _mm_loadu_pd(p);
}
OCU_INLINE void native_store(double* p, Native v) {
  _mm_storeu_pd(p, v);
}
OCU_INLINE void native_stream(double* p, Native v) {
  _mm_stream_pd(p, v);
}
OCU_INLINE void native_load_columns(const double* const row[2], Index offset, Native node[4]) {
  for (int half = 0; half < 2; ++half) {
    const Native r0 = native_load(row[0] + offset + 2 * half),
                 r1 = native_load(row[1] + offset + 2 * half);
    node[2 * half] = _mm_unpacklo_pd(r0, r1);
    node[2 * half + 1] = _mm_unpackhi_pd(r0, r1);
  }
}
OCU_INLINE void native_store_columns(double* const row[2], Index offset, const Native node[4],
                                     unsigned rows) {
  for (int half = 0; half < 2; ++half) {
    const Native n0 = node[2 * half], n1 = node[2 * half + 1];
    if ((rows & 1u) != 0) native_store(row[0] + offset + 2 * half, _mm_unpacklo_pd(n0, n1));
    if ((rows & 2u) != 0) native_store(row[1] + offset + 2 * half, _mm_unpackhi_pd(n0, n1));
  }
}
OCU_INLINE Native native_madd(Native a, Native b, Native c) {
  return a * b + c;
}
OCU_INLINE Native native_nmadd(Native a, Native b, Native c) {
  return c - a * b;
}
OCU_INLINE Native native_max(Native a, Native b) {
  return _mm_max_pd(a, b);
}
OCU_INLINE Native native_min(Native a, Native b) {
  return _mm_min_pd(a, b);
}
OCU_INLINE Native native_sqrt(Native a) {
  return _mm_sqrt_pd(a);
}
OCU_INLINE unsigned native_less(Native a, Native b) {
  return static_cast<unsigned>(_mm_movemask_pd(_mm_cmplt_pd(a, b)));
}
OCU_INLINE unsigned native_not_at_least(Native a, Native b) {
  return static_cast<unsigned>(_mm_movemask_pd(_mm_cmpnge_pd(a, b)));
}
OCU_INLINE Native native_select(unsigned mask, Native a, Native b) {
  const __m128d set =
      _mm_castsi128_pd(_mm_set_epi64x((mask & 2u) != 0 ? -1 : 0, (mask & 1u) != 0 ? -1 : 0));
  return _mm_or_pd(_mm_and_pd(set, a), _mm_andnot_pd(set, b));
}

#endif

}  // namespace ocublast::flow::OCU_ISA
