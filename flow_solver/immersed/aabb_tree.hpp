#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "flow_solver/immersed/surface.hpp"
#include "flow_solver/immersed/vec3.hpp"

namespace ocublast::flow {

/// Nearest point of a triangle and its barycentric coordinates.
struct TrianglePoint {
  Vec3 point;                      ///< m
  std::array<double, 3> weight{};  ///< of the corners, not negative, sum 1
};

/// Ericson (2005), Real-Time Collision Detection, section 5.1.5.
[[nodiscard]] TrianglePoint nearest_on_triangle(const Vec3& x, const Vec3& a, const Vec3& b,
                                                const Vec3& c) noexcept;

/// Tree of boxes over the facets of one surface. Built once by median splits; when the surface
/// moves the boxes are refitted, and the tree is rebuilt when they have grown by too much.
class AabbTree {
 public:
  /// Builds, or refits when the facets are those of the last call.
  void update(const std::vector<Corners>& facets, std::span<const double> position);
  [[nodiscard]] const Box& box() const { return nodes_.front().box; }

  /// Nearest point to x among the facets for which `accept(facet, point)` holds and whose squared
  /// distance is below `best2` (m^2, lowered). Returns the facet, -1: none. Of facets equally near
  /// the first, so that the answer does not depend on the form of the tree, which remembers past
  /// places.
  template <class Accept>
  std::int32_t nearest(const Vec3& x, double& best2, TrianglePoint& best,
                       const Accept& accept) const;

  /// Calls `visit(facet)` for all facets whose leaf boxes overlap `range`.
  template <class Visit>
  void visit(const Box& range, const Visit& visit) const;

 private:
  struct Node {
    Box box;
    std::int32_t right = 0;  ///< inner node: its left child follows it; leaf: 0
    std::int32_t first = 0;  ///< leaf: entries of order_
    std::int32_t count = 0;
  };
  void build(std::int32_t first, std::int32_t count, std::vector<Vec3>& centre);
  void refit();
  void load_corners(std::span<const double> position);
  [[nodiscard]] double half_surface() const;

  static constexpr std::int32_t leaf_size = 4;
  static constexpr int deepest = 64;  // median splits of fewer than 2^31 facets need 30 levels
  std::vector<Node> nodes_;
  std::vector<std::int32_t> order_;
  std::vector<Corners> facets_;
  std::vector<std::array<Vec3, 3>> corner_;  ///< of the facets in the order of the leaves
  std::vector<Vec3> normal_;                 ///< of the same; at most of unit length, zero: unknown
  double half_surface_built_ = 0.0;
};

template <class Accept>
std::int32_t AabbTree::nearest(const Vec3& x, double& best2, TrianglePoint& best,
                               const Accept& accept) const {
  struct Entry {
    std::int32_t node;
    double distance2;
  };
  std::array<Entry, deepest> stack;
  std::size_t top = 0;
  std::int32_t found = -1;
  stack[top++] = {0, nodes_.front().box.distance2(x)};
  while (top > 0) {
    const Entry entry = stack[--top];
    if (entry.distance2 > best2) continue;
    const Node& node = nodes_[entry.node];
    if (node.right == 0) {
      for (std::int32_t n = node.first; n < node.first + node.count; ++n) {
        const auto& t = corner_[n];
        // Boxes of oblique facets are thick; the distance from the facet's plane tells most of them
        // off.
        const double off_plane = dot(x - t[0], normal_[n]);
        if (off_plane * off_plane > best2) continue;
        const TrianglePoint candidate = nearest_on_triangle(x, t[0], t[1], t[2]);
        const double d2 = norm2(candidate.point - x);
        const bool nearer = d2 < best2 || (d2 == best2 && order_[n] < found);
        if (nearer && accept(order_[n], candidate.point)) {
          best2 = d2;
          best = candidate;
          found = order_[n];
        }
      }
      continue;
    }
    Entry near{entry.node + 1, nodes_[entry.node + 1].box.distance2(x)};
    Entry far{node.right, nodes_[node.right].box.distance2(x)};
    if (far.distance2 < near.distance2) std::swap(near, far);
    stack[top++] = far;
    stack[top++] = near;
  }
  return found;
}

template <class Visit>
void AabbTree::visit(const Box& range, const Visit& visit) const {
  std::array<std::int32_t, deepest> stack;
  std::size_t top = 0;
  stack[top++] = 0;
  while (top > 0) {
    const std::int32_t at = stack[--top];
    const Node& node = nodes_[at];
    if (!node.box.overlaps(range, 0.0)) continue;
    if (node.right == 0) {
      for (std::int32_t n = node.first; n < node.first + node.count; ++n) visit(order_[n]);
      continue;
    }
    stack[top++] = node.right;
    stack[top++] = at + 1;
  }
}

}  // namespace ocublast::flow
