#include "flow_solver/boundary/inflow_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <string>
#include <string_view>

#include "coupler/base/errors.hpp"

namespace ocublast::flow {
namespace {

constexpr std::string_view header = "time_s,pressure_Pa,temperature_K,speed_m_s";

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && (text.back() == ' ' || text.back() == '\r')) text.remove_suffix(1);
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  return text;
}

/// The numbers of a line; empty where it does not hold exactly four finite ones.
std::vector<double> numbers(std::string_view line) {
  std::vector<double> out;
  while (true) {
    const std::size_t comma = line.find(',');
    const std::string_view word = trimmed(line.substr(0, comma));
    double value = 0.0;
    const auto end = word.data() + word.size();
    const auto read = std::from_chars(word.data(), end, value);
    if (read.ec != std::errc() || read.ptr != end || !std::isfinite(value)) return {};
    out.push_back(value);
    if (comma == std::string_view::npos) break;
    line.remove_prefix(comma + 1);
  }
  return out.size() == 4 ? out : std::vector<double>();
}

}  // namespace

InflowTable::InflowTable(std::vector<InflowPoint> points, const Gas& gas,
                         const std::array<double, 3>& inwards)
    : points_(std::move(points)), gas_(gas), inwards_(inwards) {
  if (points_.empty()) throw CaseError("inflow table: it has no points");
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const InflowPoint& p = points_[i];
    if (!(p.pressure > 0.0) || !(p.temperature > 0.0)) {
      throw CaseError(fmt::format(
          "inflow table: pressure {} Pa, temperature {} K at t = {} s; both must be above 0",
          p.pressure, p.temperature, p.time));
    }
    if (i > 0 && !(p.time > points_[i - 1].time)) {
      throw CaseError(fmt::format("inflow table: time {} s follows {} s; times must rise", p.time,
                                  points_[i - 1].time));
    }
  }
}

State InflowTable::at(double t, double, double, double) const {
  const auto above =
      std::upper_bound(points_.begin(), points_.end(), t,
                       [](double time, const InflowPoint& p) { return time < p.time; });
  InflowPoint p = above == points_.begin() ? points_.front() : *(above - 1);
  if (above != points_.begin() && above != points_.end()) {
    const double f = (t - p.time) / (above->time - p.time);
    p.pressure += f * (above->pressure - p.pressure);
    p.temperature += f * (above->temperature - p.temperature);
    p.speed += f * (above->speed - p.speed);
  }
  return {.rho = density(gas_, p.pressure, p.temperature),
          .u = p.speed * inwards_[0],
          .v = p.speed * inwards_[1],
          .w = p.speed * inwards_[2],
          .p = p.pressure};
}

std::vector<InflowPoint> read_inflow_points(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::string line;
  if (!in || !std::getline(in, line) || trimmed(line) != header) {
    throw CaseError(fmt::format("{}: line 1 must be \"{}\"", file.string(), header));
  }
  std::vector<InflowPoint> points;
  for (int number = 2; std::getline(in, line); ++number) {
    if (trimmed(line).empty()) continue;
    const std::vector<double> v = numbers(line);
    if (v.empty()) {
      throw CaseError(fmt::format("{}:{}: '{}' is not four numbers {}", file.string(), number,
                                  trimmed(line), header));
    }
    points.push_back({v[0], v[1], v[2], v[3]});
  }
  return points;
}

}  // namespace ocublast::flow
