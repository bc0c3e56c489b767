#include "flow_solver/immersed/free_body.hpp"

#include <Eigen/Dense>
#include <algorithm>

#include "coupler/base/errors.hpp"

namespace ocublast::flow {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

Eigen::Matrix3d tensor(const std::array<double, 6>& i) {
  Eigen::Matrix3d t;
  t << i[0], i[3], i[5], i[3], i[1], i[4], i[5], i[4], i[2];
  return t;
}

Eigen::Matrix3d matrix(const Rotation& r) {
  return Eigen::Quaterniond(r.w, r.v[0], r.v[1], r.v[2]).toRotationMatrix();
}

Eigen::Vector3d vector(const Vec3& x) {
  return {x[0], x[1], x[2]};
}
Vec3 vec3(const Eigen::Vector3d& x) {
  return {{x[0], x[1], x[2]}};
}

/// Matrix of x -> a cross x.
Eigen::Matrix3d cross_matrix(const Vec3& a) {
  Eigen::Matrix3d m;
  m << 0, -a[2], a[1], a[2], 0, -a[0], -a[1], a[0], 0;
  return m;
}

Matrix6 mass_matrix(const MassProperties& mass, const Rotation& rotation) {
  Matrix6 M = Matrix6::Zero();
  M.topLeftCorner<3, 3>() = mass.mass * Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d R = matrix(rotation);
  M.bottomRightCorner<3, 3>() = R * tensor(mass.inertia) * R.transpose();
  return M;
}

/// Weight of the load at the step's end: trapezoidal rule, more where the gas stops the body within
/// the step.
double later_weight(const Matrix6& M, const Matrix6& K, double dt) {
  double theta = 0.0;
  for (int a = 0; a < 6; ++a) theta = std::max(theta, dt * K(a, a) / M(a, a));
  return theta > 2.0 ? 1.0 - 1.0 / theta : 0.5;
}

/// Solves A x = f in the free directions; x = 0 in the others.
Vector6 solve_free(const FreeBodyOptions& options, Matrix6 A, Vector6 f) {
  for (int a = 0; a < 6; ++a) {
    const bool free = a < 3 ? options.translates[static_cast<std::size_t>(a)]
                            : options.rotates[static_cast<std::size_t>(a - 3)];
    if (free) continue;
    A.row(a).setZero();
    A.col(a).setZero();
    A(a, a) = 1.0;
    f[a] = 0.0;
  }
  return A.partialPivLu().solve(f);
}

/// A load's matrix (impedance, added mass), given about the origin, about another center.
Matrix6 about(const std::array<double, 36>& given, const Vec3& center) {
  const Matrix6 about_origin = Eigen::Map<const Matrix6>(given.data());
  Matrix6 shift = Matrix6::Identity();
  shift.topRightCorner<3, 3>() = cross_matrix(center);  // v of the origin = v + center x omega
  return shift.transpose() * about_origin * shift;
}

}  // namespace

MassProperties mass_of_surface(const BodySurface& surface, double density) {
  // Sums over the tetrahedra between the first vertex and each facet; second moments of a
  // tetrahedron with one corner at the origin: V/20 (sum x_i x_j + s_i s_j), s the sum of the other
  // corners.
  const Vec3 origin = row(surface.vertices, surface.triangles.front());
  double volume = 0.0;
  Vec3 first;
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
  for (std::size_t f = 0; f < surface.triangles.size(); f += 3) {
    const Vec3 a = row(surface.vertices, surface.triangles[f]) - origin;
    const Vec3 b = row(surface.vertices, surface.triangles[f + 1]) - origin;
    const Vec3 c = row(surface.vertices, surface.triangles[f + 2]) - origin;
    const double v = dot(a, cross(b, c)) / 6.0;
    const Vec3 s = a + b + c;
    volume += v;
    first = first + 0.25 * v * s;
    for (const Vec3& x : {a, b, c, s}) second += v / 20.0 * vector(x) * vector(x).transpose();
  }
  if (volume < 0.0) {
    volume = -volume;
    first = -1.0 * first;
    second = -second;
  }
  const Vec3 arm = (1.0 / volume) * first;
  second -= volume * vector(arm) * vector(arm).transpose();
  const Eigen::Matrix3d i = density * (second.trace() * Eigen::Matrix3d::Identity() - second);
  return {.mass = density * volume,
          .center = origin + arm,
          .inertia = {i(0, 0), i(1, 1), i(2, 2), i(0, 1), i(1, 2), i(2, 0)}};
}

