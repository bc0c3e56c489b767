#pragma once

#include <spdlog/spdlog.h>

#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "coupler/base/command_line.hpp"
#include "coupler/link/participant.hpp"
#include "flow_solver/grid/precision.hpp"
#include "flow_solver/io/body_motions.hpp"
#include "flow_solver/io/charge_start.hpp"
#include "flow_solver/io/checkpoint.hpp"
#include "flow_solver/io/field_output.hpp"
#include "flow_solver/io/flow_case.hpp"
#include "flow_solver/io/wall_balance.hpp"

namespace ocublast::flow::inline OCU_PRECISION {

/// A quantity of the start: what a burst or charge brought to the grid.
struct StartQuantity {
  std::string name;
  double value = 0.0;
  std::string unit;
};

/// Builds the state of the gas at the start: uniform or Riemann, then the bursts, then the charges
/// inside the grid. Returns what came with them.
std::vector<StartQuantity> apply_initial_state(const FlowCase& flow_case,
                                               const ChargeStart& charges, Flow& flow);

/// One run of the flow solver: set-up, steps, output. Alone or as a participant.
class FlowRun {
 public:
  /// `coupled_surfaces`: the wet surfaces that the solids sent, one for each coupled body.
  /// `ranks` outlives the run; all of them make it and run it together, the root alone writes.
  FlowRun(const Ranks& ranks, FlowCase flow_case, const CommandLine& line,
          std::shared_ptr<spdlog::logger> log,
          std::span<const link::InterfaceMesh> coupled_surfaces);

  /// Runs to the end of time; a signal ends it early with a checkpoint. Whether the end was
  /// reached.
  [[nodiscard]] bool run_alone();
  /// Serves a coupler until it says finish. The root's rank knows it; elsewhere null.
  /// `forces_taken`: all solids take forces at the vertices that they sent.
  void run_coupled(link::Participant* coupler, bool forces_taken);

 private:
  void step_to(double t_end);
  void write_step();
  void keep_state();
  void rewind();
  void after_step();
  void write_outputs(bool last);
  void write_globals(const StepReport& report);
  void start_bodies(bool resumed);
  void read_loads();
  /// Motions and balances of the bodies.
  [[nodiscard]] std::vector<double> save_bodies() const;
  void restore_bodies(std::span<const double> saved);
  [[nodiscard]] double stable_step();
  link::Report finish_window(const link::Order& order);
  void place_surface_probes();
  void sample_surface_probes();
  void save(const std::filesystem::path& directory);
  [[nodiscard]] std::string save_last_good();
  void write_summary();
  void show_progress(bool last);
  void open_globals(double resume_time);
  void keep_sums();
  void restore_sums();
  [[nodiscard]] std::span<const std::uint8_t> tags() const;
  [[nodiscard]] std::string status() const;

  const Ranks* ranks_;
  FlowCase case_;
  std::filesystem::path out_;
  std::shared_ptr<spdlog::logger> log_;
  bool quiet_ = false;
  Flow flow_;
  std::unique_ptr<ImmersedBoundary> bodies_;
  std::unique_ptr<BodyMotions> motions_;
  std::unique_ptr<WallBalance> balance_;
  Totals totals_;                      ///< of the gas after the last step
  std::vector<WallReading> readings_;  ///< per body, at the current time
  std::vector<BodyLoad> loads_;        ///< the same
  Probes probes_;
  FieldOutput fields_;
  InterfaceOutput surfaces_;
  BackgroundWriter writer_{std::size_t{256} << 20};  ///< ends before those whose frames it writes
  RunClock clock_;
  std::ofstream globals_;
  /// A body that a solid moves, and its vertices among those of all such bodies.
  struct CoupledBody {
    std::size_t body = 0;
    std::size_t first = 0, count = 0;
  };
  std::vector<CoupledBody> coupled_bodies_;  ///< in the order of FlowCase::solids
  std::vector<double> overpressure_;         ///< Pa, at the vertices of the coupled bodies
  void find_coupled_bodies();
  std::vector<double> force_;  ///< N, [n, 3] at the same vertices, where forces are sent
  void move_coupled_bodies(const link::Order& order);
  [[nodiscard]] link::Order await_order(link::Participant* coupler);
  std::vector<double> ordered_position_, ordered_velocity_;  ///< of an order from another rank
  std::vector<StartQuantity> start_quantities_;
  std::shared_ptr<IncidentWaves> incident_;  ///< null: no wave from outside
  void start_gas(bool resumed);
  struct SurfacePlace {
    std::size_t body = 0;
    std::size_t vertex = 0;
  };
  std::vector<SurfacePlace> surface_places_;
  std::vector<double> surface_times_;    ///< s
  std::vector<double> surface_history_;  ///< Pa, [n_times, n_probes]

  // Running sums and maxima; kept in clock_.sums across a resume.
  struct Sums {
    /// Of a coupled body.
    struct Wall {
      double peak = 0.0;              ///< Pa, largest overpressure
      double peak_time = 0.0;         ///< s
      double power = 0.0;             ///< W, at the end of the last window
      std::array<double, 3> force{};  ///< N, then
    };
    std::vector<Wall> walls;
    double cells = 0.0;  ///< node updates computed
    double redone = 0.0;
    double marked = 0.0;
    double floored = 0.0;
    double active_sum = 0.0;
  } sums_;
  StepReport last_report_;

  /// The state at the beginning of a window of implicit coupling, which is done several times.
  struct Kept {
    std::vector<std::vector<Real>> parts;  ///< of Flow::checkpoint
    struct Wall {
      std::vector<double> position, velocity, acceleration;
    };
    std::vector<Wall> walls;
    std::vector<std::uint8_t> history;
    std::vector<double> bodies;  ///< motions and balances
    double time = 0.0;
    std::int64_t step = 0, window = 0;
    Sums sums;
  } kept_;
  bool iterating_ = false;  ///< output waits until the window counts
  bool output_waits_ = false;
  double compute_seconds_ = 0.0;
  double output_seconds_ = 0.0;
  double setup_seconds_ = 0.0;
  double progress_shown_ = -1.0;
  double wall_start_ = 0.0;
  std::size_t fluid_nodes_ = 0;
};

/// The whole program: command line to exit code.
int run_flow_solver(int argc, char** argv);

}  // namespace ocublast::flow
