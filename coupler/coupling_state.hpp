#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "coupler/balance.hpp"

namespace ocublast::coupler {

/// Numbers kept alive by whoever made them (a received message, a vector); shared, never changed.
struct SharedValues {
  std::shared_ptr<const void> owner;
  std::span<const double> values;

  [[nodiscard]] static SharedValues from(std::vector<double> values);
};

/// All the coupler knows between two windows: what a checkpoint holds, next to those of the solvers.
struct CouplingState {
  std::uint64_t window = 0;        ///< last finished
  double time = 0.0;               ///< s
  double stable_flow = 0.0;        ///< s
  double stable_solid = 0.0;       ///< s
  double impedance = 0.0;          ///< kg/(m^2 s), last reported by the flow
  double mass_per_area = 0.0;      ///< kg/m^2, last reported by the solid
  double theta_max = 0.0;
  bool solid_at_rest = true;       ///< nothing has moved in the last window
  bool wall_current = true;        ///< the flow's wall is exactly the solid's
  bool load_zero = true;           ///< the last load the solid was given is exactly zero
  double width_before = 0.0;       ///< s, of the window `velocity_before` is the beginning of
  SharedValues position;           ///< [n,3] m
  SharedValues velocity;           ///< [n,3] m/s
  SharedValues velocity_before;    ///< [n,3] m/s
  Balance balance;
};

/// Writes DIRECTORY/coupler.state with a checksum. Throws LinkError when it cannot.
void write_state(const std::filesystem::path& directory, const CouplingState& state,
                 std::uint64_t case_hash, std::uint64_t mesh_hash);

struct StoredState {
  CouplingState state;
  std::uint64_t case_hash = 0;
  std::uint64_t mesh_hash = 0;
};
/// Reads it back. Throws LinkError when it is missing, damaged or of another version.
[[nodiscard]] StoredState read_state(const std::filesystem::path& directory);

/// Makes RUN/checkpoint/WINDOW.part and returns its absolute path; an old one is emptied.
[[nodiscard]] std::filesystem::path begin_checkpoint(const std::filesystem::path& run,
                                                     std::uint64_t window);
/// Renames it to its final name, which marks it complete, and removes all but the last `keep`.
void complete_checkpoint(const std::filesystem::path& run, std::uint64_t window, int keep);

}  // namespace ocublast::coupler
