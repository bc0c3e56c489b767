#include "solid_solver/boundary/facet_search.hpp"

#include <algorithm>
#include <cmath>

namespace ocublast::solid {

FacetSearch::FacetSearch(const std::vector<Facet>& facets) {
  for (const auto& f : facets) {
    triangles_.push_back({f[0], f[1], f[2]});
    if (f[3] >= 0) triangles_.push_back({f[0], f[2], f[3]});
    for (const auto n : f)
      if (n >= 0) nodes_.push_back(n);
  }
  std::sort(nodes_.begin(), nodes_.end());
  nodes_.erase(std::unique(nodes_.begin(), nodes_.end()), nodes_.end());
}

FacetSearch::Key FacetSearch::key(const Vec3& x) const {
  return {static_cast<std::int64_t>(std::floor(x[0] / size_)),
          static_cast<std::int64_t>(std::floor(x[1] / size_)),
          static_cast<std::int64_t>(std::floor(x[2] / size_))};
}

void FacetSearch::build(std::span<const double> positions, double reach) {
  std::vector<std::array<Vec3, 2>> boxes;
  double edge = 0.0;
  for (const auto& t : triangles_) {
    std::array<Vec3, 2> box{Vec3{1e300, 1e300, 1e300}, Vec3{-1e300, -1e300, -1e300}};
    for (const auto n : t)
      for (std::size_t i = 0; i < 3; ++i) {
        const double x = place_of(positions, n)[i];
        box[0][i] = std::min(box[0][i], x - reach);
        box[1][i] = std::max(box[1][i], x + reach);
      }
    for (std::size_t i = 0; i < 3; ++i) edge += box[1][i] - box[0][i];
    boxes.push_back(box);
  }
  // Cells of twice the mean box: a box touches some 8 of them at most.
  size_ = std::max(1e-300, 2.0 * edge / (3.0 * static_cast<double>(triangles_.size())));
  cells_.clear();
  for (std::size_t t = 0; t < boxes.size(); ++t) {
    const Key low = key(boxes[t][0]);
    const Key high = key(boxes[t][1]);
    for (auto i = low[0]; i <= high[0]; ++i)
      for (auto j = low[1]; j <= high[1]; ++j)
        for (auto k = low[2]; k <= high[2]; ++k)
          cells_[{i, j, k}].push_back(static_cast<std::int32_t>(t));
  }
}

std::span<const std::int32_t> FacetSearch::near(const Vec3& x) const {
  const auto found = cells_.find(key(x));
  if (found == cells_.end()) return {};
  return found->second;
}

}  // namespace ocublast::solid
