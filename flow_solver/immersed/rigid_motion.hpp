#pragma once

#include <array>
#include <span>
#include <vector>

#include "flow_solver/immersed/motion_table.hpp"
#include "flow_solver/immersed/vec3.hpp"

namespace ocublast::flow {

/// Unit quaternion: scalar part, then the vector part.
struct Rotation {
  double w = 1.0;
  Vec3 v;
  [[nodiscard]] Vec3 apply(const Vec3& x) const noexcept {
    const Vec3 t = 2.0 * cross(v, x);
    return x + w * t + cross(v, t);
  }
  /// First `other`, then this.
  [[nodiscard]] Rotation after(const Rotation& other) const noexcept;
  /// By |angle| (rad) about the direction of `angle`.
  [[nodiscard]] static Rotation by(const Vec3& angle) noexcept;
};

/// Place and motion of a rigid body: a vertex X of the reference shape is at
/// center + rotation (X - reference center), moving with velocity + angular velocity x arm.
struct RigidState {
  Vec3 center;            ///< m
  Rotation rotation;      ///< from the reference shape
  Vec3 velocity;          ///< m/s, of the center
  Vec3 angular_velocity;  ///< rad/s
};

/// Positions and velocities of all vertices [n_vertices, 3].
void place_vertices(std::span<const double> reference, const Vec3& reference_center,
                    const RigidState& state, std::vector<double>& position,
                    std::vector<double>& velocity);

/// Prescribed rigid motion. Its center moves by velocity t + amplitude (1 - cos(w t)) and the
/// table's shift; it turns about a fixed direction by angular_velocity t + angle_amplitude
/// (1 - cos(w t)) and the table's angle.
struct RigidPath {
  std::array<double, 3> velocity{};         ///< m/s
  std::array<double, 3> amplitude{};        ///< m
  double angular_frequency = 0.0;           ///< 1/s, w
  std::array<double, 3> rotation_axis{};    ///< direction; zero: no rotation
  std::array<double, 3> rotation_center{};  ///< m, on the reference shape
  double angular_velocity = 0.0;            ///< rad/s
  double angle_amplitude = 0.0;             ///< rad
  MotionTable table;                        ///< may be empty
  [[nodiscard]] RigidState at(double t) const;
};

}  // namespace ocublast::flow
