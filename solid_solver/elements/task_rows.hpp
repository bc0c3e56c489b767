#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "solid_solver/fields/aligned.hpp"

namespace ocublast::solid {

/// Sums at rows of a field to which several tasks add at once. A row that only one task uses is
/// added to in place; of the others each task has a copy of its own, and the copies are added in
/// the order of the tasks. So nothing depends on which thread runs which task when.
class TaskRows {
 public:
  /// Rows that one piece of a task adds to, each once.
  struct Use {
    std::span<const std::int32_t> rows;
    std::size_t task = 0;
  };
  TaskRows() = default;
  /// A field of n_rows rows of `width` numbers; `uses` ascend in their tasks, the first
  /// `n_border_tasks` of which are done before the others.
  TaskRows(std::size_t n_rows, std::size_t width, std::span<const Use> uses,
           std::size_t n_border_tasks);

  /// Where the rows of a use are to be added, in their order.
  [[nodiscard]] std::span<const std::int32_t> targets(std::size_t use) const {
    return {targets_.data() + first_target_[use], first_target_[use + 1] - first_target_[use]};
  }
  /// Half the targets are copies, in no order that a branch could be foretold by.
  [[nodiscard]] double* at(double* field, std::int32_t target) {
    double* const bases[2] = {field, copies_.data()};
    const bool copy = target < 0;
    return bases[copy] + width_ * static_cast<std::size_t>(copy ? ~target : target);
  }
  enum class Rows { border, others };  ///< complete after the border tasks; the rest
  /// Inside a parallel region, by all its threads: adds the copies to the field and clears them.
  void collect(double* field, Rows rows);
  [[nodiscard]] std::size_t bytes() const;

 private:
  std::size_t width_ = 1;
  std::vector<std::int32_t> targets_;  ///< a row, or ~ the number of a copy
  std::vector<std::size_t> first_target_{0};
  std::vector<std::int32_t> shared_;     ///< rows with copies; those of border tasks alone first
  std::vector<std::size_t> first_copy_;  ///< per shared row; one more at the end
  std::size_t n_border_shared_ = 0;
  AlignedVector<double> copies_;
};

}  // namespace ocublast::solid
