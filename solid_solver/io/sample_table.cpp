#include "solid_solver/io/sample_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "coupler/base/errors.hpp"

namespace ocublast::solid {

double SampleTable::largest(std::size_t column) const {
  double found = n_rows() > 0 ? at(0, column) : 0.0;
  for (std::size_t r = 1; r < n_rows(); ++r) found = std::max(found, at(r, column));
  return found;
}

double SampleTable::extreme(std::size_t column) const {
  double found = 0.0;
  for (std::size_t r = 0; r < n_rows(); ++r)
    if (std::abs(at(r, column)) > std::abs(found)) found = at(r, column);
  return found;
}

double SampleTable::largest_running_mean(std::size_t column, double width) const {
  const std::size_t n = n_rows();
  if (n < 2) return n == 1 ? at(0, column) : 0.0;
  std::vector<double> integral(n, 0.0);
  for (std::size_t r = 1; r < n; ++r)
    integral[r] =
        integral[r - 1] + 0.5 * (at(r, 0) - at(r - 1, 0)) * (at(r, column) + at(r - 1, column));
  const double span = at(n - 1, 0) - at(0, 0);
  if (span <= width) return span > 0.0 ? integral[n - 1] / span : at(n - 1, column);
  const auto integral_to = [&](double t,
                               std::size_t hint) {  // rows ascend; t lies at or before hint
    std::size_t r = hint;
    while (r > 0 && at(r - 1, 0) > t) --r;
    if (r == 0) return 0.0;
    const double s = (t - at(r - 1, 0)) / (at(r, 0) - at(r - 1, 0));
    const double value = at(r - 1, column) + s * (at(r, column) - at(r - 1, column));
    return integral[r - 1] + 0.5 * (t - at(r - 1, 0)) * (at(r - 1, column) + value);
  };
  double found = -1e300;
  for (std::size_t r = 1; r < n; ++r) {
    const double from = at(r, 0) - width;
    if (from < at(0, 0)) continue;
    found = std::max(found, (integral[r] - integral_to(from, r)) / width);
  }
  return found;
}

void SampleTable::append_to(const std::filesystem::path& file) {
  std::ofstream out(file, started_ ? std::ios::app : std::ios::trunc);
  if (!started_) out << fmt::format("{}\n", fmt::join(columns_, ","));
  started_ = true;
  for (; written_ < n_rows(); ++written_) {
    for (std::size_t c = 0; c < columns_.size(); ++c)
      out << fmt::format("{}{:.10g}", c == 0 ? "" : ",", at(written_, c));
    out << '\n';
  }
  out.close();
  if (!out) throw LinkError(fmt::format("{}: cannot be written; is the disk full?", file.string()));
}

}  // namespace ocublast::solid
