#include "flow_solver/immersed/rigid_motion.hpp"

#include <cmath>

namespace ocublast::flow {

Rotation Rotation::after(const Rotation& other) const noexcept {
  Rotation r{.w = w * other.w - dot(v, other.v),
             .v = w * other.v + other.w * v + cross(v, other.v)};
  const double scale = 1.0 / std::sqrt(r.w * r.w + norm2(r.v));
  r.w *= scale;
  r.v = scale * r.v;
  return r;
}

Rotation Rotation::by(const Vec3& angle) noexcept {
  const double half = 0.5 * norm(angle);
  // sin(half) / (2 half), by its series where the quotient would lose digits.
  constexpr double small = 1e-4;
  const double share = half > small ? 0.5 * std::sin(half) / half : 0.5 - half * half / 12.0;
  return {.w = std::cos(half), .v = share * angle};
}

void place_vertices(std::span<const double> reference, const Vec3& reference_center,
                    const RigidState& state, std::vector<double>& position,
                    std::vector<double>& velocity) {
  position.resize(reference.size());
  velocity.resize(reference.size());
  for (std::size_t v = 0; v + 2 < reference.size(); v += 3) {
    const Vec3 X{{reference[v], reference[v + 1], reference[v + 2]}};
    const Vec3 arm = state.rotation.apply(X - reference_center);
    const Vec3 u = state.velocity + cross(state.angular_velocity, arm);
    for (std::size_t a = 0; a < 3; ++a) {
      position[v + a] = state.center.c[a] + arm.c[a];
      velocity[v + a] = u.c[a];
    }
  }
}

RigidState RigidPath::at(double t) const {
  const double w = angular_frequency;
  const double swing = 1.0 - std::cos(w * t);
  const double swing_rate = w * std::sin(w * t);
  const MotionTable::Point given = table.empty() ? MotionTable::Point{} : table.at(t);
  RigidState state;
  for (std::size_t a = 0; a < 3; ++a) {
    state.center.c[a] =
        rotation_center[a] + velocity[a] * t + amplitude[a] * swing + given.value[a];
    state.velocity.c[a] = velocity[a] + amplitude[a] * swing_rate + given.rate[a];
  }
  const Vec3 axis = unit(Vec3{rotation_axis});
  state.rotation =
      Rotation::by((angular_velocity * t + angle_amplitude * swing + given.value[3]) * axis);
  state.angular_velocity = (angular_velocity + angle_amplitude * swing_rate + given.rate[3]) * axis;
  return state;
}

}  // namespace ocublast::flow
