#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "coupler/base/ranks.hpp"
#include "solid_solver/mesh/solid_mesh.hpp"

namespace ocublast::solid {

/// The cells of one rank and how they hang together with those of the others. No cell is on two
/// ranks; nodes between them are on both, with the same values to the last bit.
struct MeshPart {
  const Ranks* ranks = nullptr;
  SolidMesh mesh;                  ///< own cells and their nodes; node sets cut down, no face sets
  std::vector<std::int32_t> node;  ///< [own nodes] number in the whole mesh, ascending
  std::vector<std::int64_t> cell;  ///< [own cells] number in the whole mesh
  std::size_t n_nodes_whole = 0;
  std::vector<std::uint8_t> counts;  ///< [own nodes] 1 on the lowest rank that has the node

  /// Cells of one kind that a rank has at a shared node.
  struct Holder {
    int rank = 0;
    Shape shape = Shape::hex8;
    std::int32_t tissue = 0;
    bool operator==(const Holder&) const = default;
  };
  struct SharedNode {
    std::int32_t node = 0;        ///< of the part
    std::vector<Holder> holders;  ///< each once, ascending in rank; this rank's own included
  };
  std::vector<SharedNode> shared;  ///< ascending in the whole mesh's numbers
};

/// The part of this rank. `rank_of_cell` [n_cells] is the same on all ranks.
[[nodiscard]] std::shared_ptr<const MeshPart> make_mesh_part(
    const Ranks& ranks, const SolidMesh& whole, std::span<const std::int32_t> rank_of_cell);

/// Translation of the whole mesh's nodes into a part's, -1 for those that are elsewhere.
class PartNumbers {
 public:
  explicit PartNumbers(const MeshPart& part);
  [[nodiscard]] std::int32_t of(std::int32_t whole) const {
    return number_[static_cast<std::size_t>(whole)];
  }

 private:
  std::vector<std::int32_t> number_;
};

}  // namespace ocublast::solid
