#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "coupler/base/rank_exchange.hpp"

namespace ocublast::solid {

/// Items (nodes, pressure nodes) that several ranks hold a part of the value of. After an exchange
/// every rank has the whole value: the parts added in ascending rank order, its own at its place,
/// so that all copies carry the same bits.
class SharedValues {
 public:
  struct Item {
    std::int32_t at = 0;     ///< row of the field
    std::vector<int> ranks;  ///< ascending, this rank included
  };
  /// Fields are [rows, stride]; the first `width` numbers of a row are exchanged. `items` come in
  /// an order that all ranks agree on; `channel` as in RankExchange.
  SharedValues(const Ranks& ranks, int channel, std::span<const Item> items, std::size_t width,
               std::size_t stride);

  /// Sends this rank's parts; the items' rows stay as they are until `finish`.
  void start(std::span<const double> field);
  void poll() { exchange_->poll(); }
  void finish(std::span<double> field);
  void add(std::span<double> field) {
    start(field);
    finish(field);
  }
  /// The least of the parts instead of their sum.
  void take_least(std::span<double> field);
  /// Numbers sent per exchange.
  [[nodiscard]] std::size_t n_sent() const { return out_.size(); }

 private:
  static constexpr std::size_t npos = static_cast<std::size_t>(-1);
  template <class Combine>
  void combine(std::span<double> field, Combine combine);

  std::size_t width_;
  std::size_t stride_;
  std::vector<std::size_t> rows_;  ///< to be sent, neighbour after neighbour
  std::vector<double> out_;
  std::vector<double> in_;
  std::vector<std::size_t> items_;    ///< row per item
  std::vector<std::size_t> first_;    ///< per item, its first source; one more at the end
  std::vector<std::size_t> sources_;  ///< place in in_, npos for the own part
  std::unique_ptr<RankExchange> exchange_;
};

}  // namespace ocublast::solid
