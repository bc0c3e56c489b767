#include "flow_solver/immersed/snapped_grid.hpp"

#include <algorithm>
#include <cmath>

namespace ocublast::flow {
namespace {

constexpr double units_per_spacing =
    1048576.0;  // 2^20: 1e-6 of a cell, room for 2^11 cells squared

double smallest_spacing(const Axis& axis) {
  double h = axis.max - axis.min;
  for (int i = 0; i + 1 < axis.n; ++i) h = std::min(h, axis.x(i + 1) - axis.x(i));
  return h;
}

}  // namespace

SnappedGrid::SnappedGrid(const Grid& grid) {
  double finest = HUGE_VAL;
  for (const Axis& axis : grid.axis) {
    if (axis.present) finest = std::min(finest, smallest_spacing(axis));
  }
  for (int a = 0; a < 3; ++a) {
    const Axis& axis = grid.axis[static_cast<std::size_t>(a)];
    // A uniform grid's nodes lie at odd multiples of half a spacing from its first face: exact.
    origin_[a] = axis.present ? axis.min : axis.x(0);
    unit_[a] = (axis.present ? smallest_spacing(axis) : finest) / units_per_spacing;
    auto& nodes = node_[static_cast<std::size_t>(a)];
    nodes.resize(static_cast<std::size_t>(axis.n));
    for (int i = 0; i < axis.n; ++i)
      nodes[static_cast<std::size_t>(i)] = std::llround(to_units(a, axis.x(i)));
  }
}

Point64 SnappedGrid::snap(const Vec3& x) const noexcept {
  return {std::llround(to_units(0, x[0])), std::llround(to_units(1, x[1])),
          std::llround(to_units(2, x[2]))};
}

void SnappedGrid::snap(std::span<const double> position, std::vector<Point64>& snapped) const {
  snapped.resize(position.size() / 3);
  for (std::size_t v = 0; v < snapped.size(); ++v) {
    snapped[v] = snap(row(position, static_cast<std::int32_t>(v)));
  }
}

}  // namespace ocublast::flow
