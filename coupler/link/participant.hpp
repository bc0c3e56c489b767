#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "coupler/base/errors.hpp"

namespace ocublast::link {

enum class Role { flow, solid };

/// Wet surface of a solid: closed, triangles oriented outward. The load is given at its vertices.
struct InterfaceMesh {
  std::string name;
  std::vector<double> vertices;         ///< [n_vertices, 3] reference positions, m
  std::vector<std::int32_t> triangles;  ///< [n_triangles, 3]
  std::size_t n_quads =
      0;  ///< the first 2 n_quads triangles are quads (a, b, c, d), as (a, b, c), (a, c, d)
  bool takes_force = false;  ///< flow: this solid takes forces; see send_forces
  [[nodiscard]] std::size_t n_vertices() const { return vertices.size() / 3; }
};

/// How a participant finds its coupler. Filled from the environment that the coupler gives to the
/// solvers it starts (OCUBLAST_ENDPOINT, OCUBLAST_TOKEN, ...).
struct Connection {
  Role role = Role::flow;
  std::string name;             ///< which of several solids, else empty
  std::string program;          ///< name and version, for messages
  std::uint64_t case_hash = 0;  ///< CaseReader::hash(); must agree on all sides
  std::string endpoint;         ///< ipc://... or tcp://...
  std::string token;            ///< secret of this run
  std::filesystem::path keys;   ///< directory with key files of this run (tcp only), else empty
  double silence_limit = 60.0;  ///< s without word from the coupler before a wait ends in LinkError
  bool share_memory = true;     ///< ipc: payloads through shared memory where both sides can
};

/// Connection from the environment. Throws LinkError that says how to start a coupled case when the
/// environment names no coupler.
[[nodiscard]] Connection connection_from_environment(Role role, std::string program,
                                                     std::uint64_t case_hash);
/// Whether a coupler has started this program.
[[nodiscard]] bool started_by_coupler();

/// The load inside a window as the solid sees it.
enum class LoadShape {
  linear,
  constant
};  ///< from the last window's end value to this one's; or this one's
/// The wall inside a window as the flow sees it.
enum class WallPath { cubic, straight };

/// What the coupler asks next.
struct Order {
  enum class Kind { step, checkpoint, finish };
  Kind kind = Kind::step;
  std::uint64_t window = 0;  ///< 1, 2, ...
  double t_begin = 0.0;      ///< s
  double t_end = 0.0;        ///< s; both participants end the window at exactly this value
  std::uint32_t steps = 0;   ///< steps to take in the window; 0: as many as stability needs
  LoadShape load_shape = LoadShape::linear;
  WallPath wall_path = WallPath::cubic;
  /// Implicit coupling: 1, 2, ...; 0 else. At 1 the state is kept in memory before the window; from
  /// 2 on the window, answered already, is begun again from that state. Another window, a
  /// checkpoint or the end means that the last answer counts.
  std::uint32_t iteration = 0;
  bool wants_acceleration = false;  ///< solid: the report shall carry accelerations
  /// Flow: the wall has not moved since the last window. Solid: the load is exactly zero.
  /// The arrays are empty then.
  bool idle = false;
  std::span<const double> position;      ///< flow: [n,3] predicted at t_end, m
  std::span<const double> velocity;      ///< flow: [n,3] predicted at t_end, m/s
  std::span<const double> overpressure;  ///< solid: [n] at t_end, Pa
  /// Solid that takes forces, where the flow has an interface mesh of its own: [n,3] at t_end, N,
  /// instead of overpressure.
  std::span<const double> force;
  std::filesystem::path checkpoint;  ///< kind checkpoint: directory to write to (exists)
};

/// What the flow reports of one of several interfaces.
struct InterfaceBalance {
  double work = 0.0;                ///< J, done on that solid
  std::array<double, 3> impulse{};  ///< N s, given to that solid
};

/// What a participant reports of a finished window.
struct Report {
  bool idle = false;                     ///< flow: load exactly zero; solid: nothing has moved
  std::span<const double> position;      ///< solid: [n,3] at t_end, m
  std::span<const double> velocity;      ///< solid: [n,3] at t_end, m/s
  std::span<const double> acceleration;  ///< solid, where the order wants it: [n,3] at t_end, m/s^2
  std::span<const double> overpressure;  ///< flow: [n] at t_end, Pa
  std::span<const double> force;         ///< flow that sends forces, instead: [n,3] at t_end, N
  double stable_step = 0.0;              ///< s, largest step of its own it can take next
  std::uint32_t steps_taken = 0;
  double work = 0.0;  ///< J, done on the solid by the load in this window, own quadrature
  std::vector<InterfaceBalance> interfaces;  ///< flow with several solids: of each, in their order
  std::array<double, 3> impulse{};           ///< N s, given to the solid in this window
  double impedance = 0.0;  ///< kg/(m^2 s): flow: largest rho c at the wall; solid: see mass
  double mass_per_area =
      0.0;  ///< kg/m^2: solid: smallest mass per area its waves reach in a window
  double compute_seconds = 0.0;  ///< wall time spent computing this window
  std::string status;            ///< at most 200 bytes, shown in the progress line
};

/// How the wet surface moves when the run begins; the first window's prediction uses it. Spans of
/// [n,3], empty where zero (position: where it is the mesh's).
struct InitialMotion {
  std::span<const double> position;      ///< m
  std::span<const double> velocity;      ///< m/s
  std::span<const double> acceleration;  ///< m/s^2
};

/// One side of a coupled run. Every wait has a deadline; a lost or silent coupler ends in LinkError
/// that says who, when, in which window, and why.
/// Order of calls: construct; solid: send_mesh; flow: receive_mesh and, where it has an interface
/// mesh of its own, send_mesh; ready; then next() and, for each step order, send(report), for each
/// checkpoint order, checkpoint_written(); after finish, goodbye().
class Participant {
 public:
  explicit Participant(const Connection& connection);
  ~Participant();
  Participant(Participant&&) noexcept;
  Participant& operator=(Participant&&) noexcept;

