#pragma once

#include "coupler/scheme.hpp"

namespace ocublast::coupler {

/// Gauss-Seidel: flow under the wall x_k, solid under its load, until the solid's answer is x_k
/// again. Both begin the window anew in each iteration. The unknown is position and window x
/// velocity together; the first guess is the predictor's.
[[nodiscard]] std::unique_ptr<Scheme> make_serial_implicit(Exchange& exchange,
                                                           const Settings& settings);

/// Jacobi: both at once, under the motion and the load of the last iteration; the unknown is both,
/// each scaled by its size in the first iteration.
[[nodiscard]] std::unique_ptr<Scheme> make_parallel_implicit(Exchange& exchange,
                                                             const Settings& settings);

}  // namespace ocublast::coupler
