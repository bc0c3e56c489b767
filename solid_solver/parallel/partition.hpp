#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "solid_solver/mesh/solid_mesh.hpp"

namespace ocublast::solid {

/// What a mesh is to be cut by.
struct PartitionKeys {
  int parts = 2;
  std::span<const double> cost;  ///< [n_cells] of computing a cell, in any unit, above zero
  /// Lists of nodes whose cells must all be in one part (surfaces in contact, ties): per list.
  std::vector<std::vector<std::int32_t>> kept_together;
};

/// Part of each cell, [n_cells]: METIS on the graph of cells that share a face, weighted by cost;
/// the same in every run. Every part has cells; throws CaseError where there are too few.
[[nodiscard]] std::vector<std::int32_t> partition_cells(const SolidMesh& mesh,
                                                        const PartitionKeys& keys);

/// Cost of the most expensive part over the mean.
[[nodiscard]] double imbalance(std::span<const std::int32_t> part_of_cell,
                               std::span<const double> cost, int parts);

}  // namespace ocublast::solid
