#pragma once

#include <filesystem>
#include <fstream>
#include <string>

#include "flow_solver/grid/precision.hpp"

namespace ocublast::flow::inline OCU_PRECISION {

/// Opens a table whose first column is the time in s. A fresh one (resume_time < 0) starts with the
/// header line; a resumed one keeps the lines up to resume_time. Throws LinkError when it cannot be
/// written.
[[nodiscard]] std::ofstream open_csv_table(const std::filesystem::path& csv,
                                           const std::string& header, double resume_time);

}  // namespace ocublast::flow
