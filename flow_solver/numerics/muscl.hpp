#pragma once

#include "flow_solver/numerics/kernel.hpp"

namespace ocublast::flow::inline OCU_PRECISION {

/// Kernels of the second scheme: MUSCL reconstruction of the primitives with van Leer's limiter,
/// HLLC fluxes, two stages. `Context::stage` is 0 or 1; fields as in Kernels.
struct MusclKernels {
  /// R = divergence of the fluxes along x and y of whole lines in plane k (0 on cut lines).
  void (*sweep_plane)(const Context&, Real* scratch, int k);
  /// The x part for the row groups [g0, g1), and the y part for the tiles [t0, t1) of plane 0.
  void (*sweep_x)(const Context&, Real* scratch, int k, int g0, int g1);
  void (*sweep_y)(const Context&, Real* scratch, int k, int t0, int t1);
  /// R += divergence along cut segments.
  void (*sweep_segments)(const Context&, Real* scratch, int axis, const SegmentBatch&,
                         const SegmentBatch* next);
  /// z fluxes of row j, stage update, primitives, positivity test; the new conserved state to A.
  /// Returns the number of failed nodes.
  long (*update_row)(const Context&, Real* scratch, int j);
};

namespace isa_baseline {
const MusclKernels& muscl_kernels() noexcept;
}
namespace isa_avx2 {
const MusclKernels& muscl_kernels() noexcept;
}
namespace isa_avx512 {
const MusclKernels& muscl_kernels() noexcept;
}

}  // namespace ocublast::flow
