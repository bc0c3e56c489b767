#pragma once

#include <cstdint>
#include <string>

#include "coupler/base/case_common.hpp"
#include "coupler/base/case_reader.hpp"
#include "coupler/link/participant.hpp"
#include "coupler/mapping/interface_map.hpp"
#include "coupler/party.hpp"

namespace ocublast::coupler {

/// How wide a coupling window is.
enum class WindowRule {
  subcycle,  ///< one flow step; the solid takes several steps in it
  lockstep,  ///< one step of both, the smaller
  fixed,     ///< a given width
};

/// How flow and solid advance together.
enum class SchemeKind { serial_explicit, parallel_explicit, serial_implicit, parallel_implicit };
/// How an implicit iteration finds its next guess.
enum class RelaxationKind { constant, aitken, iqn_ils };

/// Section [coupling] of a case, with what the coupler needs of the common ones.
struct Settings {
  CaseCommon common;
  std::uint64_t case_hash = 0;
  Roster roster;  ///< the flow and the solids of the case

  SchemeKind scheme = SchemeKind::serial_explicit;
  WindowRule window = WindowRule::subcycle;
  double window_width = 0.0;  ///< s, for WindowRule::fixed
  int max_flow_steps = 1;     ///< per window when subcycling
  int max_solid_steps = 10;   ///< per window when subcycling
  int predictor_order = 2;
  link::WallPath wall_path = link::WallPath::cubic;
  link::LoadShape load_shape = link::LoadShape::linear;
  bool leap_frog = false;  ///< predict with the solid's own acceleration (lock step)
  double load_ramp = 0.0;  ///< s, over which the load on the solid grows to its full value; 0: none

  MappingOptions mapping;  ///< between interface meshes that differ

  RelaxationKind relaxation = RelaxationKind::aitken;
  double relaxation_factor = 1.0;    ///< constant, or the first of a window
  double convergence_motion = 1e-6;  ///< change of the motion of a window, relative to it
  double convergence_load = 0.0;     ///< change of the load, relative; 0: not looked at
  int max_iterations = 30;

  double theta_warn = 0.02;    ///< above: predictor order 1 at most
  double theta_refuse = 0.04;  ///< above: refused, explicit coupling grows without bound
  bool allow_unstable = false;

  bool record = true;
  bool record_packed = false;     ///< zstd
  bool share_memory = true;       ///< ipc: payloads through shared memory
  double silence_limit = 60.0;    ///< s without any sign of life
  double start_limit = 300.0;     ///< s from start until both are ready; also for the final BYE
  double step_limit = 0.0;        ///< s of wall time for one window of one side; 0: none
  double checkpoint_every = 0.0;  ///< s of simulated time; 0: none
  std::int64_t checkpoint_every_windows = 0;  ///< 0: none
  std::string endpoint;                       ///< empty: a private ipc socket
  std::vector<std::string>
      hosts;  ///< by party: address it connects from; empty: started by the coupler
  double max_message = 256.0;  ///< MB
};

/// Declares and reads [coupling] and the common sections; faults gather in the reader.
[[nodiscard]] Settings read_settings(CaseReader& reader);

}  // namespace ocublast::coupler
