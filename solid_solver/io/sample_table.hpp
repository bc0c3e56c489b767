#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace ocublast::solid {

/// A table in time, kept whole (peaks and running means come from it, checkpoints carry it) and
/// written as CSV with units in the header. The first column is time_s.
class SampleTable {
 public:
  explicit SampleTable(std::vector<std::string> columns) : columns_(std::move(columns)) {}

  void add(const std::vector<double>& row) {
    values_.insert(values_.end(), row.begin(), row.end());
  }
  [[nodiscard]] std::size_t n_rows() const { return values_.size() / columns_.size(); }
  [[nodiscard]] const std::vector<std::string>& columns() const { return columns_; }
  [[nodiscard]] double at(std::size_t row, std::size_t column) const {
    return values_[row * columns_.size() + column];
  }
  /// All values, for checkpoints.
  [[nodiscard]] const std::vector<double>& values() const { return values_; }
  void restore(std::vector<double> values) { values_ = std::move(values); }

  /// Largest value of a column; smallest; the one of largest magnitude, signed.
  [[nodiscard]] double largest(std::size_t column) const;
  [[nodiscard]] double extreme(std::size_t column) const;
  /// Largest mean over `width` s, trapezoid rule; of the whole record where that is shorter.
  [[nodiscard]] double largest_running_mean(std::size_t column, double width) const;

  /// Writes rows that are not yet in the file; the first call starts the file anew.
  void append_to(const std::filesystem::path& file);

 private:
  std::vector<std::string> columns_;
  std::vector<double> values_;
  std::size_t written_ = 0;
  bool started_ = false;
};

}  // namespace ocublast::solid
