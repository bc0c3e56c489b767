#pragma once

// Time stepping of the solid: central difference in the form of Bhardwaj et al. (2014) eq. 21,
//   d(n+1) = d(n) + dt v(n) + dt^2/2 a(n),  v(n+1) = v(n) + dt/2 (a(n) + a(n+1)),  a = M^-1 (f_ext
//   - f_int),
// lumped mass. Bulk viscosity and dashpots take the velocity of the half step. The trapezoidal work
// of forces balances exactly with the kinetic energy less dt^2/8 a.M a, for any forces at constant
// dt; the energy table uses this form, with the strain energy from the potentials, so its error is
// a real check.

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "solid_solver/boundary/constraint.hpp"
#include "solid_solver/boundary/contact.hpp"
#include "solid_solver/boundary/facet_pressure.hpp"
#include "solid_solver/boundary/loads.hpp"
#include "solid_solver/boundary/supports.hpp"
#include "solid_solver/elements/assembly.hpp"
#include "solid_solver/fields/nodal_state.hpp"

namespace ocublast::solid {

struct StepControl {
  enum class Rule { lanczos, element };
  Rule rule = Rule::lanczos;
  double safety = 0.9;          ///< of the critical step by Lanczos
  double element_factor = 1.0;  ///< of the elements' own steps, rule element
  int lanczos_products = 20;
  int check_every = 200;       ///< steps between looks at the current configuration
  double shrink_limit = 0.05;  ///< relative change of the elements' step that renews the estimate
  int renew_every = 1000;      ///< steps after which it is renewed anyway: laws may stiffen
  bool sleep = true;           ///< skip windows in which nothing can move
  /// Interface loads up to this do not wake a body at rest, Pa: they are left out, as if zero,
  /// until something else wakes it. 0: exact. What that costs is counted
  /// (RunningSums::ignored_impulse).
  double quiet_overpressure = 0.0;
  double energy_error_limit = 0.05;  ///< of the peak energy; beyond it the run stops
};

/// A pressure on a surface by schedule, uniform or one for each facet.
struct PressureLoad {
  std::vector<Facet> facets;
  Schedule pressure;               ///< Pa over ambient
  bool by_facet = false;           ///< then, instead:
  std::vector<Schedule> of_facet;  ///< [facets] Pa over ambient
};

/// Nodes of one surface tied to the facets of another.
struct TieKeys {
  std::vector<std::int32_t> nodes;
  std::vector<Facet> facets;
  double reach = 0.0;  ///< m
};
/// Nodes that slide in a plane.
struct PlaneKeys {
  std::vector<std::int32_t> nodes;
  std::array<double, 3> normal{};
};

struct SolidSetup {
  std::shared_ptr<const SolidMesh> mesh;
  /// This rank's part, to which the mesh and all lists of nodes and facets belong (see distribute);
  /// null where the body is whole. With it, what a SolidRun does is collective.
  std::shared_ptr<const MeshPart> part;
  std::vector<Material> materials;
  std::vector<std::int32_t> material_of_tissue;
  AssemblyOptions assembly;
  StepControl control;
  std::vector<FixedNodes> fixed;
  std::vector<PrescribedNodes> prescribed;
  std::vector<SpringSet> springs;
  std::vector<PressureLoad> pressures;
  std::vector<BodyLoad> body_loads;
  std::vector<NodeLoad> node_loads;
  double mass_damping = 0.0;  ///< 1/s
  std::vector<WallKeys> walls;
  std::vector<ContactKeys> contacts;
  std::vector<TieKeys> ties;
  std::vector<PlaneKeys> planes;
  std::vector<Facet> interface;  ///< coupled surface; empty when there is none
};

/// The load on the interface in a window.
enum class InterfaceLoad { none, linear, constant };

/// A time window and the load in it.
struct Window {
  double t_begin = 0.0;     ///< s
  double t_end = 0.0;       ///< s; the window ends at exactly this value
  std::uint32_t steps = 0;  ///< 0: as many as stability needs
  InterfaceLoad shape = InterfaceLoad::none;
  std::span<const double> overpressure;  ///< [interface nodes] at t_end, Pa; empty: zero
  std::span<const double> force;  ///< [interface nodes, 3] at t_end, N, instead of the overpressure
};

struct WindowResult {
  bool idle = false;  ///< nothing has moved, nothing was computed
  std::uint32_t steps = 0;
  double interface_work = 0.0;                ///< J, by the interface load, trapezoid in the step
  std::array<double, 3> interface_impulse{};  ///< N s
};

/// J, all since the start.
struct EnergyTable {
  double kinetic = 0.0;  ///< 1/2 v.M v
  double kinetic_scheme =
      0.0;                ///< what the scheme conserves instead: kinetic - dt^2/8 a.M a + its jumps
  double internal = 0.0;  ///< strain energy of the laws
  double hourglass = 0.0;   ///< stored in hourglass stiffness
  double relaxation = 0.0;  ///< work on rate-dependent stress (viscoelastic: negative)
  double viscous = 0.0;     ///< dissipated by bulk viscosity
  double spring = 0.0;      ///< stored in springs to ground
  double damping = 0.0;     ///< dissipated by dashpots
  double external = 0.0;    ///< work of all loads and prescribed motions
  double coupling = 0.0;    ///< the part of it by the interface load
  double initial = 0.0;     ///< kinetic energy given at the start
  double error = 0.0;       ///< (sum of what is there - external - initial) / peak
};

/// Sums of a run that belong to its state.
struct RunningSums {
  double viscous = 0.0;
  double relaxation = 0.0;
  double stored = 0.0;  ///< J, in forces on nodes now
  double damping = 0.0;
  double external = 0.0;
  double initial = 0.0;
  double scheme_jumps = 0.0;  ///< J, change of dt^2/8 a.M a by changes of dt and by loads that jump
  double last_step = 0.0;     ///< s
  double peak_energy = 0.0;   ///< J
  double steps = 0.0;
  double steps_slept = 0.0;       ///< steps not taken while asleep
  double coupling = 0.0;          ///< J, part of external
  double ignored_pressure = 0.0;  ///< Pa, largest interface load left out while asleep
  /// Pa s: largest load times duration of those windows. The speed they would have given is below
  /// this over the least mass per area.
  double ignored_impulse = 0.0;
};

class SolidRun {
 public:
  /// Throws NumericsError when no stable step can be found.
  explicit SolidRun(SolidSetup setup);

