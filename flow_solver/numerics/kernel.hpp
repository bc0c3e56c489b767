#pragma once

#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "flow_solver/grid/precision.hpp"
#include "flow_solver/numerics/line_table.hpp"

// The boundary between the time step and the kernels that are compiled per instruction set: plain
// data only.

namespace ocublast::flow::inline OCU_PRECISION {

/// Fields beside the primitives in the same rows.
enum StageField : int { field_bulk = 5, field_kappa = 6, field_beta = 7, field_mu = 8 };
inline constexpr int n_stage_fields = 9;
/// Fields of G: six stresses and three energy fluxes; with bodies the nine velocity gradients
/// behind.
inline constexpr int n_stresses = 9;
inline constexpr int n_gradients = 9;
/// Slope at a wall, per index inwards, of the cubic through the wall's value and the next three
/// nodes.
inline constexpr double wall_slope[4] = {-46.0 / 15.0, 15.0 / 4.0, -5.0 / 6.0, 3.0 / 20.0};
/// Nodes of one tile, lanes of one vector: a cache line.
inline constexpr int tile_width = 64 / static_cast<int>(sizeof(Real));
/// A bit per lane of a tile or row group.
using LaneBits = std::conditional_t<is_single, std::uint16_t, std::uint8_t>;
inline constexpr unsigned all_lanes = (1u << tile_width) - 1u;

/// Fields side by side in rows: data is field 0 at node (0, 0, 0).
struct Block {
  Real* data = nullptr;
  std::ptrdiff_t sf = 0, sj = 0, sk = 0;
};

/// How a lane's line ends: mirrored; at a wall of the domain whose fluxes are held
/// (line_table.hpp), without slip or with it; at open ghosts; at an immersed wall; at another
/// rank's nodes (of single lanes only: the view of such a line says domain_ghost, and its ghosts
/// are those nodes).
enum class LaneEnd : int {
  mirrored_slip,
  held_wall,
  held_slip_wall,
  domain_ghost,
  wall,
  periodic,
  neighbour
};

/// A no-slip wall at an end of the domain.
struct WallEnd {
  Real velocity[3] = {};       ///< m/s, along the wall
  double temperature = 0;      ///< K; 0: adiabatic
  double inverse_spacing = 0;  ///< 1/m, of the first cells' metric continued to the wall; signed
};

/// An end of lines that is a border between ranks: fluxes of its last faces in ascending order, for
/// the solve and for the filter, [line group, face, component, lane]; groups are numbered as in
/// Context::line_marked. Null: no such end.
struct KnownEnd {
  int flux_faces = 0, filter_faces = 0;
  const Real* flux = nullptr;
  const Real* filter = nullptr;
  const LaneBits* marked =
      nullptr;  ///< by line group: lanes whose node beyond the border is marked
};

/// Weights of nodes [first, last) in the fluxes of `faces` faces around a border
/// (border_weights.hpp): [node, face, parity class]. Those of nodes outside [near_first, near_last)
/// are the first face's times `ratio` [face, parity class].
struct BorderSum {
  int first = 0, last = 0, faces = 0;
  int near_first = 0, near_last = 0;
  const Real* weight = nullptr;
  const Real* ratio = nullptr;
  Real* out = nullptr;  ///< [line group, face, component, lane]
};

/// One direction: tables (line_table.hpp) and metric, as pointers to entry of face or node 0.
struct LineView {
  int n = 1;
  int face_begin = 0, face_end = 0;
  bool periodic = false;
  const Real* flux = nullptr;
  const Real* filter = nullptr;
  const Real* flux_wrap = nullptr;
  const Real* filter_wrap = nullptr;
  double flux_wrap_last = 0, flux_wrap_scale = 0, filter_wrap_last = 0, filter_wrap_scale = 0;
  const Real* inverse_face_spacing = nullptr;
  const Real* face_jacobian = nullptr;
  const Real* inverse_jacobian = nullptr;
  const Real* jacobian = nullptr;
  const Real* filter_inverse_jacobian =
      nullptr;  ///< that of the filter: 1/(r^m J) on a radial grid
  LaneEnd low = LaneEnd::domain_ghost, high = LaneEnd::domain_ghost;
  WallEnd wall_low, wall_high;
  KnownEnd known_low, known_high;
};

/// Metric of a radial x direction (radial.hpp), pointers to node or face 0; power 0: Cartesian.
struct RadialView {
  int power = 0;
  bool from_axis = false;      ///< whether the line starts at r = 0
  const Real* flux = nullptr;  ///< table of the solve of r^m f
  const Real* node_weight = nullptr;
  const Real* inverse_volume = nullptr;
  const Real* face_area = nullptr;
  const Real* power_over_r = nullptr;
};

/// A tile of cut segments (fewer at the end of a list) of one direction that are solved together.
struct SegmentBatch {
  int lanes = 0;         ///< used lanes; the others repeat lane 0 and are not stored
  bool aligned = false;  ///< lines of one tile, every end with ghosts, overlapping
  int length[tile_width] = {};
  int begin[tile_width] = {};  ///< first node on its line
  int b[tile_width] = {};      ///< line indices as in Segment
  int c[tile_width] = {};
  int wall_low[tile_width] = {};  ///< wall end, or -1
  int wall_high[tile_width] = {};
};

/// Everything the kernels read and write during a step.
struct Context {
  int n[3] = {1, 1, 1};
  bool present[3] = {false, false, false};
  int tiles = 1;       ///< tiles of a row
  int row_groups = 1;  ///< groups of tile_width rows of a plane
  // Extents of the mask arrays: those of the whole grid where the context covers a box of it.
  int mask_rows = 1;
  int mask_tiles = 1;
  int mask_groups = 1;
  double gamma = 1.4, gas_constant = 287.0;
  /// Single precision: the pressure [Pa] of the gas at rest, as kernels form it. Momentum fluxes
  /// hold what exceeds it: their differences lose no digits, and gas at rest stays at rest exactly.
  double rest_pressure = 0.0;
  bool nodal_stress = false;  ///< stress and heat flux at nodes join the convective fluxes
  /// Artificial diffusivities as in the paper: all of them in the nodal stress (seed eqs. 8, 9),
  /// the dilatation of the bulk term at sixth order. Else kappa* acts across faces and the bulk
  /// term on the second-order dilatation.
  bool paper = false;
  bool bulk = false;  ///< beta acts
  bool eighth_order = false;
  bool filter = true;
  double filter_strength = 1.0;  ///< part of the filter's correction that is applied
  Block W, R, Q, A, G;
  Block X;              ///< the x-lines' part of the divergence: one plane of scratch, or R itself
  bool stream = false;  ///< results that are not read soon go past the caches
  LineView line[3];
  RadialView radial;
  /// Lines for cut segments: eliminated from a wall end or a domain ghost, and from a mirrored end,
  /// long enough for every segment.
  LineView from_ghost[3], from_mirror[3];
  LineView from_known[3];  ///< from a border between ranks, whose rows hand on the value before the
                           ///< first

