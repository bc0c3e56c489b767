#pragma once

#include <array>
#include <span>
#include <vector>

#include "flow_solver/immersed/immersed_boundary.hpp"
#include "flow_solver/immersed/rigid_motion.hpp"

namespace ocublast::flow {

/// Mass and its distribution.
struct MassProperties {
  double mass = 0.0;  ///< kg
  Vec3 center;        ///< m, on the reference shape
  std::array<double, 6>
      inertia{};  ///< kg m^2 about the center: xx, yy, zz, xy, yz, zx of the tensor
};

/// Those of the body inside a closed surface of uniform density [kg/m^3], exact for the polyhedron.
[[nodiscard]] MassProperties mass_of_surface(const BodySurface& surface, double density);

struct FreeBodyOptions {
  std::array<bool, 3> translates{true, true, true};
  std::array<bool, 3> rotates{true, true, true};
  Vec3 gravity;           ///< m/s^2
  Vec3 velocity;          ///< m/s, at the start
  Vec3 angular_velocity;  ///< rad/s, at the start
};

/// Rigid body carried by the gas, six degrees of freedom. Per step of the flow: `predict` gives the
/// wall's path from the known load; after the step `correct` integrates momentum and angular
/// momentum over both loads. Each load depends on the wall's own motion: it falls by the gas's
/// impedance (rho c per area) times a change of velocity, and by the mass of the gas in the first
/// cell times a change of acceleration (the pressure slope rho a_n). Both enter implicitly, so that
/// bodies far lighter than the gas they move in a step are stable too. The wall is the body: its
/// place follows the predicted velocity, which is the corrected one of the last step continued, so
/// that the surface never jumps. Second order in the step; where theta = impedance dt / mass
/// exceeds 2 the later load weighs 1 - 1 / theta, which keeps the velocity from ringing.
class FreeBody {
 public:
  FreeBody(const BodySurface& reference, const MassProperties& mass,
           const FreeBodyOptions& options);

  /// Wall at the end of a step of dt seconds, [n_vertices, 3].
  void predict(double dt, std::vector<double>& position, std::vector<double>& velocity);
  /// Takes the load at the end of that step. Before the first step: `start` with the load then.
  void correct(double dt, const BodyLoad& load);
  void start(const BodyLoad& load);

  [[nodiscard]] const RigidState& state() const { return state_; }
  [[nodiscard]] const MassProperties& mass() const { return mass_; }
  [[nodiscard]] Vec3 momentum() const { return mass_.mass * state_.velocity; }
  [[nodiscard]] Vec3 angular_momentum() const;  ///< kg m^2/s, about the center
  [[nodiscard]] double kinetic_energy() const;  ///< J

  /// Everything a resumed run needs.
  static constexpr std::size_t n_saved = 98;
  [[nodiscard]] std::array<double, n_saved> save() const;
  void restore(std::span<const double> saved);

 private:
  using Six = std::array<double, 6>;  ///< velocity and angular velocity, or force and moment
  using Matrix = std::array<double, 36>;
  [[nodiscard]] Vec3 turn_inertia(const Vec3& omega) const;
  void keep_load(const BodyLoad& load, const Six& acceleration);

  std::vector<double> reference_;
  MassProperties mass_;
  FreeBodyOptions options_;
  RigidState state_;
  Six wall_velocity_{};  ///< of the wall at the state's time
  Six wall_change_{};    ///< what the wall's velocities gain in the step under way
  Six force_{};          ///< about the center, with gravity, without the part of wall acceleration
  Matrix impedance_{};   ///< about the center
  Matrix added_mass_{};  ///< about the center
  bool started_ = false;
};

}  // namespace ocublast::flow