  /// Solid: its wet surface. Flow: a mesh of its own for the same surface, after receive_mesh;
  /// motion and load are then given on it, and the coupler maps between both. With several solids
  /// it bears the name of the one it stands for.
  void send_mesh(const InterfaceMesh& mesh);
  /// Flow: the one solid's surface. LinkError where there are several.
  [[nodiscard]] InterfaceMesh receive_mesh();
  /// Flow: the surfaces of all solids, called by their names in the case where there are several.
  /// Orders and reports then hold the values of all, one solid after the other.
  [[nodiscard]] std::vector<InterfaceMesh> receive_meshes();
  /// Solid, before send_mesh: orders may carry forces at the vertices instead of overpressure.
  void take_forces();
  /// Flow, before ready: reports carry forces at the vertices instead of overpressure. Only where
  /// all solids take them and the flow has no mesh of its own.
  void send_forces();
  /// Set-up is done: own stable step [s], and the window and time it resumed at (0, 0.0 when
  /// fresh). The stable step is positive and finite, here and in each report.
  void ready(double stable_step, std::uint64_t window = 0, double time = 0.0,
             const InitialMotion& motion = {});  ///< motion: solid, fresh start only
  [[nodiscard]] Order next();                    ///< spans stay valid until the next call
  void send(const Report& report);
  /// Room for the values of the next report, not initialised, valid until it is sent. Values
  /// written here and named in the report need not be copied. Solid: position, velocity and, where
  /// the order wants it, acceleration; flow: overpressure or, where it sends forces, force.
  struct Room {
    std::span<double> position, velocity, acceleration, overpressure, force;
  };
  [[nodiscard]] Room room();
  void checkpoint_written();
  void goodbye();
  /// Tells the coupler why this side gives up; never throws. Called before the program ends itself.
  /// The coupler ends the run with the same exit code.
  void abort(const std::string& reason, ExitCode code = ExitCode::other) noexcept;
  /// Runs `work` (set-up, the loop over orders, the farewell). When it throws, tells the coupler
  /// why, with the exit code that belongs to the exception, and throws on.
  void guard(const std::function<void()>& work);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace ocublast::link
