#pragma once

#include "solid_solver/io/session.hpp"

namespace ocublast::solid {

/// Runs as the solid side of a coupled case until the coupler says finish. Tells the coupler why
/// when it must give up, and throws on.
void run_coupled(Session& session);

}  // namespace ocublast::solid
