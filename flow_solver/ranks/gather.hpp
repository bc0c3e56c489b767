#pragma once

#include <span>
#include <vector>

#include "coupler/base/ranks.hpp"
#include "flow_solver/grid/grid.hpp"
#include "flow_solver/grid/precision.hpp"

namespace ocublast::flow::inline OCU_PRECISION {

/// Calls visit(i, j, k) for all nodes of the box, i fastest.
template <class Visit>
void for_nodes(const NodeBox& box, const Visit& visit) {
  for (int k = box.lo[2]; k < box.hi[2]; ++k) {
    for (int j = box.lo[1]; j < box.hi[1]; ++j) {
      for (int i = box.lo[0]; i < box.hi[0]; ++i) visit(i, j, k);
    }
  }
}

/// Place of node (i, j, k) in an array [k, j, i] of the whole grid.
[[nodiscard]] inline std::size_t place_of(const Grid& grid, int i, int j, int k) {
  return (static_cast<std::size_t>(k) * static_cast<std::size_t>(grid.axis[1].n) +
          static_cast<std::size_t>(j)) *
             static_cast<std::size_t>(grid.axis[0].n) +
         static_cast<std::size_t>(i);
}

/// Values of all nodes [k, j, i] on the root, elsewhere nothing. `own`: the nodes that this rank
/// holds; value(i, j, k) is called for them. Collective.
template <class T, class Value>
[[nodiscard]] std::vector<T> gather_nodes(const Ranks& ranks, const Grid& grid, const NodeBox& own,
                                          const Value& value) {
  std::vector<T> mine;
  for_nodes(own, [&](int i, int j, int k) { mine.push_back(static_cast<T>(value(i, j, k))); });
  if (ranks.alone()) return mine;
  const auto boxes = ranks.gather(std::span<const NodeBox>(&own, 1));
  const auto parts = ranks.gather(std::span<const T>(mine));
  std::vector<T> all(ranks.root() ? grid.n_cells() : 0);
  for (std::size_t r = 0; ranks.root() && r < parts.size(); ++r) {
    auto next = parts[r].begin();
    for_nodes(boxes[r][0], [&](int i, int j, int k) { all[place_of(grid, i, j, k)] = *next++; });
  }
  return all;
}

/// The way back: calls put(i, j, k, value) for this rank's nodes with the root's values.
/// Collective.
template <class T, class Put>
void scatter_nodes(const Ranks& ranks, const Grid& grid, const NodeBox& own, std::span<const T> all,
                   const Put& put) {
  const auto boxes = ranks.gather(std::span<const NodeBox>(&own, 1));
  std::vector<std::vector<T>> parts(boxes.size());
  for (std::size_t r = 0; ranks.root() && r < parts.size(); ++r) {
    for_nodes(boxes[r][0],
              [&](int i, int j, int k) { parts[r].push_back(all[place_of(grid, i, j, k)]); });
  }
  std::vector<T> mine;
  for_nodes(own, [&](int, int, int) { mine.push_back(T{}); });
  ranks.scatter(parts, std::span<T>(mine));
  auto next = mine.begin();
  for_nodes(own, [&](int i, int j, int k) { put(i, j, k, *next++); });
}

}  // namespace ocublast::flow
