#pragma once

// The machine's registers of floats. The AVX-512 registers are whole vectors, those of
// the other sets parts of one (simd.hpp).

#include <immintrin.h>

#include "flow_solver/numerics/simd_names.hpp"

namespace ocublast::flow::inline OCU_PRECISION::OCU_ISA {

#if defined(__AVX512F__) && defined(__AVX512DQ__)

using Vec = __m512;
OCU_INLINE Vec splat(float s) {
  return _mm512_set1_ps(s);
}
OCU_INLINE Vec load(const float* p) {
  return _mm512_loadu_ps(p);
}
OCU_INLINE void store(float* p, Vec v) {
  _mm512_storeu_ps(p, v);
}
OCU_INLINE void store_past_caches(float* p, Vec v) {
  _mm512_stream_ps(p, v);
}
OCU_INLINE Vec madd(Vec a, Vec b, Vec c) {
  return _mm512_fmadd_ps(a, b, c);
}
OCU_INLINE Vec nmadd(Vec a, Vec b, Vec c) {
  return _mm512_fnmadd_ps(a, b, c);
}
OCU_INLINE Vec vmax(Vec a, Vec b) {
  return _mm512_max_ps(a, b);
}
OCU_INLINE Vec vmin(Vec a, Vec b) {
  return _mm512_min_ps(a, b);
}
OCU_INLINE Vec vsqrt(Vec a) {
  return _mm512_sqrt_ps(a);
}
OCU_INLINE unsigned less(Vec a, Vec b) {
  return static_cast<unsigned>(_mm512_cmp_ps_mask(a, b, _CMP_LT_OQ));
}
OCU_INLINE unsigned not_at_least(Vec a, Vec b) {
  return static_cast<unsigned>(_mm512_cmp_ps_mask(a, b, _CMP_NGE_UQ));
}
OCU_INLINE Vec select(unsigned mask, Vec a, Vec b) {
  return _mm512_mask_blend_ps(static_cast<__mmask16>(mask), b, a);
}
/// Four rows to columns in all quarters: out[a] lane 4 h + b = r[b] lane 4 h + a.
OCU_INLINE void transpose_quarters(const Vec r[4], Vec out[4]) {
  const __m512d a0 = _mm512_castps_pd(_mm512_unpacklo_ps(r[0], r[1])),
                a1 = _mm512_castps_pd(_mm512_unpackhi_ps(r[0], r[1]));
  const __m512d a2 = _mm512_castps_pd(_mm512_unpacklo_ps(r[2], r[3])),
                a3 = _mm512_castps_pd(_mm512_unpackhi_ps(r[2], r[3]));
  out[0] = _mm512_castpd_ps(_mm512_unpacklo_pd(a0, a2));
  out[1] = _mm512_castpd_ps(_mm512_unpackhi_pd(a0, a2));
  out[2] = _mm512_castpd_ps(_mm512_unpacklo_pd(a1, a3));
  out[3] = _mm512_castpd_ps(_mm512_unpackhi_pd(a1, a3));
}
/// Four nodes of sixteen rows as a vector per node: loads put quarters of four rows together.
OCU_INLINE void load_four_columns(const float* const row[16], Index offset, Vec node[4]) {
  Vec r[4];
  for (int l = 0; l < 4; ++l) {
    Vec v = _mm512_castps128_ps512(_mm_loadu_ps(row[l] + offset));
    v = _mm512_insertf32x4(v, _mm_loadu_ps(row[l + 4] + offset), 1);
    v = _mm512_insertf32x4(v, _mm_loadu_ps(row[l + 8] + offset), 2);
    r[l] = _mm512_insertf32x4(v, _mm_loadu_ps(row[l + 12] + offset), 3);
  }
  transpose_quarters(r, node);
}
/// The way back, into the rows whose bit is set.
OCU_INLINE void store_columns(float* const row[16], Index offset, const Vec node[16],
                              unsigned rows) {
  for (int quarter = 0; quarter < 4; ++quarter) {
    Vec r[4];
    transpose_quarters(node + 4 * quarter, r);
    for (int l = 0; l < 4; ++l) {
      const Index at = offset + 4 * quarter;
      if (((rows >> l) & 1u) != 0) _mm_storeu_ps(row[l] + at, _mm512_castps512_ps128(r[l]));
      if (((rows >> (l + 4)) & 1u) != 0)
        _mm_storeu_ps(row[l + 4] + at, _mm512_extractf32x4_ps(r[l], 1));
      if (((rows >> (l + 8)) & 1u) != 0)
        _mm_storeu_ps(row[l + 8] + at, _mm512_extractf32x4_ps(r[l], 2));
      if (((rows >> (l + 12)) & 1u) != 0)
        _mm_storeu_ps(row[l + 12] + at, _mm512_extractf32x4_ps(r[l], 3));
    }
  }
}

#elif defined(__AVX2__)

using Native = __m256;
inline constexpr int native_lanes = 8;
OCU_INLINE Native native_splat(float s) {
  return _mm256_set1_ps(s);
}
OCU_INLINE Native native_load(const float* p) {
  return _mm256_loadu_ps(p);
}
OCU_INLINE void native_store(float* p, Native v) {
  _mm256_storeu_ps(p, v);
}
OCU_INLINE void native_stream(float* p, Native v) {
  _mm256_stream_ps(p, v);
}
OCU_INLINE Native native_madd(Native a, Native b, Native c) {
  return _mm256_fmadd_ps(a, b, c);
}
OCU_INLINE Native native_nmadd(Native a, Native b, Native c) {
  return _mm256_fnmadd_ps(a, b, c);
}
OCU_INLINE Native native_max(Native a, Native b) {
  return _mm256_max_ps(a, b);
}
OCU_INLINE Native native_min(Native a, Native b) {
  return _mm256_min_ps(a, b);
}
OCU_INLINE Native native_sqrt(Native a) {
  return _mm256_sqrt_ps(a);
}
OCU_INLINE unsigned native_less(Native a, Native b) {
  return static_cast<unsigned>(_mm256_movemask_ps(_mm256_cmp_ps(a, b, _CMP_LT_OQ)));
}
OCU_INLINE unsigned native_not_at_least(Native a, Native b) {
  return static_cast<unsigned>(_mm256_movemask_ps(_mm256_cmp_ps(a, b, _CMP_NGE_UQ)));
}
OCU_INLINE Native native_select(unsigned mask, Native a, Native b) {
  const __m256i bits = _mm256_set_epi32(128, 64, 32, 16, 8, 4, 2, 1);
  const __m256i set =
      _mm256_cmpeq_epi32(_mm256_and_si256(_mm256_set1_epi32(static_cast<int>(mask)), bits), bits);
  return _mm256_blendv_ps(b, a, _mm256_castsi256_ps(set));
}
/// Four rows to columns in both halves: out[a] lane 4 h + b = r[b] lane 4 h + a.
OCU_INLINE void native_transpose(const Native r[4], Native out[4]) {
  const __m256d a0 = _mm256_castps_pd(_mm256_unpacklo_ps(r[0], r[1])),
                a1 = _mm256_castps_pd(_mm256_unpackhi_ps(r[0], r[1]));
  const __m256d a2 = _mm256_castps_pd(_mm256_unpacklo_ps(r[2], r[3])),
                a3 = _mm256_castps_pd(_mm256_unpackhi_ps(r[2], r[3]));
  out[0] = _mm256_castpd_ps(_mm256_unpacklo_pd(a0, a2));
  out[1] = _mm256_castpd_ps(_mm256_unpackhi_pd(a0, a2));
  out[2] = _mm256_castpd_ps(_mm256_unpacklo_pd(a1, a3));
  out[3] = _mm256_castpd_ps(_mm256_unpackhi_pd(a1, a3));
}
/// Four nodes of a register's rows as a register per node: loads put halves of two rows together.
OCU_INLINE void native_load_columns(const float* const row[8], Index offset, Native node[4]) {
  Native r[4];
  for (int l = 0; l < 4; ++l) {
    const Native low = _mm256_castps128_ps256(_mm_loadu_ps(row[l] + offset));
    r[l] = _mm256_insertf128_ps(low, _mm_loadu_ps(row[l + 4] + offset), 1);
  }
  native_transpose(r, node);
}
/// The way back, into the rows whose bit is set.
OCU_INLINE void native_store_columns(float* const row[8], Index offset, const Native node[4],
                                     unsigned rows) {
  Native r[4];
  native_transpose(node, r);
  for (int l = 0; l < 4; ++l) {
    if (((rows >> l) & 1u) != 0) _mm_storeu_ps(row[l] + offset, _mm256_castps256_ps128(r[l]));
    if (((rows >> (l + 4)) & 1u) != 0)
      _mm_storeu_ps(row[l + 4] + offset, _mm256_extractf128_ps(r[l], 1));
  }
}

#else

using Native = __m128;
inline constexpr int native_lanes = 4;
OCU_INLINE Native native_splat(float s) {
  return _mm_set1_ps(s);
}
OCU_INLINE Native native_load(const float* p) {
  return _mm_loadu_ps(p);
}
OCU_INLINE void native_store(float* p, Native v) {
  _mm_storeu_ps(p, v);
}
OCU_INLINE void native_stream(float* p, Native v) {
  _mm_stream_ps(p, v);
}
OCU_INLINE Native native_madd(Native a, Native b, Native c) {
  return a * b + c;
}
OCU_INLINE Native native_nmadd(Native a, Native b, Native c) {
  return c - a * b;
}
OCU_INLINE Native native_max(Native a, Native b) {
  return _mm_max_ps(a, b);
}
OCU_INLINE Native native_min(Native a, Native b) {
  return _mm_min_ps(a, b);
}
OCU_INLINE Native native_sqrt(Native a) {
  return _mm_sqrt_ps(a);
}
OCU_INLINE unsigned native_less(Native a, Native b) {
  return static_cast<unsigned>(_mm_movemask_ps(_mm_cmplt_ps(a, b)));
}
OCU_INLINE unsigned native_not_at_least(Native a, Native b) {
  return static_cast<unsigned>(_mm_movemask_ps(_mm_cmpnge_ps(a, b)));
}
OCU_INLINE Native native_select(unsigned mask, Native a, Native b) {
  const __m128i bits = _mm_set_epi32(8, 4, 2, 1);
  const __m128 set = _mm_castsi128_ps(
      _mm_cmpeq_epi32(_mm_and_si128(_mm_set1_epi32(static_cast<int>(mask)), bits), bits));
  return _mm_or_ps(_mm_and_ps(set, a), _mm_andnot_ps(set, b));
}
OCU_INLINE void native_load_columns(const float* const row[4], Index offset, Native node[4]) {
  for (int l = 0; l < 4; ++l) node[l] = native_load(row[l] + offset);
  _MM_TRANSPOSE4_PS(node[0], node[1], node[2], node[3]);
}
OCU_INLINE void native_store_columns(float* const row[4], Index offset, const Native node[4],
                                     unsigned rows) {
  Native r[4] = {node[0], node[1], node[2], node[3]};
  _MM_TRANSPOSE4_PS(r[0], r[1], r[2], r[3]);
  for (int l = 0; l < 4; ++l) {
    if (((rows >> l) & 1u) != 0) native_store(row[l] + offset, r[l]);
  }
}

#endif

}  // namespace ocublast::flow::OCU_ISA
