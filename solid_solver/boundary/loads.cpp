#include "solid_solver/boundary/loads.hpp"

#include <algorithm>

namespace ocublast::solid {
namespace {

std::size_t index(std::int32_t n) {
  return static_cast<std::size_t>(n);
}

}  // namespace

DeadLoad::DeadLoad(const BodyLoad& load, std::span<const double> mass) : factor_(load.factor) {
  for (std::size_t n = 0; n < mass.size(); ++n) {
    nodes_.push_back(static_cast<std::int32_t>(n));
    for (std::size_t i = 0; i < 3; ++i) forces_.push_back(mass[n] * load.acceleration[i]);
  }
}

DeadLoad::DeadLoad(const NodeLoad& load) : nodes_(load.nodes), factor_(load.factor) {
  for (std::size_t k = 0; k < nodes_.size(); ++k)
    for (std::size_t i = 0; i < 3; ++i) forces_.push_back(load.share[k] * load.force[i]);
}

ForceWork DeadLoad::apply(const StepMotion& motion, std::span<double> residual) {
  const double now = factor_.value(motion.t_new);
  const double mean = 0.5 * (last_[0] + now);
  last_[0] = now;
  double power = 0.0;
  for (std::size_t k = 0; k < nodes_.size(); ++k) {
    const bool counts = motion.counts(index(nodes_[k]));
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t at = 4 * index(nodes_[k]) + i;
      residual[at] -= now * forces_[3 * k + i];
      if (counts) power += forces_[3 * k + i] * motion.velocity[at];
    }
  }
  return {.external = mean * power * motion.dt};
}

Springs::Springs(SpringSet set) : set_(std::move(set)), last_(3 * set_.nodes.size(), 0.0) {}

ForceWork Springs::apply(const StepMotion& motion, std::span<double> residual) {
  ForceWork work;
  for (std::size_t k = 0; k < set_.nodes.size(); ++k)
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t at = 4 * index(set_.nodes[k]) + i;
      const double d = motion.displacement[at];
      const double damper = set_.damping[k] * motion.velocity[at];
      residual[at] += set_.stiffness[k] * d + damper;
      double& old = last_[3 * k + i];
      if (motion.counts(index(set_.nodes[k]))) {
        work.dissipated += 0.5 * (old + damper) * motion.velocity[at] * motion.dt;
        work.stored += 0.5 * set_.stiffness[k] * d * d;
      }
      old = damper;
    }
  return work;
}

void Springs::add_stiffness(std::span<const double> x, std::span<double> y) const {
  for (std::size_t k = 0; k < set_.nodes.size(); ++k)
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t at = 4 * index(set_.nodes[k]) + i;
      y[at] += set_.stiffness[k] * x[at];
    }
}

double Springs::damping_ratio(double omega, std::span<const double> mass) const {
  double largest = 0.0;  // xi = c / (2 m omega)
  for (std::size_t k = 0; k < set_.nodes.size(); ++k)
    largest = std::max(largest, 0.5 * set_.damping[k] / (mass[index(set_.nodes[k])] * omega));
  return largest;
}

MassDamping::MassDamping(double alpha, std::span<const double> mass)
    : alpha_(alpha), mass_(mass.begin(), mass.end()), last_(3 * mass.size(), 0.0) {}

ForceWork MassDamping::apply(const StepMotion& motion, std::span<double> residual) {
  double power = 0.0;
  for (std::size_t n = 0; n < mass_.size(); ++n)
    for (std::size_t i = 0; i < 3; ++i) {
      const double v = motion.velocity[4 * n + i];
      const double force = alpha_ * mass_[n] * v;
      residual[4 * n + i] += force;
      if (motion.counts(n)) power += 0.5 * (last_[3 * n + i] + force) * v;
      last_[3 * n + i] = force;
    }
  return {.dissipated = power * motion.dt};
}

double MassDamping::damping_ratio(double omega, std::span<const double>) const {
  return 0.5 * alpha_ / omega;
}

}  // namespace ocublast::solid
