#pragma once

#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "coupler/base/closest_point.hpp"
#include "solid_solver/boundary/vec3.hpp"
#include "solid_solver/mesh/solid_mesh.hpp"

namespace ocublast::solid {

/// Triangles of a surface (quads are cut in two) with a hash of space over their boxes.
class FacetSearch {
 public:
  explicit FacetSearch(const std::vector<Facet>& facets);

  using Triangle = std::array<std::int32_t, 3>;
  [[nodiscard]] const std::vector<Triangle>& triangles() const { return triangles_; }
  /// Nodes of the surface, each once.
  [[nodiscard]] const std::vector<std::int32_t>& nodes() const { return nodes_; }

  /// Sorts the triangles, grown by `reach` m, into cells; positions [n, 3], m.
  void build(std::span<const double> positions, double reach);
  /// Triangles whose grown boxes may hold the place.
  [[nodiscard]] std::span<const std::int32_t> near(const Vec3& x) const;

 private:
  using Key = std::array<std::int64_t, 3>;
  struct KeyHash {
    std::size_t operator()(const Key& k) const {
      return static_cast<std::size_t>(k[0] * 73856093 ^ k[1] * 19349663 ^ k[2] * 83492791);
    }
  };
  [[nodiscard]] Key key(const Vec3& x) const;

  std::vector<Triangle> triangles_;
  std::vector<std::int32_t> nodes_;
  double size_ = 1.0;
  std::unordered_map<Key, std::vector<std::int32_t>, KeyHash> cells_;
};

/// Position of a node in an array [n, 3].
[[nodiscard]] inline Vec3 place_of(std::span<const double> positions, std::int32_t n) {
  const auto at = 3 * static_cast<std::size_t>(n);
  return {positions[at], positions[at + 1], positions[at + 2]};
}

}  // namespace ocublast::solid
