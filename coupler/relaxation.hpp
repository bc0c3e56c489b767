#pragma once

#include <memory>
#include <span>

#include "coupler/settings.hpp"

namespace ocublast::coupler {

/// Makes the next input of a fixed-point iteration x -> H(x) from an input and its residual
/// r = H(x) - x. Starts anew in each window, so that a resumed run repeats it bit for bit.
class Relaxation {
 public:
  virtual ~Relaxation() = default;
  virtual void begin_window() = 0;
  /// Replaces `x` by the next input. Both of the same length in all calls of a window.
  virtual void advance(std::span<double> x, std::span<const double> residual) = 0;
};

/// Constant factor; Aitken (Irons and Tuck 1969, in the form of Kuettler and Wall 2008, Comput.
/// Mech. 43, eq. 44), first factor as given; IQN-ILS (Degroote, Bathe, Vierendeels 2009, Comput.
/// Struct. 87): least squares over the differences of this window's iterations by QR, nearly
/// dependent columns left out, first step with the factor given.
[[nodiscard]] std::unique_ptr<Relaxation> make_relaxation(RelaxationKind kind, double factor);

}  // namespace ocublast::coupler
