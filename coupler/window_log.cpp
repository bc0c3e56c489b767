#include "coupler/window_log.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

#include "coupler/base/errors.hpp"

namespace ocublast::coupler {
namespace {

constexpr const char* columns =
    "time_s,window,steps_flow,steps_solid,work_flow_J,work_solid_J,"
    "impulse_flow_x_N_s,impulse_flow_y_N_s,impulse_flow_z_N_s,"
    "impulse_solid_x_N_s,impulse_solid_y_N_s,impulse_solid_z_N_s,"
    "energy_error_J,theta,iterations,residual,overhead_us\n";

std::string rows_up_to(const std::filesystem::path& file, std::uint64_t last_window) {
  std::ifstream in(file);
  std::string line;
  std::string kept;
  std::getline(in, line);
  while (std::getline(in, line)) {
    const auto comma = line.find(',');
    if (comma == std::string::npos) break;
    if (std::strtoull(line.c_str() + comma + 1, nullptr, 10) > last_window) break;
    kept += line + "\n";
  }
  return kept;
}

}  // namespace

WindowLog::WindowLog(const std::filesystem::path& file, std::uint64_t last_window) : file_(file) {
  const std::string kept = last_window > 0 ? rows_up_to(file, last_window) : std::string();
  out_ = std::fopen(file.c_str(), "w");
  if (out_ == nullptr) throw LinkError(fmt::format("{}: cannot be created", file.string()));
  std::fputs(columns, out_);
  std::fputs(kept.c_str(), out_);
}

WindowLog::~WindowLog() {
  if (out_ != nullptr) std::fclose(out_);
}

void WindowLog::add(const WindowRow& row) {
  // The shortest digits that read back as the same double: two runs can be compared exactly.
  const auto line = fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{},{:.4g},{},{:.4g},{:.1f}\n",
                                row.window.t_end, row.window.number, row.window.steps_flow,
                                row.steps_solid, row.work_flow, row.work_solid, row.impulse_flow[0],
                                row.impulse_flow[1], row.impulse_flow[2], row.impulse_solid[0],
                                row.impulse_solid[1], row.impulse_solid[2], row.energy_error,
                                row.theta, row.iterations, row.residual, 1e6 * row.overhead);
  std::fputs(line.c_str(), out_);
}

void WindowLog::flush() {
  std::fflush(out_);
}

void WindowLog::close() {
  if (out_ == nullptr) return;
  const bool bad = std::ferror(out_) != 0;
  const bool failed = std::fclose(out_) != 0;
  out_ = nullptr;
  if (bad || failed)
    throw LinkError(
        fmt::format("{}: could not be written to the end; is the disk full?", file_.string()));
}

namespace {

constexpr const char* interface_columns =
    "time_s,window,work_flow_J,work_solid_J,impulse_flow_x_N_s,impulse_flow_y_N_s,impulse_flow_z_N_"
    "s,"
    "impulse_solid_x_N_s,impulse_solid_y_N_s,impulse_solid_z_N_s,energy_error_J\n";

/// Sums of the rows that an earlier run has written.
Balance sums_of(const std::string& rows) {
  Balance sums;
  std::istringstream lines(rows);
  for (std::string line; std::getline(lines, line);) {
    std::vector<double> values;
    std::istringstream cells(line);
    for (std::string cell; std::getline(cells, cell, ',');)
      values.push_back(std::strtod(cell.c_str(), nullptr));
    if (values.size() < 11) continue;
    sums.add(values[2], values[3], {values[4], values[5], values[6]},
             {values[7], values[8], values[9]});
  }
  return sums;
}

}  // namespace

InterfaceLog::InterfaceLog(const std::filesystem::path& directory, std::string name,
                           std::uint64_t last_window)
    : name_(std::move(name)), file_(directory / fmt::format("coupling_{}.csv", name_)) {
  const std::string kept = last_window > 0 ? rows_up_to(file_, last_window) : std::string();
  balance_ = sums_of(kept);
  out_.open(file_, std::ios::trunc);
  if (!out_) throw LinkError(fmt::format("{}: cannot be created", file_.string()));
  out_ << interface_columns << kept;
}

