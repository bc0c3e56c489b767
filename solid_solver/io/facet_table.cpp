#include "solid_solver/io/facet_table.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <fstream>

namespace ocublast::solid {
namespace {

constexpr std::size_t most_faults = 5;  ///< told of one file

/// Numbers of one line; empty where one of them is none.
std::vector<double> numbers_of(const std::string& line) {
  std::vector<double> numbers;
  const char* at = line.data();
  const char* end = at + line.size();
  while (at <= end) {
    while (at < end && (*at == ' ' || *at == '\t')) ++at;
    double value = 0.0;
    const auto [next, error] = std::from_chars(at, end, value);
    if (error != std::errc{} || !std::isfinite(value)) return {};
    numbers.push_back(value);
    at = next;
    while (at < end && (*at == ' ' || *at == '\t' || *at == '\r')) ++at;
    if (at < end && *at != ',') return {};
    ++at;
  }
  return numbers;
}

}  // namespace

std::vector<Schedule> read_schedules(const std::filesystem::path& file, std::size_t n_columns,
                                     std::vector<std::string>& faults) {
  std::vector<Schedule> schedules(n_columns);
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  const std::size_t before = faults.size();
  double last = -INFINITY;
  for (std::size_t number = 2; std::getline(in, line); ++number) {
    if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
    const auto fault = [&](const std::string& text) {
      if (faults.size() < before + most_faults)
        faults.push_back(fmt::format("{}:{}: {}", file.string(), number, text));
    };
    const auto values = numbers_of(line);
    if (values.empty()) {
      fault("not a list of finite numbers separated by commas");
    } else if (values.size() != n_columns + 1) {
      fault(fmt::format("{} numbers, accepted {}: a time and one for each of {} facets",
                        values.size(), n_columns + 1, n_columns));
    } else if (values[0] < last) {
      fault(fmt::format("time {:g} s comes after {:g} s, accepted ascending", values[0], last));
    } else {
      last = values[0];
      for (std::size_t c = 0; c < n_columns; ++c) {
        schedules[c].times.push_back(values[0]);
        schedules[c].values.push_back(values[c + 1]);
      }
    }
  }
  if (faults.size() == before && n_columns > 0 && schedules[0].times.empty())
    faults.push_back(fmt::format("{}: no line of numbers under the titles", file.string()));
  if (faults.size() > before) return {};
  return schedules;
}

}  // namespace ocublast::solid
