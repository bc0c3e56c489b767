#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "solid_solver/boundary/schedule.hpp"

namespace ocublast::solid {

/// Reads a table of numbers by time, separated by commas: a line of titles, then per line a time
/// (s, ascending) and one value for each of `n_columns` columns. Appends what is wrong, with line
/// numbers, to `faults`; then the result is empty.
[[nodiscard]] std::vector<Schedule> read_schedules(const std::filesystem::path& file,
                                                   std::size_t n_columns,
                                                   std::vector<std::string>& faults);

}  // namespace ocublast::solid
