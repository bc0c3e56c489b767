#pragma once

#include <memory>
#include <span>
#include <vector>

#include "solid_solver/step.hpp"

namespace ocublast::solid {

/// The state of the whole body at one time, as outputs need it.
struct StateView {
  const SolidMesh* mesh = nullptr;
  double time = 0.0;                     ///< s
  std::span<const double> displacement;  ///< [n_nodes, 4] m
  std::span<const double> velocity;      ///< [n_nodes, 4] m/s
  std::span<const double> acceleration;  ///< [n_nodes, 4] m/s^2
  std::span<const double> cells;         ///< [n_cells, n_evaluated]
};

/// Brings the parts of a state to the root.
class WholeState {
 public:
  /// `whole` is the mesh before it was cut; `run` works on its part (or on all of it).
  WholeState(std::shared_ptr<const SolidMesh> whole, const SolidRun& run);

  [[nodiscard]] const SolidMesh& mesh() const { return *whole_; }
  /// The whole state on the root, until the next call; elsewhere only the time. Collective. Alone
  /// nothing is copied.
  [[nodiscard]] StateView gather(const SolidRun& run, const CellResults& cells);

 private:
  using Lists = std::vector<std::vector<std::int64_t>>;
  void gather_nodes(const Team& team, std::span<const double> field,
                    AlignedVector<double>& whole) const;

  std::shared_ptr<const SolidMesh> whole_;
  Lists nodes_;  ///< on the root: per rank, whole numbers of the nodes that count there
  Lists cells_;  ///< per rank, whole numbers of its cells
  NodalState state_;
  CellResults results_;
};

}  // namespace ocublast::solid
