#pragma once

// Inside of class Flow: memory, tables and masks, shared by step.cpp and its neighbours.

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "flow_solver/boundary/domain_ghosts.hpp"
#include "flow_solver/numerics/field_memory.hpp"
#include "flow_solver/numerics/kernel.hpp"
#include "flow_solver/numerics/line_table.hpp"
#include "flow_solver/numerics/muscl.hpp"
#include "flow_solver/numerics/radial.hpp"
#include "flow_solver/pass_clock.hpp"
#include "flow_solver/ranks/rank_flow.hpp"
#include "flow_solver/step.hpp"

namespace ocublast::flow::inline OCU_PRECISION {

/// A pressure ratio in the whole field above this is a fresh charge.
inline constexpr double fresh_ratio = 100.0;

/// How the lines that meet a face of this kind end.
[[nodiscard]] LineEnd line_end(BoundaryKind kind);

/// The fluid node at a wall end. Its neighbour beyond the wall is another side's gas or a body
/// node; the dilatation there takes the wall end's ghost instead.
struct WallNode {
  int i = 0, j = 0;
  int axis = 0;
  int side = 0;  ///< +1: the wall is above the node
  std::ptrdiff_t wall = 0;
};

/// Cut segments of one direction in batches of a tile, grouped by the line index c.
struct SegmentBatches {
  std::vector<SegmentBatch> batch;
  std::vector<std::size_t> begin;  ///< [n_c + 1] first batch of each c
};

struct Flow::Core {
  Core(Grid grid_in, Boundaries boundaries_in, const FlowOptions& options_in,
       const Ranks* all_ranks);

  std::unique_ptr<RankFlow> ranks;  ///< null: this process has the whole grid
  Grid grid;                        ///< of this rank, as everything below
  Boundaries boundaries;
  FlowOptions options;
  const Kernels* kernels = nullptr;
  const MusclKernels* muscl = nullptr;  ///< of the second scheme; null: compact
  const RadialKernels* radial_kernels = nullptr;
  Context ctx;                    ///< the whole grid
  Context box;                    ///< the part that is computed: ctx with shifted pointers
  std::array<int, 3> lo{}, hi{};  ///< nodes [lo, hi) of the box
  std::array<StoredTable, 3> box_table;
  void set_box(const std::array<int, 3>& new_lo, const std::array<int, 3>& new_hi);
  void refresh_box();
  /// Smallest box around all disturbed nodes, or the whole grid without the option.
  void find_box();
  /// Widens the box where a disturbance has come within the margin of its faces.
  void grow_box();
  [[nodiscard]] bool disturbed(int i, int j, int k) const;
  /// Whether gas, heat or shear other than the quiescent state's comes through a face of the
  /// domain.
  [[nodiscard]] bool face_disturbs(std::size_t face) const;
  [[nodiscard]] bool layer_disturbed(int axis, int at) const;
  PassClock clock;
  FieldMemory W, R, Q, A, G;
  std::array<StoredTable, 3> table, table_from_ghost, table_from_mirror, table_from_known;
  std::array<StoredMetric, 3> metric;
  StoredRadialMetric radial;
  StoredTable radial_table, box_radial_table;
  std::vector<FieldMemory> scratch;        ///< per thread
  std::vector<FieldMemory> plane_scratch;  ///< per thread, the x part of a plane's divergence

  std::vector<LaneBits> fluid;
  std::vector<std::uint8_t> mark, failed;
  std::array<std::vector<LaneBits>, 3> cut, line_marked;
  std::array<std::vector<Real>, 3> wall_ghost,
      wall_motion;                      ///< of the cut lines, where Real is not double
  std::vector<std::uint8_t> kept_mark;  ///< marks at the start of the step
  std::vector<Real> mark_copy;          ///< marks as numbers, for checkpoints
  std::vector<Real> box_copy;           ///< lo and hi as numbers, for checkpoints
  std::vector<PlaneMaxima> maxima;
  std::unique_ptr<BodiesInFlow> bodies;
  std::array<SegmentBatches, 3> segments;
  std::vector<std::vector<WallNode>> wall_nodes;  ///< per plane k, by rows
  /// Shape of `mark`: bit 2 axis + (0 below, 1 above) where a wall hides the neighbour on that
  /// side.
  std::vector<std::uint8_t> wall_sides;
  bool prepared = false;  ///< coefficients belong to the current state
  double convection = 0.0, fastest = 0.0, diffusion = 0.0;  ///< 1/s, see PlaneMaxima
  double p_min = 0.0, p_max = 0.0;

  void set_tables();
  void set_masks_without_bodies();
  void set_context();
  /// Masks, batches and conserved values of nodes that are or were in bodies.
  void take_topology(bool convert);
  void set_segments(int axis);
  /// A segment of the whole grid as far as it lies in this rank's block, counted there; false: it
  /// does not.
  [[nodiscard]] bool cut_to_block(int axis, Segment& segment) const;
  /// A batch of up to a tile of segments.
  [[nodiscard]] SegmentBatch batch_of(int axis, std::span<const Segment> group) const;
  /// Moves the segments of a line index c all of whose ends have ghosts from the group into batches
  /// of neighbouring lines of a tile.
  template <class Call>
  void for_batches_of_plane(const SegmentBatches& batches, const Call& call);
  void add_aligned_batches(int axis, std::vector<Segment>& group, SegmentBatches& out) const;
  void add_wall_nodes(int axis);
  /// What the ghost of a wall end adds to the central dilatation (1/s) of its node in plane k.
  [[nodiscard]] double wall_dilatation(const WallNode& node, int k) const;
  /// Dilatation, and the bulk pressure, of the wall nodes of plane k.
  void correct_dilatation(int k);
  void correct_bulk(int k, int j_begin, int j_end);  ///< of rows [j_begin, j_end)