  /// Adds a velocity (m/s) to a node before the start.
  void set_velocity(std::int32_t node, const std::array<double, 3>& velocity);
  /// Finds the equilibrium of the loads as they are at the start (intra-ocular pressure, gravity)
  /// by dynamic relaxation with kinetic damping: velocities are taken away whenever the kinetic
  /// energy has passed a peak, until the residual is below `tolerance` times the loads. Rate-
  /// dependent stress relaxes fully. Loads act at once, so the body first overshoots as if they
  /// were twice as large. Before the first window; time does not advance. Throws
  /// NumericsError after `most_steps` steps.
  struct Relaxed {
    std::size_t steps = 0;
    double residual = 0.0;  ///< over the loads, root mean square
  };
  Relaxed relax(double tolerance, std::size_t most_steps);
  /// Advances over a window. Throws NumericsError with element, place, tissue and time when an
  /// element inverts.
  WindowResult advance(const Window& window);

  /// Largest step the scheme may take now, s, safety included.
  [[nodiscard]] double stable_step() const { return stable_step_; }
  /// Largest frequency found last, rad/s (0 with the element rule).
  [[nodiscard]] double largest_omega() const { return omega_; }
  [[nodiscard]] const NodalState& state() const { return state_; }
  [[nodiscard]] Assembly& assembly() { return *assembly_; }
  [[nodiscard]] const SolidMesh& mesh() const { return *setup_.mesh; }
  /// Mass that moves with each node, kg: its own, with that of nodes tied to it.
  [[nodiscard]] const std::vector<double>& nodal_mass() const { return mass_; }
  /// What the case put on nodes, in the order body loads, node loads, springs, walls, contacts,
  /// mass damping.
  [[nodiscard]] const std::vector<std::unique_ptr<NodalForce>>& forces() const { return forces_; }
  [[nodiscard]] const std::vector<std::unique_ptr<Constraint>>& constraints() const {
    return constraints_;
  }
  [[nodiscard]] bool awake() const { return awake_; }
  [[nodiscard]] const RunningSums& sums() const { return sums_; }
  /// Nodes of the coupled surface, in the order of loads.
  [[nodiscard]] const std::vector<std::int32_t>& interface_nodes() const;
  /// Solid mass per area that waves reach within `window` s, smallest over the interface, kg/m^2:
  /// min(nodal mass / area + rho c window, mass of the body / area of the interface). Collective.
  [[nodiscard]] double mass_per_area(double window) const;

