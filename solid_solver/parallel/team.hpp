#pragma once

#include <memory>
#include <span>

#include "solid_solver/parallel/mesh_part.hpp"
#include "solid_solver/parallel/shared_values.hpp"

namespace ocublast::solid {

/// What a run needs of the other ranks that compute the same body. Alone every operation is trivial
/// and leaves all bits as they are. Operations are collective.
class Team {
 public:
  Team() = default;
  /// `part` may be null: the whole mesh is here.
  explicit Team(std::shared_ptr<const MeshPart> part);

  [[nodiscard]] bool alone() const { return part_ == nullptr; }
  /// Speaks, writes files, knows the whole state.
  [[nodiscard]] bool root() const { return alone() || part_->ranks->root(); }
  [[nodiscard]] int size() const { return alone() ? 1 : part_->ranks->size(); }
  [[nodiscard]] const MeshPart* part() const { return part_.get(); }
  /// Whether sums over nodes take this one here; each node of the body once.
  [[nodiscard]] bool counts(std::size_t node) const {
    return part_ == nullptr || part_->counts[node] != 0;
  }
  /// The same per node, empty when all count.
  [[nodiscard]] std::span<const std::uint8_t> counted() const {
    return part_ == nullptr ? std::span<const std::uint8_t>{} : part_->counts;
  }
  /// Nodes of the body.
  [[nodiscard]] std::size_t n_nodes(std::size_t own) const {
    return part_ == nullptr ? own : part_->n_nodes_whole;
  }
  /// Number of a node in the whole mesh.
  [[nodiscard]] std::size_t number(std::size_t node) const {
    return part_ == nullptr ? node : static_cast<std::size_t>(part_->node[node]);
  }
  [[nodiscard]] std::size_t cell_number(std::size_t cell) const {
    return part_ == nullptr ? cell : static_cast<std::size_t>(part_->cell[cell]);
  }

  [[nodiscard]] double sum(double value) const;
  void sum(std::span<double> values) const;
  [[nodiscard]] double least(double value) const;
  [[nodiscard]] double most(double value) const;
  void most(std::span<double> values) const;
  [[nodiscard]] bool any(bool value) const;
  /// See Ranks::together.
  void together(const std::function<void()>& work) const;
  /// The text of the rank for which `mine` holds (of the highest such).
  [[nodiscard]] std::string text_of(bool mine, const std::string& text) const;

  /// Returns when the root has come here as well; the others sleep meanwhile.
  void await_root() const {
    if (!alone()) part_->ranks->await_root();
  }
  /// The root's value, or its values in their number, on every rank.
  template <class T>
  requires std::is_trivially_copyable_v<T>
  void broadcast(T& value) const {
    if (!alone()) part_->ranks->broadcast(std::span<T>(&value, 1));
  }
  void broadcast(std::vector<double>& values) const;

  /// Parts of nodal forces [n, 4] to their sums.
  [[nodiscard]] SharedValues* forces() { return forces_.get(); }
  /// Parts of nodal numbers [n] to their sums, or to the least of them.
  void add_nodal(std::span<double> values);
  void take_least_nodal(std::span<double> values);

 private:
  std::shared_ptr<const MeshPart> part_;
  std::unique_ptr<SharedValues> forces_;
  std::unique_ptr<SharedValues> numbers_;
};

/// Channels of RankExchange; those of pressure nodes count on from the last.
enum Channel { forces_channel, numbers_channel, pressure_channel };

}  // namespace ocublast::solid