  EndRows flux_end, filter_end;

  // Byte masks, bit l for lane l of a tile or row group.
  const LaneBits* fluid = nullptr;  ///< [k, j, tile]: fluid nodes
  bool bodies = false;
  const LaneBits* cut[3] = {};  ///< lanes whose line is cut: x [k, group], y [k, tile], z [j, tile]
  const Real* wall_ghost[3] = {};       ///< [wall, layer, primitive]
  const Real* wall_motion[3] = {};      ///< [wall, 6]: unit normal (zero: no slip), velocity
  const LaneBits* line_marked[3] = {};  ///< same shapes as cut: lanes with a marked node
  const std::uint8_t* mark = nullptr;   ///< [k, j, tile, lane]: first-order nodes
  std::uint8_t* failed = nullptr;       ///< same shape: nodes that failed the positivity test
  bool any_mark = false;
  // Artificial diffusivity.
  double C_beta = 0, C_kappa = 0, C_mu = 0;
  bool strain_sensor = false;
  bool need_strain = false;
  double cap = 0;  ///< 1/s: nu* <= cap n_present / sum 1/h^2
  // Physical viscosity: mu = mu0 (constant) or Sutherland's; conductivity = heat_per_viscosity mu.
  double mu0 = 0, sutherland_T0 = 0, sutherland_S = 0;
  double nodal_radius[3] =
      {};  ///< spectral radius by h^2 of the nodal diffusion along each direction
  double heat_per_viscosity = 0;  ///< J/(kg K), cp over the Prandtl number
  bool sutherland = false;
  // Stage.
  int stage = 0;
  double dt = 0;
  double drop_limit = 0.05;  ///< a node fails below this part of its value one stage before
  double floor_rho = 0, floor_p = 0;
};

/// Maxima of one plane.
struct PlaneMaxima {
  double convection = 0;  ///< 1/s, sum over directions of (|u| + c)/h
  double fastest = 0;     ///< 1/s, largest (|u| + c)/h along one direction
  double diffusion = 0;   ///< 1/s, the spectral radius of the diffusive terms
  double p_min = 1e300, p_max = 0;
};

/// An open end with a constant gas far away (gamma = 1.4): density [kg/m^3], velocity [m/s],
/// temperature [K]; sign is +1 at the high end of the axis, -1 at the low one.
struct OutflowEnd {
  int axis = 0;
  double sign = 1.0;
  double rho = 0, u[3] = {}, T = 0;
  double gamma = 1.4, gas_constant = 287.0;
};

/// One set of kernels. `scratch` is a thread's own buffer of scratch_size(ctx) values.
struct Kernels {
  const char* name;
  std::size_t (*scratch_size)(const Context&);
  /// W field_bulk = -beta theta in rows [j0, j1) of plane k, with its ghosts along x.
  void (*bulk_rows)(const Context&, int k, int j0, int j1);
  /// Its ghost rows beyond the y ends of plane k.
  void (*bulk_ghost_rows)(const Context&, int k);
  /// Nodal stress and energy flux of rows [j0, j1) of plane k into G, with the ghosts of their x
  /// lines.
  void (*stress_rows)(const Context&, int k, int j0, int j1);
  /// The ghosts of the y lines of plane k.
  void (*stress_ends_y)(const Context&, int k);
  /// The ghosts of the z lines of row j.
  void (*stress_ends_z)(const Context&, int j);
  /// x-lines of row groups [g0, g1): X = divergence of the x flux (0 on cut lines).
  void (*sweep_x)(const Context&, Real* scratch, int k, int g0, int g1);
  /// y-lines of tiles [t0, t1): R = X + divergence of the y flux.
  void (*sweep_y)(const Context&, Real* scratch, int k, int t0, int t1);
  /// Divergence of the flux along cut segments: added to X for x- and y-lines (before sweep_y makes
  /// R of it), to R for z-lines. `next`: the batch that comes after, whose nodes are asked for
  /// meanwhile, or null.
  void (*sweep_segments)(const Context&, Real* scratch, int axis, const SegmentBatch&,
                         const SegmentBatch* next);
  /// z sweep of row j, Runge-Kutta update, primitives, positivity test; in the last stage the new
  /// conserved state, filtered along z, goes to A. Returns the number of failed nodes.
  long (*update_row)(const Context&, Real* scratch, int j);
  void (*filter_x)(const Context&, Real* scratch, int k, int g0, int g1);
  void (*filter_y)(const Context&, Real* scratch, int k, int t0, int t1);
  void (*filter_segments)(const Context&, Real* scratch, int axis, const SegmentBatch&);
  /// Primitives of plane k from A with the positivity test. Returns the number of failed nodes.
  long (*finish_plane)(const Context&, int k);
  /// Primitives of plane k from Q (start of a redone step).
  void (*restore_plane)(const Context&, int k);
  /// Sets `failed` where a neighbour's pressure differs by more than the ratio. Returns their
  /// number.
  long (*premark_plane)(const Context&, int k, double ratio);
  /// Four ghosts beyond `count` >= tile_width open ends that are neighbours along x, from their end
  /// nodes; the ghosts lie at multiples of `outwards` from there.
  void (*outflow_rows)(const OutflowEnd&, Real* node, std::ptrdiff_t sf, std::ptrdiff_t outwards,
                       int count);
  /// The same of `count` x-lines, sj apart; outwards +1 or -1.
  void (*outflow_columns)(const OutflowEnd&, Real* node, std::ptrdiff_t sf, std::ptrdiff_t sj,
                          int outwards, int count);
  /// Sensors: theta (and strain) into R, maxima of convection and pressure.
  void (*theta_plane)(const Context&, int k, PlaneMaxima&);
  /// Fourth differences of theta (or strain) and T in rows [j0, j1) of plane k into R.
  void (*sensor_rows)(const Context&, int k, int j0, int j1);
  /// Gaussian average, coefficients and cap in rows [j0, j1) of plane k; raises the maximum of
  /// diffusion.
  void (*diffusivity_rows)(const Context&, Real* scratch, int k, int j0, int j1, PlaneMaxima&);
  /// This rank's part of the border fluxes of line groups [g0, g1) along the axis; c is the plane
  /// (x- and y-lines) or the row (z-lines). Of the stage's fluxes, or of the filter on A.
  void (*border_flux)(const Context&, Real* scratch, int axis, const BorderSum&, int c, int g0,
                      int g1);
  void (*border_filter)(const Context&, Real* scratch, int axis, const BorderSum&, int c, int g0,
                        int g1);
  /// Filter along z of row j of A, where it is not part of the update.
  void (*filter_z)(const Context&, Real* scratch, int j);
};

namespace isa_baseline {
const Kernels& kernels() noexcept;
}
namespace isa_avx2 {
const Kernels& kernels() noexcept;
}
namespace isa_avx512 {
const Kernels& kernels() noexcept;
}

}  // namespace ocublast::flow
