#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "coupler/base/ranks.hpp"
#include "flow_solver/gas/gas.hpp"
#include "flow_solver/grid/fields.hpp"
#include "flow_solver/grid/grid.hpp"
#include "flow_solver/immersed/cut_lines.hpp"

namespace ocublast::flow {

/// Closed triangulated surface, triangles oriented outward (out of the body, into the gas).
struct BodySurface {
  std::vector<double> vertices;         ///< [n_vertices, 3], m
  std::vector<std::int32_t> triangles;  ///< [n_triangles, 3]
  /// The first 2 n_quads triangles are the halves (a, b, c), (a, c, d) of quads (a, b, c, d), over
  /// which loads are shared out bilinearly.
  std::size_t n_quads = 0;
};

enum class WallSlip { slip, no_slip };

struct Body {
  std::string name;
  BodySurface surface;
  WallSlip slip = WallSlip::slip;
  double wall_temperature = 0.0;  ///< K; 0: adiabatic
  bool moves = false;             ///< false: never moves, its geometry is searched once
};

/// Force of the gas on a body relative to ambient pressure, over its exposed surface: pressure, and
/// shear at walls without slip.
struct BodyLoad {
  std::array<double, 3> force{};        ///< N
  std::array<double, 3> shear_force{};  ///< N, the part of shear in `force`
  std::array<double, 3> moment{};       ///< N m about the origin
  double power = 0.0;                   ///< W, force density times wall velocity
  double heat = 0.0;                    ///< W into the body, at walls of given temperature
  double volume_rate = 0.0;             ///< m^3/s, volume that the exposed wall takes from the gas
  /// Sum of rho c n n^T over the area, for velocity and angular velocity about the origin, row by
  /// row [6, 6]: how much smaller force and moment would be if the wall moved faster away.
  std::array<double, 36> impedance{};
  /// The same sum of the gas's mass per area between the wall and the read nodes, whose inertia the
  /// pressure slope of an accelerated wall adds to the load.
  std::array<double, 36> added_mass{};
  double exposed_area = 0.0;       ///< m^2
  double largest_impedance = 0.0;  ///< kg/(m^2 s), rho c of the gas at the wall
};

/// Gas between the outermost fluid cells' faces and the walls: what sums over whole fluid cells
/// leave out (or count too much, then negative). Added to them it makes the gas's mass change
/// smoothly when a wall crosses nodes.
struct WallCells {
  double volume = 0.0;               ///< m^3 (m^2, m in 2-D, 1-D)
  double mass = 0.0;                 ///< kg
  std::array<double, 3> momentum{};  ///< kg m/s
  double energy = 0.0;               ///< J
};

/// What a change of topology did; printed, never silent.
struct TopologyReport {
  std::size_t fresh_nodes = 0;    ///< body nodes that became fluid
  std::size_t rebuilt_nodes = 0;  ///< of these, rebuilt because the nearest side had changed
  std::size_t blocked_segments = 0;
  std::size_t fluid_nodes = 0;  ///< nodes tagged fluid now
  double smallest_gap = 0.0;    ///< in cells, over segments between two walls; 0: none
  std::size_t open_lines = 0;   ///< grid lines on which a surface does not close; 0 or a fault
  bool renewed = true;          ///< false: no wall has moved since the last one, nothing was done
};

/// What shear and heat flux at a wall need to know of the gas.
struct WallTransport {
  double viscosity = 0.0;               ///< Pa s, constant or at the reference; 0: none
  double sutherland_reference = 0.0;    ///< K; 0: constant viscosity
  double sutherland_temperature = 0.0;  ///< K
  double prandtl = 0.71;
};

struct ImmersedOptions {
  /// Faces of the domain (x low, x high, y low, ..) that count as walls in the gap rule: a body may
  /// come to rest on them.
  std::array<bool, 6> domain_wall{};
  double gap_block = 1.0;  ///< cells; segments between walls narrower than this are body
  double smooth_below_degrees = 35.0;  ///< normals are interpolated across edges flatter than this
  WallTransport transport;
};

inline namespace OCU_PRECISION {

struct FacetReading;
/// What the gas does to the facets of a body at one time: read once, it serves all that follows
/// from it.
using WallReading = std::shared_ptr<const std::vector<FacetReading>>;

/// Bodies immersed in a Cartesian grid: tags, cut lines, ghost states, surface pressure. Works with
/// as many threads as OpenMP gives a parallel region (omp_set_num_threads); results do not depend
/// on their number. One step of the flow solver: move_to(t of the stage) and compute_ghosts(W)
/// before each stage, with the topology frozen; after the step move_to(t_end) and
/// update_topology(W).
class ImmersedBoundary {
 public:
  ImmersedBoundary(const Grid& grid, const Gas& gas, std::vector<Body> bodies,
                   const ImmersedOptions& options);
  ~ImmersedBoundary();
  ImmersedBoundary(ImmersedBoundary&&) noexcept;
  ImmersedBoundary& operator=(ImmersedBoundary&&) noexcept;

  /// Makes this one of several ranks, each of which holds a block of the nodes (`blocks`, by rank)
  /// and all bodies, which it moves as the others do. Before the first topology. Everything that
  /// takes W is collective then and gives every rank the same. The ranks outlive this.
  void share(const Ranks& ranks, std::span<const NodeBox> blocks);

  [[nodiscard]] std::size_t n_bodies() const;
  [[nodiscard]] const Body& body(std::size_t b) const;

  /// Cubic (Hermite) path of a moving body's vertices over [t_begin, t_end]: it starts from the
  /// wall state the last path ended with (the reference state at rest, the first time).
  /// [n_vertices, 3].
  void set_path(std::size_t b, double t_begin, double t_end, std::span<const double> position_end,
                std::span<const double> velocity_end);
  /// The same with straight paths between the positions (the paper's choice).
  void set_straight_path(std::size_t b, double t_begin, double t_end,
                         std::span<const double> position_end);
  /// The wall of body b as a checkpoint found it, [n_vertices, 3] each; the next path starts there.
  void restore_wall(std::size_t b, std::span<const double> position,
                    std::span<const double> velocity, std::span<const double> acceleration);
  /// Wall position, velocity and acceleration at time t; outside the path's interval its end state,
  /// at rest.
  void move_to(double t);

  /// Crossings, tags, segments and feet for the current wall; fills fresh nodes of W.
  TopologyReport update_topology(FieldsView<Real> W);
  /// Ghost states of all wall ends and the values of band nodes, from W and the current wall.
  /// Domain ghosts of W must be filled.
  void compute_ghosts(FieldsView<Real> W);

  [[nodiscard]] const CutLines& lines(int axis) const;
  [[nodiscard]] std::span<const std::uint8_t> tags() const;  ///< NodeTag [n_k, n_j, n_i]
  /// Ghost values since the start that had to fall back to the end node's own state.
  [[nodiscard]] std::uint64_t n_fallbacks() const;
  /// Largest time step [s] for which no wall moves more than half its local thickness or 0.3 cells.
  [[nodiscard]] double wall_step_limit() const;

  /// Pressure, modified by rho a_n s, and shear at the facets of body b; it must not move until the
  /// reading has been used.
  [[nodiscard]] WallReading read_wall(FieldsView<const Real> W, std::size_t b,
                                      double ambient_pressure) const;
  /// Overpressure [Pa] (p - ambient) at the vertices of body b; 0 where buried.
  void overpressure(std::size_t b, const WallReading& reading, std::span<double> at_vertices) const;
  void read_overpressure(FieldsView<const Real> W, std::size_t b, double ambient_pressure,
                         std::span<double> at_vertices) const;
  /// Forces [n, 3], N, at its vertices, of pressure and shear: see spread_forces.
  void force(std::size_t b, const WallReading& reading, std::span<double> at_vertices) const;
  void read_force(FieldsView<const Real> W, std::size_t b, double ambient_pressure,
                  std::span<double> at_vertices) const;
  /// Load on body b, integrated over the exposed part of its facets.
  [[nodiscard]] BodyLoad load(std::size_t b, const WallReading& reading) const;
  [[nodiscard]] BodyLoad load(FieldsView<const Real> W, std::size_t b,
                              double ambient_pressure) const;
  /// Tractions [Pa] of shear at the vertices of body b, [n_vertices, 3]; zero at slip walls.
  void read_shear(FieldsView<const Real> W, std::size_t b, std::span<double> at_vertices) const;
  /// Gas beside the walls that sums over whole fluid cells miss.
  [[nodiscard]] WallCells wall_cells(FieldsView<const Real> W) const;
  /// What the next topology takes over from the past beside the walls' place (feet, stencils, where
  /// they were searched): with it a resumed run goes on bit for bit. Same program version only.
  [[nodiscard]] std::vector<std::uint8_t> history() const;
  /// The same with the feet of all ranks, on the root; elsewhere nothing. Collective.
  [[nodiscard]] std::vector<std::uint8_t> whole_history() const;
  /// Puts it back, after update_topology at the walls' place of that time. Throws CaseError when it
  /// does not fit.
  void restore_history(std::span<const std::uint8_t> bytes);
  [[nodiscard]] std::span<const double> position(
      std::size_t b) const;  ///< current, [n_vertices, 3]
  [[nodiscard]] std::span<const double> acceleration(std::size_t b) const;
  [[nodiscard]] std::span<const double> velocity(std::size_t b) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace OCU_PRECISION

}  // namespace ocublast::flow
