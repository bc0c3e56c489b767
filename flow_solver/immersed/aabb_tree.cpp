#include "flow_solver/immersed/aabb_tree.hpp"

#include <algorithm>
#include <numeric>

namespace ocublast::flow {
namespace {

/// Growth of the summed box surface after which refitting no longer pays (measured: queries slow
/// down in proportion, a build costs about 15 refits).
constexpr double growth_before_rebuild = 1.3;

double half_surface_of(const Box& box) {
  const Vec3 d = box.high - box.low;
  return d[0] * d[1] + d[1] * d[2] + d[2] * d[0];
}

TrianglePoint on_triangle(const Vec3& a, const Vec3& b, const Vec3& c, double v, double w) {
  const double u = 1.0 - v - w;
  return {u * a + v * b + w * c, {u, v, w}};
}

}  // namespace

TrianglePoint nearest_on_triangle(const Vec3& x, const Vec3& a, const Vec3& b,
                                  const Vec3& c) noexcept {
  const Vec3 ab = b - a;
  const Vec3 ac = c - a;
  const Vec3 ax = x - a;
  const double d1 = dot(ab, ax);
  const double d2 = dot(ac, ax);
  if (d1 <= 0.0 && d2 <= 0.0) return {a, {1.0, 0.0, 0.0}};
  const Vec3 bx = x - b;
  const double d3 = dot(ab, bx);
  const double d4 = dot(ac, bx);
  if (d3 >= 0.0 && d4 <= d3) return {b, {0.0, 1.0, 0.0}};
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) {
    const double v = d1 / (d1 - d3);
    return {a + v * ab, {1.0 - v, v, 0.0}};
  }
  const Vec3 cx = x - c;
  const double d5 = dot(ab, cx);
  const double d6 = dot(ac, cx);
  if (d6 >= 0.0 && d5 <= d6) return {c, {0.0, 0.0, 1.0}};
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) {
    const double w = d2 / (d2 - d6);
    return {a + w * ac, {1.0 - w, 0.0, w}};
  }
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0) {
    const double w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return {b + w * (c - b), {0.0, 1.0 - w, w}};
  }
  const double sum = va + vb + vc;
  return on_triangle(a, b, c, vb / sum, vc / sum);
}

void AabbTree::load_corners(std::span<const double> position) {
  // A shade below one: rounding must not tell off the nearest facet.
  constexpr double length = 1.0 - 1e-12;
  corner_.resize(order_.size());
  normal_.resize(order_.size());
  for (std::size_t n = 0; n < order_.size(); ++n) {
    const Corners& v = facets_[order_[n]];
    const auto& t = corner_[n] = {row(position, v[0]), row(position, v[1]), row(position, v[2])};
    normal_[n] = length * unit(cross(t[1] - t[0], t[2] - t[0]));
  }
}

void AabbTree::build(std::int32_t first, std::int32_t count, std::vector<Vec3>& centre) {
  const std::size_t at = nodes_.size();
  nodes_.push_back({.box = {}, .right = 0, .first = first, .count = count});
  if (count <= leaf_size) return;
  Box centres;
  for (std::int32_t n = first; n < first + count; ++n) centres.include(centre[order_[n]]);
  const Vec3 size = centres.high - centres.low;
  const int a = size[0] >= size[1] && size[0] >= size[2] ? 0 : (size[1] >= size[2] ? 1 : 2);
  const std::int32_t half = count / 2;
  std::nth_element(order_.begin() + first, order_.begin() + first + half,
                   order_.begin() + first + count, [&](std::int32_t f, std::int32_t g) {
                     return centre[f][a] != centre[g][a] ? centre[f][a] < centre[g][a] : f < g;
                   });
  build(first, half, centre);
  nodes_[at].right = static_cast<std::int32_t>(nodes_.size());
  build(first + half, count - half, centre);
}

void AabbTree::refit() {
  for (std::size_t n = nodes_.size(); n-- > 0;) {
    Node& node = nodes_[n];
    node.box = Box{};
    if (node.right != 0) {
      node.box.include(nodes_[n + 1].box);
      node.box.include(nodes_[node.right].box);
      continue;
    }
    for (std::int32_t f = node.first; f < node.first + node.count; ++f) {
      for (const Vec3& x : corner_[f]) node.box.include(x);
    }
  }
}

double AabbTree::half_surface() const {
  double sum = 0.0;
  for (const Node& node : nodes_) sum += half_surface_of(node.box);
  return sum;
}

void AabbTree::update(const std::vector<Corners>& facets, std::span<const double> position) {
  if (!nodes_.empty()) {
    load_corners(position);
    refit();
    if (half_surface() <= growth_before_rebuild * half_surface_built_) return;
  }
  facets_ = facets;
  order_.resize(facets.size());
  std::iota(order_.begin(), order_.end(), 0);
  std::vector<Vec3> centre(facets.size());
  for (std::size_t f = 0; f < facets.size(); ++f) {
    const Corners& v = facets[f];
    centre[f] = (1.0 / 3.0) * (row(position, v[0]) + row(position, v[1]) + row(position, v[2]));
  }
  nodes_.clear();
  nodes_.reserve(facets.size());
  build(0, static_cast<std::int32_t>(facets.size()), centre);
  load_corners(position);
  refit();
  half_surface_built_ = half_surface();
}

}  // namespace ocublast::flow
