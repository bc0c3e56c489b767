#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "flow_solver/immersed/immersed_boundary.hpp"
#include "flow_solver/io/probes.hpp"
#include "flow_solver/step.hpp"

namespace ocublast::flow::inline OCU_PRECISION {

/// Where a run stands beside its fields.
struct RunClock {
  double time = 0.0;  ///< s
  std::int64_t step = 0;
  std::int64_t window = 0;              ///< coupling window, 0 when alone
  double next_output = 0.0;             ///< s
  double next_interface = 0.0;          ///< s
  std::vector<double> field_times;      ///< s, frames written
  std::vector<double> interface_times;  ///< s, frames written
  std::vector<std::uint8_t> walls;      ///< history of the immersed walls, read back only
  std::vector<double> surface_times;    ///< s, of the surface probes
  std::vector<double> surface_history;  ///< Pa
  std::vector<double> bodies;  ///< motions and balances of the bodies, read back as they are
  std::vector<double> sums;    ///< further running maxima and sums, by the run's own order
};

/// Writes the whole state to `directory`/flow.h5, aside first and then renamed. It holds the nodes
/// of the whole grid, gathered by the root, so that a run goes on with any number of ranks.
/// Collective.
void write_checkpoint(const Ranks& ranks, const std::filesystem::path& directory, const Flow& flow,
                      const ImmersedBoundary* bodies, const Probes& probes, const RunClock& clock);

/// Reads it back: fields, walls, probe histories. The
/// topology, and RunClock::walls after it, are left to the caller. Throws CaseError when the file
/// does not fit the case.
[[nodiscard]] RunClock read_checkpoint(const std::filesystem::path& directory, Flow& flow,
                                       ImmersedBoundary* bodies, Probes& probes);

}  // namespace ocublast::flow
