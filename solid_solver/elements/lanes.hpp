#pragma once

#include <cstdint>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

#include "solid_solver/elements/point_buffer.hpp"

// Lanes of W doubles, one element per lane, by GCC vector extensions. Everything here is
// file-local: the same text is compiled for several instruction sets and no copy may replace
// another at link time.
#define OCU_LANE_INLINE static inline __attribute__((always_inline))

namespace ocublast::solid {
namespace {
using Row = double __attribute__((vector_size(32), aligned(8)));

template <int W>
struct LaneTypes {
  typedef double Real __attribute__((vector_size(8 * W)));
  typedef std::int64_t Integer __attribute__((vector_size(8 * W)));
};
template <int W>
using Lanes = typename LaneTypes<W>::Real;

template <int W>
OCU_LANE_INLINE Lanes<W> splat(double value) {
  return Lanes<W>{} + value;
}
template <int W>
OCU_LANE_INLINE Lanes<W> load(const double* p) {
  Lanes<W> v;
  __builtin_memcpy(&v, p, sizeof v);
  return v;
}
template <int W>
OCU_LANE_INLINE void store(double* p, Lanes<W> v) {
  __builtin_memcpy(p, &v, sizeof v);
}

OCU_LANE_INLINE void transpose(Row& a, Row& b, Row& c, Row& d) {
  const Row ab_lo = __builtin_shufflevector(a, b, 0, 4, 2, 6);
  const Row ab_hi = __builtin_shufflevector(a, b, 1, 5, 3, 7);
  const Row cd_lo = __builtin_shufflevector(c, d, 0, 4, 2, 6);
  const Row cd_hi = __builtin_shufflevector(c, d, 1, 5, 3, 7);
  a = __builtin_shufflevector(ab_lo, cd_lo, 0, 1, 4, 5);
  b = __builtin_shufflevector(ab_hi, cd_hi, 0, 1, 4, 5);
  c = __builtin_shufflevector(ab_lo, cd_lo, 2, 3, 6, 7);
  d = __builtin_shufflevector(ab_hi, cd_hi, 2, 3, 6, 7);
}

using TwoRows = double __attribute__((vector_size(64)));

OCU_LANE_INLINE Row load_row(const double* field, std::uint16_t at) {
  Row row;
  __builtin_memcpy(&row, field + at, sizeof row);
  return row;
}
/// The rows of lanes l and l + 4, side by side.
OCU_LANE_INLINE TwoRows load_rows(const double* field, const std::uint16_t* nodes, int l) {
  return __builtin_shufflevector(load_row(field, nodes[l]), load_row(field, nodes[l + 4]), 0, 1, 2,
                                 3, 4, 5, 6, 7);
}

/// The first C numbers of the rows of W nodes, lane by lane.
template <int W, int C = 3>
OCU_LANE_INLINE void gather(const double* field, const std::uint16_t* nodes, Lanes<W> out[C]) {
  if constexpr (W == 8) {  // both halves are transposed at once
    const TwoRows a = load_rows(field, nodes, 0);
    const TwoRows b = load_rows(field, nodes, 1);
    const TwoRows c = load_rows(field, nodes, 2);
    const TwoRows d = load_rows(field, nodes, 3);
    const TwoRows ab_lo = __builtin_shufflevector(a, b, 0, 8, 2, 10, 4, 12, 6, 14);
    const TwoRows ab_hi = __builtin_shufflevector(a, b, 1, 9, 3, 11, 5, 13, 7, 15);
    const TwoRows cd_lo = __builtin_shufflevector(c, d, 0, 8, 2, 10, 4, 12, 6, 14);
    const TwoRows cd_hi = __builtin_shufflevector(c, d, 1, 9, 3, 11, 5, 13, 7, 15);
    out[0] = __builtin_shufflevector(ab_lo, cd_lo, 0, 1, 8, 9, 4, 5, 12, 13);
    out[1] = __builtin_shufflevector(ab_hi, cd_hi, 0, 1, 8, 9, 4, 5, 12, 13);
    out[2] = __builtin_shufflevector(ab_lo, cd_lo, 2, 3, 10, 11, 6, 7, 14, 15);
    if constexpr (C == 4)
      out[3] = __builtin_shufflevector(ab_hi, cd_hi, 2, 3, 10, 11, 6, 7, 14, 15);
  } else if constexpr (W == 4) {
    Row r[4];
    for (int l = 0; l < 4; ++l) r[l] = load_row(field, nodes[l]);
    transpose(r[0], r[1], r[2], r[3]);
    for (int i = 0; i < C; ++i) out[i] = r[i];
  } else {
    static_assert(W == 2);
    for (int i = 0; i < C; ++i) out[i] = Lanes<W>{field[nodes[0] + i], field[nodes[1] + i]};
  }
}

/// Adds the forces of W elements of N nodes to rows [n, row_stride], element after element: the
/// order of additions is the same for every W. nodes [N, batch_lanes].
template <int W, int N>
OCU_LANE_INLINE void scatter_add(double* field, const std::uint16_t* nodes,
                                 const Lanes<W> f[N][3]) {
  alignas(64) double rows[N][W][row_stride];  // [node, lane] in the order the halves leave
  for (int a = 0; a < N; ++a) {
    if constexpr (W == 8) {
      constexpr TwoRows zero{};
      const TwoRows lo = __builtin_shufflevector(f[a][0], f[a][1], 0, 8, 2, 10, 4, 12, 6, 14);
      const TwoRows hi = __builtin_shufflevector(f[a][0], f[a][1], 1, 9, 3, 11, 5, 13, 7, 15);
      const TwoRows z_lo = __builtin_shufflevector(f[a][2], zero, 0, 8, 2, 10, 4, 12, 6, 14);
      const TwoRows z_hi = __builtin_shufflevector(f[a][2], zero, 1, 9, 3, 11, 5, 13, 7, 15);
      store<8>(rows[a][0], __builtin_shufflevector(lo, z_lo, 0, 1, 8, 9, 4, 5, 12, 13));
      store<8>(rows[a][2], __builtin_shufflevector(hi, z_hi, 0, 1, 8, 9, 4, 5, 12, 13));
      store<8>(rows[a][4], __builtin_shufflevector(lo, z_lo, 2, 3, 10, 11, 6, 7, 14, 15));
      store<8>(rows[a][6], __builtin_shufflevector(hi, z_hi, 2, 3, 10, 11, 6, 7, 14, 15));
    } else if constexpr (W == 4) {
      Row r[4] = {f[a][0], f[a][1], f[a][2], Row{}};
      transpose(r[0], r[1], r[2], r[3]);
      for (int l = 0; l < 4; ++l) store<4>(rows[a][l], r[l]);
    } else {
      for (int l = 0; l < W; ++l)
        for (int i = 0; i < row_stride; ++i) rows[a][l][i] = i < 3 ? f[a][i][l] : 0.0;
    }
  }
  // Lanes 0 and 4, 1 and 5, 2 and 6, 3 and 7 lie side by side when W is 8.
  constexpr int place[8] = {0, 2, 4, 6, 1, 3, 5, 7};
  for (int l = 0; l < W; ++l)
    for (int a = 0; a < N; ++a) {
      double* row = field + nodes[a * batch_lanes + l];
      Row sum;
      Row more;
      __builtin_memcpy(&sum, row, sizeof sum);
      __builtin_memcpy(&more, rows[a][W == 8 ? place[l] : l], sizeof more);
      sum += more;
      __builtin_memcpy(row, &sum, sizeof sum);
    }
}

/// Asks for the cache lines of n doubles: the processor's own prefetcher stops at page ends.
OCU_LANE_INLINE void prefetch(const double* p, int n) {
  for (int i = 0; i < n; i += 8) __builtin_prefetch(p + i);
}

/// One number of W rows.
template <int W>
OCU_LANE_INLINE Lanes<W> gather_scalar(const double* field, const std::uint16_t* nodes) {
  Lanes<W> v{};
  for (int l = 0; l < W; ++l) v[l] = field[nodes[l]];
  return v;
}

/// Adds one number per element to the first of N of its rows, element after element; nodes [N,
/// batch_lanes].
template <int W, int N>
OCU_LANE_INLINE void scatter_add_scalar(double* field, const std::uint16_t* nodes, Lanes<W> v) {
  alignas(64) double value[W];
  store<W>(value, v);
  for (int l = 0; l < W; ++l)
    for (int a = 0; a < N; ++a) field[nodes[a * batch_lanes + l]] += value[l];
}

/// Where x^(-1/3) starts from its series at 1; see inverse_cbrt.
constexpr double near_one = 0.05;

/// Whether a condition (of a comparison of V) holds in all lanes.
template <class V, class Mask>
OCU_LANE_INLINE bool all_lanes(Mask mask) {
#if defined(__AVX512DQ__)
  if constexpr (sizeof(V) == 64) return _mm512_movepi64_mask((__m512i)mask) == 0xff;
#endif
#if defined(__AVX__)
  if constexpr (sizeof(V) == 32) return _mm256_movemask_pd((__m256d)mask) == 0xf;
#endif
  constexpr int n = static_cast<int>(sizeof(V) / sizeof(double));
  std::int64_t all = -1;
  for (int l = 0; l < n; ++l) all &= mask[l];
  return all != 0;
}

/// x^(-1/3) for x > 0 without a library call: start from the exponent bits (a third by shifts,
/// which every instruction set has), then third-order Newton steps y (1 + e/3 + 2 e^2/9), e = 1 - x
/// y^3. Start error below 6 %, after one step 1e-3, two 5e-9, three round-off.
template <class V>
OCU_LANE_INLINE V inverse_cbrt(V x) {
  typedef std::int64_t I __attribute__((vector_size(sizeof(V))));
  // Tissue hardly changes its volume: the series to the third order starts with an error below
  // 35/243 near_one^4 = 9e-7, and one step leaves round-off.
  const V d = x - 1.0;
  if (all_lanes<V>(d * d < near_one * near_one)) {
    const V y = 1.0 - d * (1.0 / 3.0 - d * (2.0 / 9.0 - d * (14.0 / 81.0)));
    const V e = 1.0 - x * (y * y * y);
    return y + y * (e * (1.0 / 3.0 + e * (2.0 / 9.0)));
  }
  const I bits = (I)x;
  const I third =
      (bits >> 2) + (bits >> 4) + (bits >> 6) + (bits >> 8) + (bits >> 10) + (bits >> 12);
  // 4/3 of the bits of 1.0, less 1/3 of a mantissa bias that centres the start error; the shifts
  // give 0.33325 instead of 1/3 of the bits, which the constant makes up for at x = 1.
  constexpr std::int64_t one = 0x3ff0000000000000;
  constexpr std::int64_t third_of_one =
      (one >> 2) + (one >> 4) + (one >> 6) + (one >> 8) + (one >> 10) + (one >> 12);
  constexpr std::int64_t bias = 0x0000800000000000;  // 1/32 of an octave
  const I start = (one + third_of_one - bias) - third;
  V y = (V)start;
  for (int n = 0; n < 3; ++n) {
    const V e = 1.0 - x * (y * y * y);
    y += y * (e * (1.0 / 3.0 + e * (2.0 / 9.0)));
  }
  return y;
}

/// (1 + j)^(-2/3) - 1 without cancellation: z = y - 1 of y = (1 + j)^(-1/3) mended by one Newton
/// step on (1 + z)^3 (1 + j) = 1, whose residual 3 z + 3 z^2 + z^3 + j (1 + z)^3 has no large
/// terms.
template <class V>
OCU_LANE_INLINE V inverse_cbrt_square_minus_one(V j) {
  const V y = inverse_cbrt(1.0 + j);
  V z = y - 1.0;
  const V residual = z * (3.0 + z * (3.0 + z)) + j * (y * y * y);
  z -= residual / (3.0 * (y * y) * (1.0 + j));
  return z * (2.0 + z);
}

/// Displacement gradient, its cofactor-based dilatation, and what laws need of them.
template <class V>
struct Gradient {
  V H[9];    ///< grad u, row-major, H[3 i + j] = du_i / dX_j
  V cof[9];  ///< d(dilatation)/dH: cof F at finite strain, identity at small strain
  V j;       ///< dilatation: J - 1 at finite strain, tr H at small strain
};

/// J - 1 = tr H + tr cof H + det H: no cancellation near J = 1, so that a bulk modulus 1e9 times
/// the shear modulus still gives a pressure good to round-off of the strain, not of 1.
template <class V>
OCU_LANE_INLINE V dilatation_finite(const V H[9]) {
  const V c00 = H[4] * H[8] - H[5] * H[7];
  const V c01 = H[5] * H[6] - H[3] * H[8];
  const V c02 = H[3] * H[7] - H[4] * H[6];
  const V c11 = H[0] * H[8] - H[2] * H[6];
  const V c22 = H[0] * H[4] - H[1] * H[3];
  return (H[0] + H[4] + H[8]) + ((c00 + c11 + c22) + (H[0] * c00 + H[1] * c01 + H[2] * c02));
}

/// cof F = (1 + tr H) I - H^T + cof H.
template <class V>
OCU_LANE_INLINE void complete_finite(Gradient<V>& g) {
  const V* H = g.H;
  V* c = g.cof;
  c[0] = H[4] * H[8] - H[5] * H[7];
  c[1] = H[5] * H[6] - H[3] * H[8];
  c[2] = H[3] * H[7] - H[4] * H[6];
  c[3] = H[2] * H[7] - H[1] * H[8];
  c[4] = H[0] * H[8] - H[2] * H[6];
  c[5] = H[1] * H[6] - H[0] * H[7];
  c[6] = H[1] * H[5] - H[2] * H[4];
  c[7] = H[2] * H[3] - H[0] * H[5];
  c[8] = H[0] * H[4] - H[1] * H[3];
  const V trace = H[0] + H[4] + H[8];
  g.j = trace + ((c[0] + c[4] + c[8]) + (H[0] * c[0] + H[1] * c[1] + H[2] * c[2]));
  c[0] += 1.0 + (H[4] + H[8]);
  c[4] += 1.0 + (H[0] + H[8]);
  c[8] += 1.0 + (H[0] + H[4]);
  c[1] -= H[3];
  c[2] -= H[6];
  c[3] -= H[1];
  c[5] -= H[7];
  c[6] -= H[2];
  c[7] -= H[5];
}

/// Dilatation and its derivative for a law's kinematics.
template <class Law, class V>
OCU_LANE_INLINE V dilatation_of(const V H[9]) {
  if constexpr (Law::finite_strain)
    return dilatation_finite(H);
  else
    return H[0] + H[4] + H[8];
}

template <class Law, class V>
OCU_LANE_INLINE void complete(Gradient<V>& g) {
  if constexpr (Law::finite_strain) {
    complete_finite(g);
  } else {
    for (int i = 0; i < 9; ++i) g.cof[i] = V{} + (i % 4 == 0 ? 1.0 : 0.0);
    g.j = g.H[0] + g.H[4] + g.H[8];
  }
}

}  // namespace
}  // namespace ocublast::solid
