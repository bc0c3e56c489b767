#pragma once

#include <memory>

#include "solid_solver/step.hpp"

namespace ocublast::solid {

/// Cuts the set-up's mesh among the ranks and leaves this rank's share of everything in it: cells,
/// node lists, facets (on the rank of the cell behind them). Alone it changes nothing. The cells at
/// ties and contacts all stay on one rank. Collective; the set-up must be the same on all ranks.
/// Returns cost of the dearest rank over the mean. Throws CaseError when there are too many ranks.
double distribute(SolidSetup& setup, const Ranks& ranks);

}  // namespace ocublast::solid
