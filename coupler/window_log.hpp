#pragma once

#include <array>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "coupler/balance.hpp"
#include "coupler/link/message.hpp"
#include "coupler/time_window.hpp"

namespace ocublast::coupler {

/// One line of coupling.csv.
struct WindowRow {
  TimeWindow window;
  std::uint32_t steps_solid = 0;
  double work_flow = 0.0, work_solid = 0.0;               ///< J
  std::array<double, 3> impulse_flow{}, impulse_solid{};  ///< N s
  double energy_error = 0.0;                              ///< J, summed so far
  double theta = 0.0;
  int iterations = 1;
  double residual = 0.0;  ///< of the motion, relative (implicit)
  double overhead = 0.0;  ///< s
};

/// DIR/coupling.csv: the interface balance of every window, with units in the header.
class WindowLog {
 public:
  /// Rows after `last_window` of an earlier run in the same directory are dropped (0: all).
  WindowLog(const std::filesystem::path& file, std::uint64_t last_window);
  ~WindowLog();
  WindowLog(const WindowLog&) = delete;
  WindowLog& operator=(const WindowLog&) = delete;
  void add(const WindowRow& row);
  void flush();
  /// Throws LinkError when rows could not be written.
  void close();

 private:
  std::filesystem::path file_;
  std::FILE* out_ = nullptr;
};

/// Where the wall time of a run went, s.
struct WallTime {
  double set_up = 0.0;
  double flow = 0.0;
  double solid = 0.0;
  double coupling = 0.0;  ///< in windows, neither flow nor solid
  double total = 0.0;
  std::vector<float> overheads;  ///< per window
  [[nodiscard]] double median_overhead() const;
};

/// DIR/coupling_NAME.csv: the balance of one of several interfaces.
class InterfaceLog {
 public:
  InterfaceLog(const std::filesystem::path& directory, std::string name, std::uint64_t last_window);
  /// `flow`: work J and impulse N s (4 values), empty where the flow does not say.
  void add(const TimeWindow& window, std::span<const double> flow, const link::Header& solid);
  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] const Balance& balance() const { return balance_; }
  void flush();
  /// Throws LinkError when rows could not be written.
  void close();

 private:
  std::string name_;
  std::filesystem::path file_;
  std::ofstream out_;
  Balance balance_;
};

/// Area [m^2] of an interface at the start, by the mesh of each side.
struct InterfaceArea {
  double flow = 0.0;
  double solid = 0.0;
};

/// What coupling_summary.json says.
struct CouplingSummary {
  double time = 0.0;
  std::uint64_t windows = 0;
  double theta_max = 0.0;
  Balance balance;
  std::vector<InterfaceArea> areas;                         ///< of all interfaces
  std::vector<std::pair<std::string, Balance>> interfaces;  ///< of several, by name
  WallTime wall;
};
/// Writes DIR/coupling_summary.json, at once or not at all.
void write_summary(const std::filesystem::path& file, const CouplingSummary& summary);

}  // namespace ocublast::coupler