FreeBody::FreeBody(const BodySurface& reference, const MassProperties& mass,
                   const FreeBodyOptions& options)
    : reference_(reference.vertices), mass_(mass), options_(options) {
  state_.center = mass.center;
  for (std::size_t a = 0; a < 3; ++a) {
    if (options.translates[a]) state_.velocity.c[a] = options.velocity.c[a];
    if (options.rotates[a]) state_.angular_velocity.c[a] = options.angular_velocity.c[a];
    wall_velocity_[a] = state_.velocity.c[a];
    wall_velocity_[3 + a] = state_.angular_velocity.c[a];
  }
}

Vec3 FreeBody::turn_inertia(const Vec3& omega) const {
  const Eigen::Matrix3d R = matrix(state_.rotation);
  return vec3(R * tensor(mass_.inertia) * R.transpose() * vector(omega));
}

Vec3 FreeBody::angular_momentum() const {
  return turn_inertia(state_.angular_velocity);
}

double FreeBody::kinetic_energy() const {
  return 0.5 *
         (mass_.mass * norm2(state_.velocity) + dot(state_.angular_velocity, angular_momentum()));
}

void FreeBody::keep_load(const BodyLoad& load, const Six& acceleration) {
  const Vec3 force = Vec3{load.force} + mass_.mass * options_.gravity;
  const Vec3 moment = Vec3{load.moment} - cross(state_.center, Vec3{load.force});
  for (std::size_t a = 0; a < 3; ++a) {
    force_[a] = force.c[a];
    force_[3 + a] = moment.c[a];
  }
  Eigen::Map<Matrix6>(impedance_.data()) = about(load.impedance, state_.center);
  Eigen::Map<Matrix6> added(added_mass_.data());
  added = about(load.added_mass, state_.center);
  Eigen::Map<Vector6>(force_.data()) += added * Eigen::Map<const Vector6>(acceleration.data());
}

void FreeBody::start(const BodyLoad& load) {
  keep_load(load, Six{});
  started_ = true;
}

void FreeBody::predict(double dt, std::vector<double>& position, std::vector<double>& velocity) {
  OCU_ASSERT(started_);
  const Matrix6 M = mass_matrix(mass_, state_.rotation);
  const Matrix6 K = Eigen::Map<const Matrix6>(impedance_.data());
  const Matrix6 added = Eigen::Map<const Matrix6>(added_mass_.data());
  Vector6 force = Eigen::Map<const Vector6>(force_.data());
  const Vec3 gyration = cross(state_.angular_velocity, angular_momentum());
  for (int a = 0; a < 3; ++a) force[3 + a] -= gyration[a];
  const double w = later_weight(M, K, dt);
  const Vector6 change = solve_free(options_, M + added + w * dt * K, dt * force);
  RigidState wall = state_;
  Vec3 mean_velocity, mean_turn;
  for (std::size_t a = 0; a < 3; ++a) {
    wall.velocity.c[a] += change[static_cast<Eigen::Index>(a)];
    wall.angular_velocity.c[a] += change[static_cast<Eigen::Index>(3 + a)];
    wall_change_[a] = wall.velocity.c[a] - wall_velocity_[a];
    wall_change_[3 + a] = wall.angular_velocity.c[a] - wall_velocity_[3 + a];
    mean_velocity.c[a] = wall_velocity_[a] + 0.5 * wall_change_[a];
    mean_turn.c[a] = wall_velocity_[3 + a] + 0.5 * wall_change_[3 + a];
  }
  wall.center = state_.center + dt * mean_velocity;
  wall.rotation = Rotation::by(dt * mean_turn).after(state_.rotation);
  place_vertices(reference_, mass_.center, wall, position, velocity);
}

