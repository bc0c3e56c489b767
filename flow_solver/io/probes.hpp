#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>
#include <vector>

#include "coupler/base/ranks.hpp"
#include "flow_solver/gas/gas.hpp"
#include "flow_solver/grid/fields.hpp"
#include "flow_solver/grid/grid.hpp"

namespace ocublast::flow::inline OCU_PRECISION {

struct Probe {
  std::string name;
  std::array<double, 3> position{};  ///< m
};

/// Overpressure history of one probe, condensed.
struct ProbeResult {
  double peak = 0.0;       ///< Pa, largest overpressure
  double peak_time = 0.0;  ///< s
  double arrival = -1.0;   ///< s, when half of the first peak was passed; -1: never
  double impulse = 0.0;    ///< Pa s, of the first positive phase
};

/// Condenses the history of signal b of n: times [m], values [m, n] in Pa.
[[nodiscard]] ProbeResult condense_history(std::span<const double> times,
                                           std::span<const double> values, std::size_t b,
                                           std::size_t n);

/// Point read-outs of the flow at every step: trilinear between fluid nodes, written to probes.csv.
class Probes {
 public:
  /// Throws CaseError for a probe outside the grid.
  Probes(const Grid& grid, const Gas& gas, std::vector<Probe> probes, double ambient_pressure);

  /// Starts the CSV file, or continues it after its line of time `resume_time`.
  void open(const std::filesystem::path& csv, double resume_time = -1.0);
  /// Samples W (tags [n_k, n_j, n_i], 0 = fluid; empty: all fluid) at time t. Under ranks W holds
  /// the nodes in `own`, and every rank gets all probes' values. Collective.
  void sample(const Ranks& ranks, const NodeBox& own, FieldsView<const Real> W,
              std::span<const std::uint8_t> tags, double t);
  void flush() { file_.flush(); }

  [[nodiscard]] const std::vector<Probe>& probes() const { return probes_; }
  /// Peak, arrival and impulse of probe b from its history since the start.
  [[nodiscard]] ProbeResult result(std::size_t b) const {
    return condense_history(times_, history_, b, probes_.size());
  }

  /// Largest overpressure [Pa] that any probe has seen.
  [[nodiscard]] double largest() const { return largest_; }

  /// History of all probes, for checkpoints: times [n] and overpressures [n, n_probes].
  [[nodiscard]] const std::vector<double>& times() const { return times_; }
  [[nodiscard]] const std::vector<double>& history() const { return history_; }
  void restore(std::vector<double> times, std::vector<double> history);

 private:
  struct Corner {
    std::array<int, 3> node{};
    double weight = 0.0;
  };
  const Grid* grid_;
  Gas gas_;
  std::vector<Probe> probes_;
  double ambient_pressure_;
  std::vector<std::array<Corner, 8>> corners_;
  std::vector<double> times_;
  std::vector<double> history_;
  double largest_ = 0.0;  ///< Pa
  std::ofstream file_;
};

}  // namespace ocublast::flow