void InterfaceLog::add(const TimeWindow& window, std::span<const double> flow,
                       const link::Header& solid) {
  const std::array<double, 3> impulse =
      flow.empty() ? solid.impulse : std::array{flow[1], flow[2], flow[3]};
  const double work = flow.empty() ? solid.work : flow[0];
  balance_.add(work, solid.work, impulse, solid.impulse);
  const auto given = flow.empty() ? std::string(",,")
                                  : fmt::format("{},{},{}", impulse[0], impulse[1], impulse[2]);
  out_ << fmt::format("{},{},{},{},{},{},{},{},{}\n", window.t_end, window.number,
                      flow.empty() ? std::string() : fmt::format("{}", work), solid.work, given,
                      solid.impulse[0], solid.impulse[1], solid.impulse[2],
                      balance_.energy_error());
}

void InterfaceLog::flush() {
  out_.flush();
}

void InterfaceLog::close() {
  if (!out_.is_open()) return;
  out_.close();
  if (!out_)
    throw LinkError(
        fmt::format("{}: could not be written to the end; is the disk full?", file_.string()));
}

double WallTime::median_overhead() const {
  if (overheads.empty()) return 0.0;
  auto sorted = overheads;
  const auto middle = sorted.begin() + static_cast<long>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  return static_cast<double>(*middle);
}

namespace {

nlohmann::json quantity(const std::string& name, double value, const char* unit) {
  return {{"name", name}, {"value", value}, {"unit", unit}};
}

void add_balance(nlohmann::json& quantities, const std::string& prefix, const Balance& b) {
  quantities.push_back(quantity(prefix + "interface_work_flow", b.work_flow, "J"));
  quantities.push_back(quantity(prefix + "interface_work_solid", b.work_solid, "J"));
  quantities.push_back(quantity(prefix + "interface_energy_error", b.energy_error(), "J"));
  quantities.push_back(
      quantity(prefix + "interface_energy_error_relative", b.relative_energy_error(), "1"));
  const char* axes[3] = {"x", "y", "z"};
  for (std::size_t k = 0; k < 3; ++k) {
    quantities.push_back(quantity(fmt::format("{}interface_impulse_flow_{}", prefix, axes[k]),
                                  b.impulse_flow[k], "N s"));
    quantities.push_back(quantity(fmt::format("{}interface_impulse_solid_{}", prefix, axes[k]),
                                  b.impulse_solid[k], "N s"));
  }
}

void add_area(nlohmann::json& quantities, const std::string& prefix, const InterfaceArea& area) {
  quantities.push_back(quantity(prefix + "interface_area_flow", area.flow, "m^2"));
  quantities.push_back(quantity(prefix + "interface_area_solid", area.solid, "m^2"));
}

}  // namespace

void write_summary(const std::filesystem::path& file, const CouplingSummary& s) {
  nlohmann::json quantities = nlohmann::json::array();
  add_balance(quantities, "", s.balance);
  InterfaceArea total;
  for (const InterfaceArea& area : s.areas)
    total = {total.flow + area.flow, total.solid + area.solid};
  add_area(quantities, "", total);
  for (std::size_t k = 0; k < s.interfaces.size(); ++k) {
    const auto& [name, balance] = s.interfaces[k];
    add_balance(quantities, name + "_", balance);
    add_area(quantities, name + "_", s.areas[k]);
  }
  quantities.push_back(quantity("coupling_theta_max", s.theta_max, "1"));
  const nlohmann::json summary{{"time_s", s.time},
                               {"quantities", quantities},
                               {"performance",
                                {{"windows", s.windows},
                                 {"microseconds_per_window", 1e6 * s.wall.median_overhead()},
                                 {"wall_s",
                                  {{"total", s.wall.total},
                                   {"set_up", s.wall.set_up},
                                   {"flow", s.wall.flow},
                                   {"solid", s.wall.solid},
                                   {"coupling", s.wall.coupling}}}}}};
  auto aside = file;
  aside += ".part";
  std::ofstream out(aside, std::ios::trunc);
  out << summary.dump(2) << '\n';
  out.close();
  if (!out) throw LinkError(fmt::format("{}: cannot be written; is the disk full?", file.string()));
  std::filesystem::rename(aside, file);
}

}  // namespace ocublast::coupler
