// All kernels of one instruction set. Compiled once per set with its own OCU_ISA and flags.

#include "flow_solver/numerics/kernel_border.hpp"
#include "flow_solver/numerics/kernel_open_end.hpp"
#include "flow_solver/numerics/kernel_segment.hpp"
#include "flow_solver/numerics/kernel_stress.hpp"

namespace ocublast::flow::OCU_ISA {
namespace {

#define OCU_TEXT_OF(x) #x
#define OCU_TEXT(x) OCU_TEXT_OF(x)

std::size_t scratch_doubles(const Context& ctx) {
  const Index longest = (face_doubles(ctx) / (largest_face_record * tile_width)) + 16;
  const Index lines = face_doubles(ctx) + longest * 5 * tile_width + tile_width * node_record * tile_width;
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

constexpr Kernels table{OCU_TEXT(OCU_ISA), scratch_doubles, bulk_rows,      bulk_ghost_rows, stress_rows,
                        stress_ends_y,     stress_ends_z,     sweep_x,         sweep_y,        sweep_segments,  update_row,
                        filter_x,          filter_y,        filter_segments, finish_plane,   restore_plane,
                        premark_plane,     outflow_rows,    outflow_columns, theta_plane,     sensor_rows,    diffusivity_rows, border_flux,    border_filter,
                        filter_z};

}  // namespace

const Kernels& kernels() noexcept { return table; }

}  // namespace ocublast::flow::OCU_ISA