void FreeBody::correct(double dt, const BodyLoad& load) {
  const Vector6 before = Eigen::Map<const Vector6>(force_.data());
  const Vec3 L = angular_momentum();
  Vec3 mean_velocity, mean_turn;
  Six acceleration{};
  Vector6 V_before, V_wall;
  for (std::size_t a = 0; a < 3; ++a) {
    mean_velocity.c[a] = wall_velocity_[a] + 0.5 * wall_change_[a];
    mean_turn.c[a] = wall_velocity_[3 + a] + 0.5 * wall_change_[3 + a];
    V_before[static_cast<Eigen::Index>(a)] = state_.velocity.c[a];
    V_before[static_cast<Eigen::Index>(3 + a)] = state_.angular_velocity.c[a];
  }
  for (std::size_t a = 0; a < 6; ++a) {
    acceleration[a] = wall_change_[a] / dt;
    wall_velocity_[a] += wall_change_[a];
    V_wall[static_cast<Eigen::Index>(a)] = wall_velocity_[a];
  }
  state_.center = state_.center + dt * mean_velocity;
  state_.rotation = Rotation::by(dt * mean_turn).after(state_.rotation);
  keep_load(load, acceleration);
  const Matrix6 M = mass_matrix(mass_, state_.rotation);
  const Matrix6 K = Eigen::Map<const Matrix6>(impedance_.data());
  const Matrix6 added = Eigen::Map<const Matrix6>(added_mass_.data());
  Eigen::Map<Vector6> force(force_.data());
  // (M + added) dV = dt ((1 - w) F before + w (F at the wall - K (V - V wall))), with the turn of
  // the inertia at constant angular momentum.
  const double w = later_weight(M, K, dt);
  Vector6 right = dt * ((1.0 - w) * before + w * (force - K * (V_before - V_wall)));
  const Vec3 turned = L - turn_inertia(state_.angular_velocity);
  for (int a = 0; a < 3; ++a) right[3 + a] += turned[a];
  const Vector6 V = V_before + solve_free(options_, M + added + w * dt * K, right);
  force -= K * (V - V_wall);
  for (int a = 0; a < 3; ++a) {
    state_.velocity[a] = V[a];
    state_.angular_velocity[a] = V[3 + a];
  }
}

std::array<double, FreeBody::n_saved> FreeBody::save() const {
  std::array<double, n_saved> s{};
  std::size_t i = 0;
  const auto put = [&](const auto& values) {
    for (const double x : values) s[i++] = x;
  };
  put(state_.center.c);
  put(state_.velocity.c);
  put(state_.angular_velocity.c);
  put(state_.rotation.v.c);
  s[i++] = state_.rotation.w;
  put(wall_velocity_);
  put(force_);
  put(impedance_);
  put(added_mass_);
  s[i] = started_ ? 1.0 : 0.0;
  return s;
}

void FreeBody::restore(std::span<const double> saved) {
  OCU_ASSERT(saved.size() == n_saved);
  std::size_t i = 0;
  const auto take = [&](auto& values) {
    for (double& x : values) x = saved[i++];
  };
  take(state_.center.c);
  take(state_.velocity.c);
  take(state_.angular_velocity.c);
  take(state_.rotation.v.c);
  state_.rotation.w = saved[i++];
  take(wall_velocity_);
  take(force_);
  take(impedance_);
  take(added_mass_);
  started_ = saved[i] != 0.0;
}

}  // namespace ocublast::flow
