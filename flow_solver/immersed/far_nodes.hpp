#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "coupler/base/rank_exchange.hpp"
#include "coupler/base/ranks.hpp"
#include "flow_solver/grid/fields.hpp"
#include "flow_solver/grid/grid.hpp"

namespace ocublast::flow::inline OCU_PRECISION {

/// Nodes beyond a rank's block that its walls look at. A ghost reaches four nodes past the end of
/// its line, its foot and image lie within eight of there.
inline constexpr int far_reach = 12;

/// The gas at nodes that other ranks hold, near the bodies. A node beyond the domain's face belongs
/// to the rank at that face.
class FarNodes {
 public:
  /// `blocks`: the nodes of every rank. The ranks outlive this.
  FarNodes(const Grid& grid, const Ranks& ranks, std::span<const NodeBox> blocks);

  [[nodiscard]] const Ranks& ranks() const { return *ranks_; }
  /// This rank's block, without and with the domain's ghosts beside it.
  [[nodiscard]] const NodeBox& own() const { return own_; }
  /// Whether the node lies in this rank's block or at most `margin` nodes beyond.
  [[nodiscard]] bool near_own(const std::array<std::int32_t, 3>& node, int margin) const {
    for (std::size_t a = 0; a < 3; ++a) {
      if (node[a] < own_.lo[a] - margin || node[a] >= own_.hi[a] + margin) return false;
    }
    return true;
  }
  /// Rank that holds a node of the grid.
  [[nodiscard]] int owner(const std::array<std::int32_t, 3>& node) const;

  /// Sets what is exchanged: nodes within far_reach of a block and of one of the bodies' boxes (in
  /// nodes, may reach beyond the grid). The same on all ranks; nothing happens where nothing
  /// changed.
  void plan(std::span<const NodeBox> bodies);
  /// Brings the fields of W [n_primitive, and the artificial pressure where W has it]. Collective.
  void fetch(FieldsView<const Real> W);

  struct Place {
    const Real* at = nullptr;  ///< field 0; null: the node is this rank's own
    std::ptrdiff_t stride = 0;
  };
  /// NaN where the node was not asked for.
  [[nodiscard]] Place find(int i, int j, int k) const {
    if (holds(own_with_ghosts_, i, j, k)) return {};
    for (const Piece& p : pieces_) {
      if (holds(p.box, i, j, k)) return {p.data.data() + p.offset(i, j, k), p.row()};
    }
    return {nowhere_.get(), 0};
  }

 private:
  static constexpr int n_fields = n_primitive + 1;
  /// Nodes [k, j, field, i] that go from one rank to another.
  struct Piece {
    NodeBox box{};
    int peer = 0;
    std::vector<Real> data;
    [[nodiscard]] std::ptrdiff_t row() const { return box.hi[0] - box.lo[0]; }
    [[nodiscard]] std::ptrdiff_t offset(int i, int j, int k) const {
      const std::ptrdiff_t rows = box.hi[1] - box.lo[1];
      return ((k - box.lo[2]) * rows + (j - box.lo[1])) * n_fields * row() + (i - box.lo[0]);
    }
  };
  [[nodiscard]] NodeBox with_ghosts(const NodeBox& block) const;
  [[nodiscard]] NodeBox wanted(int rank, std::span<const NodeBox> bodies) const;
  const Ranks* ranks_;
  std::array<int, 3> n_{}, ghosts_{};
  std::vector<NodeBox> blocks_;
  NodeBox own_{}, own_with_ghosts_{};
  std::vector<NodeBox> planned_;
  std::vector<Piece> pieces_, outgoing_;
  std::unique_ptr<Real> nowhere_ = std::make_unique<Real>(std::numeric_limits<Real>::quiet_NaN());
  std::unique_ptr<RankExchange> exchange_;
};

/// The primitives at any node: this rank's own, or fetched ones.
struct GasNodes {
  GasNodes(FieldsView<const Real> own, const FarNodes* far_nodes = nullptr)
      : W(own), far(far_nodes) {}
  GasNodes(FieldsView<Real> own, const FarNodes* far_nodes = nullptr) : W(own), far(far_nodes) {}
  FieldsView<const Real> W;
  const FarNodes* far;  ///< null: this rank has the whole grid

  struct Place {
    const Real* at;  ///< field 0
    std::ptrdiff_t stride;
  };
  [[nodiscard]] Place operator()(int i, int j, int k) const {
    if (far != nullptr) {
      const FarNodes::Place p = far->find(i, j, k);
      if (p.at != nullptr) return {p.at, p.stride};
    }
    return {&W(0, i, j, k), W.stride_f};
  }
};

}  // namespace ocublast::flow