  void store_state(int i, int j, int k, const State& s);
  [[nodiscard]] FieldsView<Real> view_of(const Block& block, bool with_bulk) const;
  void fill_padding();
  /// Domain ghosts of the primitives at the time `now`.
  void fill_ghosts();
  /// They belong to the primitives as they are: nothing has changed these since. Without ranks
  /// only.
  bool ghosts_filled = false;
  [[nodiscard]] DomainGhosts domain_ghosts() const;
  /// Whether the sweeps fill the x and y ghosts plane by plane, while the plane is in the cache:
  /// not where something else needs them before.
  [[nodiscard]] bool ghosts_with_planes() const {
    return !bodies && !ctx.nodal_stress && muscl == nullptr && box.n[2] > 1 && !ranks;
  }
  double now = 0.0;  ///< s, of the state in W
  void set_time(double t);
  /// Ghosts of scalar fields; `use` says how far, where they are another rank's nodes.
  void fill_scalars(const Block& block, std::span<const int> fields, ScalarGhosts use);
  /// Does what depends on other ranks and books the time.
  void wait_for(const std::function<void()>& others);
  [[nodiscard]] bool any_rank_has(long count);
  /// Raises the maxima of this rank to those of all.
  void share_maxima();
  // Under ranks (flow_ranks.cpp).
  /// Takes this rank's block as the grid.
  void set_ranks(const Ranks& all_ranks);
  void set_known_ends();
  /// Throws CaseError for what bodies cannot be together with under ranks.
  void require_bodies_on_ranks() const;
  /// All ghosts of the primitives; does `meanwhile` while they travel, if they travel all at once.
  void fill_ghosts_on_ranks(const std::function<void()>& meanwhile);
  [[nodiscard]] long run_stage_on_ranks();
  [[nodiscard]] long finish_on_ranks();
  /// This rank's part of the border sums across the axis, of the fluxes or of the filter.
  void sum_borders(const std::array<std::unique_ptr<BorderSums>, 3>& sums, int axis);
  /// Marks beyond the borders, and q^n there, where any rank has marks.
  void share_marks();
  void mark_beyond_borders();
  bool bulk_is_ready = false;  ///< the sweeps need not form it
  /// Calls body(scratch, plane k, rows j0, j1) for all rows of the box, in blocks of rows over all
  /// planes.
  [[nodiscard]] int rows_per_block() const;
  template <class Body>
  void for_row_blocks(const Body& body);
  /// Ghosts, artificial diffusivity and step limits of the current state.
  void prepare();
  [[nodiscard]] bool fresh_charge() const;
  /// Pressure [Pa] of the quiescent gas as kernels form it (Context::rest_pressure), for this step.
  [[nodiscard]] double rest_pressure() const;

  // Marks.
  void age_marks();
  void premark(StepReport& report);
  /// Marks fluid nodes from which gas strikes a wall.
  void premark_impacts();
  [[nodiscard]] bool jumps(int i, int j, int k) const;
  [[nodiscard]] std::size_t mark_index(int i, int j, int k) const {
    return static_cast<std::size_t>((k * ctx.n[1] + j) * ctx.tiles * tile_width + i);
  }
  void mark_failures(bool with_neighbours);
  void set_line_marks();
  [[nodiscard]] std::size_t count_marks() const;

  [[nodiscard]] bool run_stages(double t, double dt, bool repair, StepReport& report);
  /// The same of the second scheme (flow_muscl.cpp).
  [[nodiscard]] bool run_stages_muscl(double t, double dt, bool repair, StepReport& report);
  void sweep_planes_muscl();
  void set_radial(const LineTable& plain);
  /// Rate [1/s] of convection in the cells at r = 0, whose one face is (m + 1)/2 times larger
  /// against their volume than that of a slab.
  [[nodiscard]] double convection_at_axis() const;
  /// Step [s] at which both Courant numbers, on the sum over directions and along one, are kept.
  [[nodiscard]] double convective_step(double cfl, double cfl_direction) const;
  /// The kernels of a stage that every scheme has (kernel.hpp says what each does).
  struct StageKernels {
    void (*sweep_x)(const Context&, Real* scratch, int k, int g0, int g1);
    void (*sweep_y)(const Context&, Real* scratch, int k, int t0, int t1);
    void (*sweep_segments)(const Context&, Real* scratch, int axis, const SegmentBatch&,
                           const SegmentBatch* next);
    long (*update_row)(const Context&, Real* scratch, int j);
  };
  [[nodiscard]] StageKernels stage_kernels() const {
    if (muscl != nullptr)
      return {muscl->sweep_x, muscl->sweep_y, muscl->sweep_segments, muscl->update_row};
    return {radial.power > 0 ? radial_kernels->sweep_x : kernels->sweep_x, kernels->sweep_y,
            kernels->sweep_segments, kernels->update_row};
  }
  [[nodiscard]] long run_stage();
  void sweep_planes();
  /// Nodal stress of all planes.
  void compute_stress();
  void sweep_one_plane();
  /// x and y sweeps where there is only one plane: threads share its lines.
  void sweep_lines_of_plane();
  [[nodiscard]] long update_rows();
  void share_work_among_threads() const;
  [[nodiscard]] long filter_plane(Real* own, int k);
  void filter_one_plane();
  [[nodiscard]] long finish_planes();
  void restore();
  std::size_t repair_failures(bool final_state);
  [[noreturn]] void throw_failure(double t, double dt) const;
  /// Throws for the first failed node of this rank, if there is one.
  void throw_own_failure(double t, double dt) const;
};

}  // namespace ocublast::flow
