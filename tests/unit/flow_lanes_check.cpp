// Operations on a tile of lanes against the same on single values. Compiled per instruction set and
// precision.

#include <cmath>
#include <string>

#include "flow_solver/numerics/simd.hpp"

namespace ocublast::flow::inline OCU_PRECISION::OCU_ISA {
namespace {

struct Tile {
  alignas(64) Real v[tile_width];
};
Tile make(Real first, Real factor) {
  Tile t{};
  Real x = first;
  for (Real& value : t.v) value = x *= factor;
  return t;
}
Tile out(Vec v) {
  Tile t{};
  store(t.v, v);
  return t;
}

template <class Of>
bool same(Vec got, const Of& expected) {
  const Tile t = out(got);
  for (int l = 0; l < tile_width; ++l) {
    if (t.v[l] != expected(l)) return false;
  }
  return true;
}

bool columns_go_there_and_back() {
  constexpr int length = 2 * tile_width + 3;
  Real from[tile_width][length], to[tile_width][length] = {};
  const Real* rows[tile_width];
  Real* back[tile_width];
  for (int l = 0; l < tile_width; ++l) {
    rows[l] = from[l];
    back[l] = to[l];
    for (int i = 0; i < length; ++i) from[l][i] = static_cast<Real>(100 * l + i);
  }
  Vec node[tile_width];
  for (int i = 0; i < tile_width; i += 4) load_four_columns(rows, 3 + i, node + i);
  bool right = true;
  for (int i = 0; i < tile_width; ++i)
    right = right && same(node[i], [&](int l) { return from[l][3 + i]; });
  store_columns(back, 3, node, all_lanes & ~2u);
  for (int l = 0; l < tile_width; ++l) {
    for (int i = 0; i < length; ++i) {
      const bool stored = l != 1 && i >= 3 && i < 3 + tile_width;
      right = right && to[l][i] == (stored ? from[l][i] : Real{0});
    }
  }
  return right;
}

}  // namespace

/// Name of what fails, empty if nothing does.
std::string check_lanes() {
  const Tile a = make(Real(-0.7), Real(-1.3)), b = make(Real(0.3), Real(1.21)),
             c = make(Real(5), Real(0.8));
  const Vec va = load(a.v), vb = load(b.v), vc = load(c.v);
  unsigned smaller = 0;
  for (int l = 0; l < tile_width; ++l) smaller |= a.v[l] < b.v[l] ? 1u << l : 0u;
  if (less(va, vb) != smaller) return "less";
  if (not_at_least(va, vb) != smaller) return "not_at_least";
  if (not_at_least(splat(std::nan("")), vb) != all_lanes) return "not_at_least of not-a-number";
  if (!same(select(0xa5u & all_lanes, va, vb),
            [&](int l) { return ((0xa5u >> l) & 1u) != 0 ? a.v[l] : b.v[l]; }))
    return "select";
  if (!same(vmax(va, vb), [&](int l) { return std::fmax(a.v[l], b.v[l]); })) return "vmax";
  if (!same(vmin(va, vb), [&](int l) { return std::fmin(a.v[l], b.v[l]); })) return "vmin";
  if (!same(vsqrt(vb), [&](int l) { return std::sqrt(b.v[l]); })) return "vsqrt";
  if (!same(vabs(va), [&](int l) { return std::fabs(a.v[l]); })) return "vabs";
  if (!same(va + vb * vc - va / vb,
            [&](int l) { return a.v[l] + b.v[l] * c.v[l] - a.v[l] / b.v[l]; }))
    return "arithmetic";
  // With one rounding or two.
  const Tile fused = out(madd(va, vb, vc)), negative = out(nmadd(va, vb, vc));
  for (int l = 0; l < tile_width; ++l) {
    const Real product = a.v[l] * b.v[l];
    if (fused.v[l] != std::fma(a.v[l], b.v[l], c.v[l]) && fused.v[l] != product + c.v[l])
      return "madd";
    if (negative.v[l] != std::fma(-a.v[l], b.v[l], c.v[l]) && negative.v[l] != c.v[l] - product)
      return "nmadd";
  }
  Tile past{};
  store_past_caches(past.v, va);
  _mm_sfence();
  if (!same(load(past.v), [&](int l) { return a.v[l]; })) return "store_past_caches";
  Real most = a.v[0];
  for (const Real v : a.v) most = std::fmax(most, v);
  if (largest_lane(va) != most) return "largest_lane";
  if (!columns_go_there_and_back()) return "columns";
  return {};
}

}  // namespace ocublast::flow::OCU_ISA
