// One step of the second scheme: two stages of MUSCL-HLLC sweeps. Ghosts, bodies, marks and
// redone steps are those of the compact schemes.

#include <omp.h>

#include <algorithm>
#include <cmath>

#include "flow_solver/flow_core.hpp"

namespace ocublast::flow::inline OCU_PRECISION {

void Flow::Core::sweep_planes_muscl() {
#pragma omp parallel num_threads(options.threads)
  {
    Real* own = scratch[static_cast<std::size_t>(omp_get_thread_num())].data();
#pragma omp for schedule(static)
    for (int k = 0; k < box.n[2]; ++k) {
      muscl->sweep_plane(box, own, k);
      for (int axis = 0; axis < 2; ++axis) {
        const SegmentBatches& s = segments[static_cast<std::size_t>(axis)];
        if (s.begin.empty()) continue;
        const auto c = static_cast<std::size_t>(k);
        for (std::size_t b = s.begin[c]; b < s.begin[c + 1]; ++b) {
          muscl->sweep_segments(box, own, axis, s.batch[b], nullptr);
        }
      }
    }
  }
}

bool Flow::Core::run_stages_muscl(double t, double dt, bool repair, StepReport& report) {
  ctx.dt = dt;
  for (int stage = 0; stage < 2; ++stage) {
    ctx.stage = stage;
    now = t + stage * (ctx.any_mark ? dt : 0.5 * dt);
    fill_ghosts();
    if (bodies) {  // only band nodes change, and no stencil reads the domain ghosts beside those
      bodies->move_to(now);
      bodies->compute_ghosts({ctx.W.data, ctx.W.sf, ctx.W.sj, ctx.W.sk});
    }
    refresh_box();
    ghosts_filled = false;
    if (box.n[2] > 1)
      sweep_planes_muscl();
    else
      sweep_lines_of_plane();
    if (update_rows() == 0) continue;
    if (!repair) return false;
    report.floored_nodes += repair_failures(true);
  }
  return true;
}

// A first-order step of the cell at r = 0 beside a vacuum keeps its energy positive up to a Courant
// number (with the area (m + 1)/2 per volume) of 0.72: mass and energy leave by it, momentum arises
// from p A.
constexpr double axis_margin = 1.35;

double Flow::Core::convection_at_axis() const {
  if (radial.power == 0 || grid.axis[0].min > 0.0 || lo[0] > 0) return 0.0;
  double worst = 0.0;
  const Block& w = ctx.W;
  for (int j = lo[1]; j < hi[1]; ++j) {
    const Real* at = w.data + j * w.sj;
    // The flux between the first two cells moves with the faster of them.
    double along = 0.0, across = 0.0;
    for (int i = 0; i < 2; ++i) {
      const double c = sound_speed(options.gas, at[i + 4 * w.sf]);
      along = std::max(along, std::abs(at[i + w.sf]) + c);
      across = std::max(across, std::abs(at[i + 2 * w.sf]) + c);
    }
    double rate = axis_margin * 0.5 * (radial.power + 1) * along / grid.axis[0].h(0);
    if (grid.axis[1].present) rate += across / grid.axis[1].h(j);
    worst = std::max(worst, rate);
  }
  return worst;
}

}  // namespace ocublast::flow
