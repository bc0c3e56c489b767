#pragma once

// Problems solved by the flow in one precision; both sit in one test program (tests/flow.cmake).

#include <cstddef>
#include <vector>

namespace ocublast::flow::testing {

struct Rest {
  double velocity = 0.0;     ///< largest speed that gas at rest has taken, m/s
  double density = 0.0;      ///< largest relative change
  double temperature = 0.0;  ///< largest relative change
};

struct Conservation {
  double mass = 0.0, energy = 0.0;  ///< relative changes
  std::size_t marked = 0;
};

struct BlastFigures {
  double error = 0.0;  ///< mean of |p - p_ref|
  double peak = 0.0;
  int steps = 0;
};

struct WallFigures {
  double plateau_error = 0.0, leak = 0.0;
};

struct PrecisionRun {
  double (*sod)(int n);     ///< mean of |rho - exact|
  double (*vortex)(int n);  ///< mean of |rho - exact|
  BlastFigures (*blast)(int n);
  WallFigures (*reflection)(double mach, double offset);
  double (*free_stream)();  ///< largest relative change of a uniform stream on a stretched grid
  Rest (*rest)(int steps);  ///< of air at rest on a stretched grid with walls and open faces
  Conservation (*closed_box)();
  /// Overpressure [Pa] by node of a plane pulse of the given part of ambient pressure that has run
  /// 150 cells.
  std::vector<double> (*pulse)(double amplitude);
  double (*active_tolerance)(double asked);  ///< that a flow takes
};

[[nodiscard]] const PrecisionRun& in_double_precision();
[[nodiscard]] const PrecisionRun& in_single_precision();

}  // namespace ocublast::flow::testing
