#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "coupler/balance.hpp"
#include "coupler/time_window.hpp"

namespace ocublast::coupler {

/// Numbers kept alive by whoever made them (a received message, a vector); never changed while
/// shared.
struct SharedValues {
  std::shared_ptr<const void> owner;
  std::span<const double> values;

  [[nodiscard]] static SharedValues from(std::vector<double> values);
  /// The numbers to be changed; copied first where somebody else holds them too.
  [[nodiscard]] std::span<double> own();
};

/// A window that the flow has finished and the solid has not (pipelined coupling).
struct FlowAhead {
  TimeWindow window;
  bool idle = false;                ///< its load is exactly zero
  std::uint32_t steps = 0;          ///< taken by the flow
  double work = 0.0;                ///< J, by the flow's quadrature
  std::array<double, 3> impulse{};  ///< N s
  double impedance = 0.0;           ///< kg/(m^2 s)
  double stable_step = 0.0;         ///< s, of the flow after it
  SharedValues load;                ///< [n] Pa at its end, empty when idle
  SharedValues balance;             ///< several interfaces: [n, 4] J, N s
};

/// All the coupler knows between two windows: what a checkpoint holds, next to those of the
/// solvers.
struct CouplingState {
  std::uint64_t window = 0;    ///< last finished
  double time = 0.0;           ///< s
  double stable_flow = 0.0;    ///< s
  double stable_solid = 0.0;   ///< s
  double impedance = 0.0;      ///< kg/(m^2 s), last reported by the flow
  double mass_per_area = 0.0;  ///< kg/m^2, last reported by the solid
  double theta_max = 0.0;
  bool solid_at_rest = true;  ///< nothing has moved in the last window
  bool wall_current = true;   ///< the flow's wall is exactly the solid's
  /// Bit k: the last load that solid k was given is exactly zero.
  std::uint64_t zero_loads = ~std::uint64_t{0};
  double width_before = 0.0;     ///< s, of the window `velocity_before` is the beginning of
  SharedValues position;         ///< [n,3] m
  SharedValues velocity;         ///< [n,3] m/s
  SharedValues velocity_before;  ///< [n,3] m/s
  SharedValues acceleration;     ///< [n,3] m/s^2, where the solid was asked for it
  SharedValues load;             ///< [n] Pa at the end of the window (parallel implicit coupling)
  SharedValues wall;      ///< [n,3] m, where the flow was last told its wall is (mapped meshes)
  SharedValues path_end;  ///< [6 n] m, m/s: the wall as sent last, in windows below the flow's step
  std::optional<FlowAhead> ahead;

  /// Where the flow stands: the window ahead, or the one both have finished.
  [[nodiscard]] std::uint64_t flow_window() const { return ahead ? ahead->window.number : window; }
  [[nodiscard]] double flow_time() const { return ahead ? ahead->window.t_end : time; }
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
