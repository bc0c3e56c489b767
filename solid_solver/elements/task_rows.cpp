#include "solid_solver/elements/task_rows.hpp"

#include <algorithm>

namespace ocublast::solid {
namespace {

std::size_t index(std::int32_t n) {
  return static_cast<std::size_t>(n);
}

constexpr std::size_t none = static_cast<std::size_t>(-1);

}  // namespace

TaskRows::TaskRows(std::size_t n_rows, std::size_t width, std::span<const Use> uses,
                   std::size_t n_border_tasks)
    : width_(width) {
  std::vector<std::size_t> last_task(n_rows, none);
  std::vector<std::int32_t> n_tasks(n_rows, 0);
  for (const auto& use : uses)
    for (const auto row : use.rows)
      if (last_task[index(row)] != use.task) {
        last_task[index(row)] = use.task;
        ++n_tasks[index(row)];
      }
  for (const bool border : {true, false}) {
    for (std::size_t row = 0; row < n_rows; ++row)
      if (n_tasks[row] > 1 && (last_task[row] < n_border_tasks) == border)
        shared_.push_back(static_cast<std::int32_t>(row));
    if (border) n_border_shared_ = shared_.size();
  }
  std::vector<std::size_t> next_copy(n_rows, none);
  std::size_t n_copies = 0;
  for (const auto row : shared_) {
    first_copy_.push_back(n_copies);
    next_copy[index(row)] = n_copies;
    n_copies += index(n_tasks[index(row)]);
  }
  first_copy_.push_back(n_copies);
  std::fill(last_task.begin(), last_task.end(), none);
  for (const auto& use : uses) {
    for (const auto row : use.rows) {
      auto& next = next_copy[index(row)];
      if (next == none) {
        targets_.push_back(row);
        continue;
      }
      if (last_task[index(row)] != use.task) {
        last_task[index(row)] = use.task;
        ++next;
      }
      targets_.push_back(~static_cast<std::int32_t>(next - 1));
    }
    first_target_.push_back(targets_.size());
  }
  copies_.resize(width * n_copies);
}

void TaskRows::collect(double* field, Rows rows) {
  const std::size_t begin = rows == Rows::border ? 0 : n_border_shared_;
  const std::size_t end = rows == Rows::border ? n_border_shared_ : shared_.size();
#pragma omp for schedule(static)
  for (std::size_t s = begin; s < end; ++s) {
    double* sum = field + width_ * index(shared_[s]);
    double* last = copies_.data() + width_ * first_copy_[s + 1];
    for (double* copy = copies_.data() + width_ * first_copy_[s]; copy < last; copy += width_)
      for (std::size_t i = 0; i < width_; ++i) {
        sum[i] += copy[i];
        copy[i] = 0.0;
      }
  }
}

std::size_t TaskRows::bytes() const {
  return 4 * (targets_.size() + shared_.size()) + 8 * (first_copy_.size() + copies_.size());
}

}  // namespace ocublast::solid
