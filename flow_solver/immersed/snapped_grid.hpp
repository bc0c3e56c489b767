#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "flow_solver/grid/grid.hpp"
#include "flow_solver/immersed/vec3.hpp"

namespace ocublast::flow {

/// A point in whole units of the snapped grid.
using Point64 = std::array<std::int64_t, 3>;

/// Integer coordinates in which "does this line pass through this facet" has an exact answer. The
/// unit of a direction is 2^-20 of its smallest node spacing, whatever the spacing elsewhere; grid
/// nodes and vertices are rounded to it, once, for all lines and tags.
class SnappedGrid {
 public:
  explicit SnappedGrid(const Grid& grid);

  [[nodiscard]] Point64 snap(const Vec3& x) const noexcept;
  void snap(std::span<const double> position, std::vector<Point64>& snapped) const;
  /// Nodes 0 .. n - 1 of direction a.
  [[nodiscard]] const std::vector<std::int64_t>& node(int a) const {
    return node_[static_cast<std::size_t>(a)];
  }
  [[nodiscard]] double to_metres(int a, double units) const noexcept {
    return origin_[a] + units * unit_[a];
  }
  [[nodiscard]] double to_units(int a, double metres) const noexcept {
    return (metres - origin_[a]) / unit_[a];
  }
  [[nodiscard]] double unit(int a) const noexcept { return unit_[a]; }

 private:
  Vec3 origin_;
  Vec3 unit_;
  std::array<std::vector<std::int64_t>, 3> node_;
};

}  // namespace ocublast::flow
