#include "flow_solver/immersed/motion_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>
#include <string>

#include "coupler/base/errors.hpp"

namespace ocublast::flow {
namespace {

constexpr const char* header = "time_s,x_m,y_m,z_m,angle_rad";

/// Second derivatives of the natural spline through (time, value), one column: tridiagonal system
/// of continuous first derivatives (de Boor 1978, chapter IV).
void solve_spline(const std::vector<double>& time, const std::vector<MotionTable::Row>& value,
                  std::size_t column, std::vector<MotionTable::Row>& second) {
  const std::size_t n = time.size();
  std::vector<double> upper(n, 0.0), right(n, 0.0);
  for (std::size_t i = 1; i + 1 < n; ++i) {
    const double below = time[i] - time[i - 1];
    const double above = time[i + 1] - time[i];
    const double slope_change = (value[i + 1][column] - value[i][column]) / above -
                                (value[i][column] - value[i - 1][column]) / below;
    const double pivot = 2.0 * (below + above) - below * upper[i - 1];
    upper[i] = above / pivot;
    right[i] = (6.0 * slope_change - below * right[i - 1]) / pivot;
  }
  for (std::size_t i = n - 1; i-- > 0;) {
    second[i][column] = right[i] - upper[i] * second[i + 1][column];
  }
}

}  // namespace

MotionTable::MotionTable(std::vector<double> time, std::vector<Row> rows)
    : time_(std::move(time)), value_(std::move(rows)), second_(time_.size(), Row{}) {
  if (time_.size() < 2 || value_.size() != time_.size()) {
    throw CaseError(
        fmt::format("motion table: holds {} times; at least 2 are needed", time_.size()));
  }
  for (std::size_t i = 1; i < time_.size(); ++i) {
    if (!(time_[i] > time_[i - 1])) {
      throw CaseError(fmt::format("motion table: time {} s of row {} does not follow {} s",
                                  time_[i], i + 1, time_[i - 1]));
    }
  }
  for (std::size_t c = 0; c < n_columns; ++c) solve_spline(time_, value_, c, second_);
}

MotionTable::Point MotionTable::at(double t) const {
  const double inside = std::clamp(t, time_.front(), time_.back());
  const auto above = std::upper_bound(time_.begin() + 1, time_.end() - 1, inside);
  const auto i = static_cast<std::size_t>(above - time_.begin());
  const double h = time_[i] - time_[i - 1];
  const double b = (inside - time_[i - 1]) / h;
  const double a = 1.0 - b;
  Point point;
  for (std::size_t c = 0; c < n_columns; ++c) {
    const double y0 = value_[i - 1][c], y1 = value_[i][c];
    const double m0 = second_[i - 1][c], m1 = second_[i][c];
    point.rate[c] = (y1 - y0) / h + h / 6.0 * ((3.0 * b * b - 1.0) * m1 - (3.0 * a * a - 1.0) * m0);
    point.value[c] = a * y0 + b * y1 + h * h / 6.0 * ((a * a * a - a) * m0 + (b * b * b - b) * m1) +
                     (t - inside) * point.rate[c];
  }
  return point;
}

MotionTable read_motion_table(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::string line;
  if (!in || !std::getline(in, line)) {
    throw CaseError(fmt::format("{}: cannot be read", file.string()));
  }
  if (line != header) {
    throw CaseError(
        fmt::format("{}:1: header is '{}', accepted '{}'", file.string(), line, header));
  }
  std::vector<double> time;
  std::vector<MotionTable::Row> rows;
  for (int number = 2; std::getline(in, line); ++number) {
    if (line.empty()) continue;
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream words(line);
    double t = 0.0;
    MotionTable::Row row{};
    words >> t;
    for (double& x : row) words >> x;
    std::string more;
    bool finite = std::isfinite(t);
    for (const double x : row) finite = finite && std::isfinite(x);
    if (!words || !finite || words >> more) {
      throw CaseError(
          fmt::format("{}:{}: expected five numbers ({})", file.string(), number, header));
    }
    time.push_back(t);
    rows.push_back(row);
  }
  try {
    return {std::move(time), std::move(rows)};
  } catch (const CaseError& error) {
    throw CaseError(fmt::format("{}: {}", file.string(), error.what()));
  }
}

}  // namespace ocublast::flow
