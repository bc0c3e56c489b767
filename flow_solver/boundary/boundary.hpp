#pragma once

#include <array>
#include <memory>

namespace ocublast::flow {

/// Primitive state at a point.
struct State {
  double rho = 1.0;  ///< kg/m^3
  double u = 0.0;    ///< m/s
  double v = 0.0;    ///< m/s
  double w = 0.0;    ///< m/s
  double p = 1.0;    ///< Pa, absolute
};

/// Gas that comes in through a face, where it depends on place and time.
class IncomingGas {
 public:
  virtual ~IncomingGas() = default;
  /// State at time t [s] and place x, y, z [m] (0.5 in absent directions). Called by several
  /// threads.
  [[nodiscard]] virtual State at(double t, double x, double y, double z) const = 0;
};

enum class BoundaryKind {
  symmetry,     ///< plane of symmetry, equally an adiabatic slip wall: fluxes of mass and energy
                ///< vanish exactly
  wall,         ///< as `Wall` says; mass flux vanishes exactly
  outflow,      ///< characteristic: the incoming invariant is that of `state` (the gas far away)
  fixed_state,  ///< all ghost nodes hold `state` (supersonic or prescribed inflow)
  subsonic_inflow,  ///< velocity and temperature of `state`; pressure from the wave that leaves
  reservoir,  ///< gas at rest in `state`, accelerated without loss to the face; at most sonic there
  periodic,   ///< both faces of a direction
  neighbour,  ///< another rank goes on; its nodes are the ghosts (never in a case)
};

/// A wall on a face of the domain; it may move along itself.
struct Wall {
  bool slip = false;
  double temperature = 0.0;  ///< K, 0: adiabatic
  std::array<double, 3>
      velocity{};  ///< m/s, no slip only; the component along the normal must be 0
};

/// One face of the domain.
struct Boundary {
  BoundaryKind kind = BoundaryKind::outflow;
  State state;  ///< used by outflow, inflows and reservoir
  Wall wall;
  /// Replaces `state` when set.
  std::shared_ptr<const IncomingGas> incoming;
};

/// Faces x low, x high, y low, y high, z low, z high.
using Boundaries = std::array<Boundary, 6>;

}  // namespace ocublast::flow
