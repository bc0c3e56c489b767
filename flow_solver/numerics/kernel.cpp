// All kernels of one instruction set. Compiled once per set with its own OCU_ISA and flags.

#include "flow_solver/numerics/kernel_border.hpp"
#include "flow_solver/numerics/kernel_open_end.hpp"
#include "flow_solver/numerics/kernel_segment_filter.hpp"
#include "flow_solver/numerics/kernel_stress.hpp"

namespace ocublast::flow::inline OCU_PRECISION::OCU_ISA {
namespace {

#define OCU_TEXT_OF(x) #x
#define OCU_TEXT(x) OCU_TEXT_OF(x)

std::size_t scratch_size(const Context& ctx) {
  const Index longest = (face_doubles(ctx) / (largest_face_record * tile_width)) + 16;
  const Index lines =
      face_doubles(ctx) + longest * 5 * tile_width + tile_width * node_record * tile_width;
  const Index segments = segment_doubles(ctx);
  const Index gauss_planes = (static_cast<Index>(ctx.n[1]) + 9) * 3 * ctx.R.sf + 64;
  const Index columns = column_doubles(ctx);
  Index most = lines + segments;
  if (gauss_planes > most) most = gauss_planes;
  if (columns > most) most = columns;
  const Index aligned = aligned_doubles(ctx);
  if (aligned > most) most = aligned;
  return static_cast<std::size_t>(most);
}

constexpr Kernels table{OCU_TEXT(OCU_ISA),       scratch_size,           entry<bulk_rows>,
                        entry<bulk_ghost_rows>,  entry<stress_rows>,     entry<stress_ends_y>,
                        entry<stress_ends_z>,    entry<sweep_x>,         entry<sweep_y>,
                        entry<sweep_segments>,   entry<update_row>,      entry<filter_x>,
                        entry<filter_y>,         entry<filter_segments>, entry<finish_plane>,
                        entry<restore_plane>,    entry<premark_plane>,   entry<outflow_rows>,
                        entry<outflow_columns>,  entry<theta_plane>,     entry<sensor_rows>,
                        entry<diffusivity_rows>, entry<border_flux>,     entry<border_filter>,
                        entry<filter_z>};

}  // namespace

const Kernels& kernels() noexcept {
  return table;
}

}  // namespace ocublast::flow::OCU_ISA