  /// Energy table; `cells` are the results of Assembly::evaluate at the current state. Remembers
  /// the peak. Throws NumericsError when the error passes the limit.
  EnergyTable compute_energies(const CellResults& cells);
  /// Linear (0-2, N s) and angular momentum about the origin (3-5, N m s).
  [[nodiscard]] std::array<double, 6> momenta() const;
  /// The other ranks. Energies, momenta and reports are of the whole body.
  [[nodiscard]] const Team& team() const { return assembly_->team(); }
  /// The element whose own rule gives the smallest step, of all ranks, in words (on the root, with
  /// several ranks), and its passage time.
  struct SmallestElement {
    double step = 0.0;     ///< s, by the element's rule
    double transit = 0.0;  ///< length / sound speed, s
    std::string place;
  };
  [[nodiscard]] SmallestElement smallest_element() const;

  /// Everything a resumed run needs, as named arrays: same bits afterwards.
  struct NamedArray {
    std::string name;
    std::span<double> values;
    const char* units;
  };
  [[nodiscard]] std::vector<NamedArray> checkpoint_arrays();
  /// After the arrays were filled: time and flags from them.
  void restored();

 private:
  struct Load {
    FollowerPressure surface;
    Schedule schedule;
    std::unique_ptr<FacetPressure> by_facet;  ///< instead of the schedule
    bool coupled = false;
    std::vector<double> pressure;  ///< [nodes] now, Pa
    std::vector<double> forces;    ///< [nodes, 3] now, N
    std::vector<double> last_end;  ///< coupled: [nodes] at the end of the last window, Pa
    std::vector<double>
        force_begin;  ///< coupled, given forces: [nodes, 3] at the window's begin, N
  };
  struct StepTimes {
    double t_old;
    double t_new;
    double dt;
  };

  void build_loads();
  void build_forces();
  void build_contacts();
  void build_constraints();
  void build_inverse_mass();
  void build_interface_inertia();
  [[nodiscard]] StepBound element_step() const;
  [[nodiscard]] double find_damping_ratio() const;
  void renew_stable_step();
  void look_at_configuration();
  [[nodiscard]] bool disturbed(const Window& window) const;
  [[nodiscard]] double largest_interface_load(const Window& window) const;
  [[nodiscard]] bool quiet(const Load& load, const Window& window) const;
  void begin_window(const Window& window);
  [[nodiscard]] std::uint32_t choose_steps(const Window& window) const;
  void set_pressure(Load& load, const Window& window, double t);
  void set_forces(Load& load, const Window& window, double t);
  void predict(const StepTimes& times);
  void impose_prescribed(const StepTimes& times);
  void apply_loads(const Window& window, const StepTimes& times, WindowResult& result,
                   std::span<double> residual);
  void add_partial(const std::function<void(std::span<double>)>& add);
  void apply_forces(const StepTimes& times);
  void reduce_residual();
  void expand(AlignedVector<double>& field) const;
  void start(const Window& window);
  void correct(double dt);
  void finish_prescribed(const StepTimes& times);
  void note_step_change(double dt);
  [[nodiscard]] double residual_square() const;
  void refresh_acceleration();
  void check_inverted(bool bad, double time) const;
  [[noreturn]] void report_inverted(double time) const;

  SolidSetup setup_;
  std::unique_ptr<Assembly> assembly_;
  NodalState state_;
  AlignedVector<double> residual_;      ///< [n, 4] f_int - f_ext, N
  AlignedVector<double> inverse_mass_;  ///< [n, 4], 0 where fixed or prescribed
  std::vector<Load> loads_;
  std::vector<double> mass_;  ///< [n] kg
  std::vector<std::unique_ptr<NodalForce>> forces_;
  std::vector<std::unique_ptr<Constraint>> constraints_;
  std::vector<std::vector<double>> prescribed_residual_;  ///< per set [nodes], N
  std::vector<std::pair<double, double>>
      interface_inertia_;            ///< per interface node: mass/area kg/m^2, rho c kg/(m^2 s)
  double body_mass_per_area_ = 0.0;  ///< kg/m^2
  bool coupled_ = false;             ///< some rank has facets of the interface
  double stable_step_ = 0.0;
  double omega_ = 0.0;
  double element_step_ = 0.0;  ///< by the elements' rule when the step was found, s
  int steps_since_look_ = 0;
  int steps_since_renewal_ = 0;
  bool awake_ = false;
  bool started_ = false;  ///< the accelerations are those of the loads
  RunningSums sums_;
  std::vector<double> flags_;  ///< time, awake, steps since look, stable step, element step, omega
                               ///< and steps since it was found: for checkpoints
};

}  // namespace ocublast::solid
