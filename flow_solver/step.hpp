#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "coupler/base/ranks.hpp"
#include "flow_solver/boundary/boundary.hpp"
#include "flow_solver/gas/gas.hpp"
#include "flow_solver/grid/fields.hpp"
#include "flow_solver/grid/grid.hpp"
#include "flow_solver/immersed/immersed_boundary.hpp"
#include "flow_solver/ranks/plane_work.hpp"

namespace ocublast::flow::inline OCU_PRECISION {

/// What a step needs of immersed bodies; ImmersedBoundary behind it in a run, simpler ones in
/// tests.
class BodiesInFlow {
 public:
  virtual ~BodiesInFlow() = default;
  virtual void move_to(double t) = 0;
  virtual void compute_ghosts(FieldsView<Real> W) = 0;
  virtual TopologyReport update_topology(FieldsView<Real> W) = 0;
  [[nodiscard]] virtual const CutLines& lines(int axis) const = 0;
  [[nodiscard]] virtual std::span<const std::uint8_t> tags() const = 0;
};

enum class Viscosity { none, constant, sutherland };
/// Compact differences of sixth or eighth order, or MUSCL-HLLC in two stages (inviscid; no filter,
/// no artificial diffusivity): the robust second-order yardstick.
enum class Scheme { compact6, compact8, muscl };
/// What switches the artificial bulk viscosity: dilatation in compression (default), or the strain
/// rate of Kawai and Lele's form (seed eq. 10).
enum class Sensor { theta_compression, strain };

/// How the artificial diffusivities act. Recommended: the bulk term as a nodal pressure on the
/// second-order dilatation, the conductivity across faces (both see the shortest waves), mu* with
/// physical viscosity only and free of trace. Paper: all of them in the nodal stress and heat flux,
/// differentiated at sixth order (seed eqs. 8 and 9 to the letter).
enum class DiffusivityForm { recommended, paper };

struct FlowOptions {
  Gas gas;
  Viscosity viscosity = Viscosity::none;
  double dynamic_viscosity = 1.716e-5;    ///< Pa s, constant, or Sutherland's at the reference T
  double sutherland_reference = 273.15;   ///< K
  double sutherland_temperature = 110.4;  ///< K
  double prandtl = 0.71;
  Scheme scheme = Scheme::compact6;
  double cfl = 1.2;            ///< on the sum over directions of (|u| + c)/h
  double cfl_direction = 0.9;  ///< on the largest (|u| + c)/h of one direction
  bool filter = true;
  /// Applies the filter's correction in proportion to the step: as much per time at any step as at
  /// the default Courant numbers, for which its parameter was chosen. Else once whole per step.
  bool filter_per_time = false;
  double filter_alpha = 0.47;
  bool artificial_diffusivity = true;
  DiffusivityForm diffusivity_form = DiffusivityForm::recommended;
  Sensor sensor = Sensor::theta_compression;
  double C_beta = 1.0;
  double C_mu = 0.002;  ///< acts with viscosity, or in the paper's form
  double C_kappa = 0.01;
  double premark_ratio = 10.0;       ///< pressure ratio of neighbours that marks both
  double premark_ratio_fresh = 4.0;  ///< the same while the field's ratio is above 100
  /// Absolute floors for a field that redoing the step cannot cure; 0: throw instead.
  double floor_density = 0.0;   ///< kg/m^3
  double floor_pressure = 0.0;  ///< Pa
  /// Computes only a box that holds every node that differs from `quiescent`, with a margin; the
  /// gas outside must be at rest in that state. The box only grows.
  bool active_box = false;
  State quiescent;
  double active_tolerance = 1e-9;  ///< relative difference that counts as disturbed
  int active_margin = 16;          ///< nodes between a disturbed one and the box's faces
  int threads = 1;
  std::array<int, 3>
      rank_blocks{};         ///< blocks along x, y, z under ranks; 0: the least area between them
  PlaneWork rank_work;       ///< what the blocks shall share equally; empty: the nodes
  bool time_passes = false;  ///< take the processor time of the parts of a step
  std::string instruction_set;  ///< "", "baseline", "avx2", "avx512"; "": best present
};

/// What `active_tolerance` is raised to at least: in single precision density, velocity and
/// temperature of gas at rest are known to a few roundings of 6e-8, and what a front radiates ahead
/// of itself is as large.
inline constexpr double least_active_tolerance = is_single ? 1e-6 : 0.0;

/// What a step did; counts are printed, never silent.
struct StepReport {
  double dt = 0.0;                 ///< s, the step taken: the wanted one, always
  int redone = 0;                  ///< times the step was started again
  std::size_t marked_nodes = 0;    ///< nodes that took first-order fluxes
  std::size_t floored_nodes = 0;   ///< nodes lifted to the absolute floors
  double active_share = 1.0;       ///< part of the nodes that was computed
  double largest_pressure = 0.0;   ///< Pa, at the start of the step
  double smallest_pressure = 0.0;  ///< Pa, at the start of the step
  TopologyReport topology;         ///< with bodies: what the end of the step changed
};

/// Integrals over the fluid nodes' cells.
struct Totals {
  double volume = 0.0;               ///< m^3 (m^2 in 2-D, m in 1-D)
  double mass = 0.0;                 ///< kg (per m in 2-D, per m^2 in 1-D)
  std::array<double, 3> momentum{};  ///< kg m/s
  double energy = 0.0;               ///< J
};

/// Part of what a bit-exact resume needs.
struct CheckpointPart {
  std::string_view name;
  std::span<Real> values;
};

/// Compressible flow on a Cartesian grid: sixth-order compact differences in flux form, RK4,
/// eighth-order implicit filter, artificial diffusivity, first-order fluxes at marked nodes.
/// All memory is taken by the constructor.
class Flow {
 public:
  /// Throws CaseError for boundaries that do not fit (one periodic face without its partner). With
  /// several ranks each one holds a block of the grid; everything that says "all" or gives a sum,
  /// maximum or step is then collective, as are the constructor, set_state, advance and
  /// fill_domain_ghosts. `ranks` outlives the flow.
  Flow(Grid grid, Boundaries boundaries, const FlowOptions& options, const Ranks* ranks = nullptr);
  ~Flow();
  Flow(Flow&&) noexcept;
  Flow& operator=(Flow&&) noexcept;

