#pragma once

#include <array>

namespace ocublast::flow {

/// Primitive state at a point.
struct State {
  double rho = 1.0;  ///< kg/m^3
  double u = 0.0;    ///< m/s
  double v = 0.0;    ///< m/s
  double w = 0.0;    ///< m/s
  double p = 1.0;    ///< Pa, absolute
};

enum class BoundaryKind {
  symmetry,      ///< plane of symmetry, equally a slip wall: fluxes of mass and energy vanish exactly
  no_slip_wall,  ///< adiabatic wall at rest
  outflow,       ///< characteristic: the incoming invariant is that of `state` (the gas far away)
  fixed_state,   ///< all ghost nodes hold `state` (supersonic or prescribed inflow)
  periodic,      ///< both faces of a direction
};

/// One face of the domain.
struct Boundary {
  BoundaryKind kind = BoundaryKind::outflow;
  State state;  ///< used by outflow and fixed_state
};

/// Faces x low, x high, y low, y high, z low, z high.
using Boundaries = std::array<Boundary, 6>;

}  // namespace ocublast::flow
