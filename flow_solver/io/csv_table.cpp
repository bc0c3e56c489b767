#include "flow_solver/io/csv_table.hpp"

#include <fmt/format.h>

#include <cstdlib>

#include "coupler/base/errors.hpp"

namespace ocublast::flow::inline OCU_PRECISION {

std::ofstream open_csv_table(const std::filesystem::path& csv, const std::string& header,
                             double resume_time) {
  std::string kept;
  if (resume_time >= 0.0) {
    std::ifstream in(csv);
    std::string line;
    while (std::getline(in, line))
      if (kept.empty() || std::strtod(line.c_str(), nullptr) <= resume_time) kept += line + '\n';
  }
  std::ofstream file(csv, std::ios::trunc);
  if (!file) throw LinkError(fmt::format("{}: cannot be written", csv.string()));
  file << (kept.empty() ? header + '\n' : kept);
  return file;
}

}  // namespace ocublast::flow