  /// The whole grid; nodes are numbered in it everywhere below, except in `marks`.
  [[nodiscard]] const Grid& grid() const;
  /// Nodes of the grid that this rank holds.
  [[nodiscard]] NodeBox owned() const;
  /// The same of every rank, by rank.
  [[nodiscard]] std::vector<NodeBox> owned_by_rank() const;
  /// Blocks along x, y, z.
  [[nodiscard]] std::array<int, 3> rank_blocks() const;
  /// Messages and bytes that this rank sends in a step without marks.
  [[nodiscard]] std::array<double, 2> rank_traffic() const;
  [[nodiscard]] const FlowOptions& options() const;
  [[nodiscard]] const Boundaries& boundaries() const;
  /// Instruction set chosen: "baseline", "avx2" or "avx512".
  [[nodiscard]] std::string_view instruction_set() const;

  /// rho, u, v, w, T at nodes and ghosts.
  [[nodiscard]] FieldsView<Real> primitives();
  [[nodiscard]] FieldsView<const Real> primitives() const;
  /// rho, rho u, rho v, rho w, E at nodes (no ghosts in y and z).
  [[nodiscard]] FieldsView<const Real> conserved() const;
  [[nodiscard]] FieldsView<Real> conserved();

  /// State of every node of this rank from a function of its position.
  void set_state(const std::function<State(double x, double y, double z)>& state);
  /// The same from a function of the node's indices (for states that integrate over cells).
  void set_state_by_index(const std::function<State(int i, int j, int k)>& state);

  /// Puts bodies into the flow: takes their tags and cut lines; null takes them out. The boundary
  /// must have been brought to the current topology with update_topology(primitives()) before.
  void immerse(ImmersedBoundary* bodies);
  void immerse(std::unique_ptr<BodiesInFlow> bodies);

  /// Time [s] of the current state, for boundaries that depend on it; `advance` moves it on.
  void set_time(double t);
  /// Largest step [s] by convection and diffusion at the current state.
  [[nodiscard]] double stable_step();
  /// One step from t to t + dt. Throws NumericsError (cell, position, time, state) for a state that
  /// redoing the step cannot cure. With bodies: their walls move along their paths, and the
  /// topology is brought to t + dt at the end.
  StepReport advance(double t, double dt);

  /// After `advance` has thrown NumericsError: brings back the state at the start of that step, at
  /// time t [s], with the marks it had.
  void roll_back(double t);
  /// Gives all faces of kind outflow this gas as the one far away. Not together with the active
  /// box.
  void set_incoming(const std::shared_ptr<const IncomingGas>& gas);

  void fill_domain_ghosts();
  [[nodiscard]] Totals totals() const;
  /// Processor seconds by pass (pass_clock.hpp) of the first thread since the start; all zero
  /// without FlowOptions::time_passes.
  [[nodiscard]] std::span<const double> pass_seconds() const;
  /// Nodes with first-order fluxes in the last step, [k, j, n_x rounded up to a tile] of this
  /// rank's block.
  [[nodiscard]] std::span<const std::uint8_t> marks() const;

  /// Everything beside the time that a resumed run needs; valid until the next step. After writing
  /// into the parts call `restored()`.
  [[nodiscard]] std::vector<CheckpointPart> checkpoint();
  void restored();

  /// The same by nodes of the whole grid, for files: mark of a node (0: none), and the active box
  /// as its first and its end nodes. After writing into primitives, conserved and marks of this
  /// rank's nodes call `restored_nodes`. Collective.
  [[nodiscard]] std::uint8_t mark(int i, int j, int k) const;
  void set_mark(int i, int j, int k, std::uint8_t mark);
  [[nodiscard]] std::array<int, 6> active_box() const;
  void restored_nodes(const std::array<int, 6>& active_box);

 private:
  struct Core;
  std::unique_ptr<Core> core_;
};

}  // namespace ocublast::flow
