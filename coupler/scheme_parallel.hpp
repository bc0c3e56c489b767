#pragma once

#include "coupler/scheme.hpp"

namespace ocublast::coupler {

/// Pipelined: the flow does window n+1, under a wall predicted over two windows, while the solid
/// does window n under the load known at both of its ends. No load is ever extrapolated.
[[nodiscard]] std::unique_ptr<Scheme> make_parallel_explicit(Exchange& exchange,
                                                             const Settings& settings);

}  // namespace ocublast::coupler
