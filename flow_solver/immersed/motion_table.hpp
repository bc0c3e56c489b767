#pragma once

#include <array>
#include <filesystem>
#include <vector>

namespace ocublast::flow {

/// Motion given at times: columns time_s, x_m, y_m, z_m, angle_rad, with natural cubic splines
/// between, so that position, velocity and acceleration are continuous and belong together.
class MotionTable {
 public:
  static constexpr std::size_t n_columns = 4;
  using Row = std::array<double, n_columns>;  ///< x, y, z (m), angle (rad)
  struct Point {
    Row value{};
    Row rate{};
  };

  MotionTable() = default;
  /// Times ascending, at least two. Throws CaseError otherwise.
  MotionTable(std::vector<double> time, std::vector<Row> rows);

  [[nodiscard]] bool empty() const { return time_.empty(); }
  [[nodiscard]] double first_time() const { return time_.front(); }
  [[nodiscard]] double last_time() const { return time_.back(); }
  /// Values and rates at time t [s]; beyond the ends the straight continuation.
  [[nodiscard]] Point at(double t) const;

 private:
  std::vector<double> time_;
  std::vector<Row> value_;
  std::vector<Row> second_;  ///< second derivatives at the times
};

/// Reads a comma-separated file with the header time_s,x_m,y_m,z_m,angle_rad. Throws CaseError with
/// file and line.
[[nodiscard]] MotionTable read_motion_table(const std::filesystem::path& file);

}  // namespace ocublast::flow
