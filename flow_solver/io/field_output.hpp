#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "coupler/base/background_writer.hpp"
#include "coupler/base/ranks.hpp"
#include "flow_solver/gas/gas.hpp"
#include "flow_solver/grid/fields.hpp"
#include "flow_solver/grid/grid.hpp"
#include "flow_solver/immersed/immersed_boundary.hpp"

namespace ocublast::flow::inline OCU_PRECISION {

/// Writes the flow field as a series that ParaView opens: flow.xmf beside one flow/NNNN.h5 per
/// time, each closed before the index names it. Cell data on the non-uniform grid, single
/// precision. Files are written in the background: values are copied at once.
class FieldOutput {
 public:
  struct Options {
    std::filesystem::path directory;  ///< run directory
    double ambient_pressure = 0.0;    ///< Pa
  };
  FieldOutput(const Grid& grid, const Gas& gas, Options options, BackgroundWriter& writer);
  /// Writes frame number n_frames(): overpressure, density, temperature, velocity, tags. Under
  /// ranks W holds the nodes in `own`; the root gathers and writes. Collective.
  void write(const Ranks& ranks, const NodeBox& own, FieldsView<const Real> W,
             std::span<const std::uint8_t> tags, double t);
  [[nodiscard]] std::size_t n_frames() const { return times_.size(); }
  /// Continues a series after a resume: the first n frames of times are kept.
  void restore(std::vector<double> times) { times_ = std::move(times); }
  [[nodiscard]] const std::vector<double>& times() const { return times_; }

 private:
  struct Frame;
  void write_file(const Frame& frame) const;
  void write_index(const Frame& frame) const;
  const Grid* grid_;
  Gas gas_;
  Options options_;
  BackgroundWriter* writer_;
  std::vector<double> times_;
};

/// Writes the bodies' surfaces with pressure and velocity: interface.xmf, interface/NNNN.h5, in the
/// background as well.
class InterfaceOutput {
 public:
  InterfaceOutput(std::filesystem::path directory, BackgroundWriter& writer)
      : directory_(std::move(directory)), writer_(&writer) {}
  /// Collective; the root writes.
  void write(const Ranks& ranks, const ImmersedBoundary& bodies, FieldsView<const Real> W,
             double ambient_pressure, double t);
  void restore(std::vector<double> times) { times_ = std::move(times); }
  [[nodiscard]] const std::vector<double>& times() const { return times_; }

 private:
  struct Frame;
  void write_file(const Frame& frame) const;
  void write_index(const Frame& frame) const;
  std::filesystem::path directory_;
  BackgroundWriter* writer_;
  std::vector<double> times_;
};

}  // namespace ocublast::flow
