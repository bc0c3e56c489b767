#pragma once

#include <cstdint>
#include <string>

#include "coupler/base/case_common.hpp"
#include "coupler/base/case_reader.hpp"
#include "coupler/link/participant.hpp"

namespace ocublast::coupler {

/// How wide a coupling window is.
enum class WindowRule {
  subcycle,  ///< one flow step; the solid takes several steps in it
  lockstep,  ///< one step of both, the smaller
  fixed,     ///< a given width
};

/// Section [coupling] of a case, with what the coupler needs of the common ones.
struct Settings {
  CaseCommon common;
  std::uint64_t case_hash = 0;

  WindowRule window = WindowRule::subcycle;
  double window_width = 0.0;       ///< s, for WindowRule::fixed
  int max_solid_steps = 10;        ///< per window when subcycling
  int predictor_order = 2;
  link::WallPath wall_path = link::WallPath::cubic;
  link::LoadShape load_shape = link::LoadShape::linear;

  double theta_warn = 0.02;        ///< above: predictor order 1 at most
  double theta_refuse = 0.04;      ///< above: refused, explicit coupling grows without bound
  bool allow_unstable = false;

  bool record = true;
  double silence_limit = 60.0;     ///< s without any sign of life
  double start_limit = 300.0;      ///< s from start until both are ready; also for the final BYE
  double step_limit = 0.0;         ///< s of wall time for one window of one side; 0: none
  double checkpoint_every = 0.0;   ///< s of simulated time; 0: none
  std::int64_t checkpoint_every_windows = 0;  ///< 0: none
  std::string endpoint;            ///< empty: a private ipc socket
  double max_message = 256.0;      ///< MB
};

/// Declares and reads [coupling] and the common sections; faults gather in the reader.
[[nodiscard]] Settings read_settings(CaseReader& reader);

}  // namespace ocublast::coupler
