#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "solid_solver/boundary/nodal_force.hpp"
#include "solid_solver/boundary/schedule.hpp"
#include "solid_solver/boundary/supports.hpp"

namespace ocublast::solid {

/// Acceleration of the whole body by schedule (gravity), m/s^2.
struct BodyLoad {
  std::array<double, 3> acceleration{};
  Schedule factor;  ///< 1
};

/// Forces on nodes that keep their direction, by schedule.
struct NodeLoad {
  std::vector<std::int32_t> nodes;
  std::vector<double> share;      ///< [nodes], sum 1
  std::array<double, 3> force{};  ///< N, in all
  Schedule factor;                ///< 1
};

/// Dead loads: fixed nodal forces times a schedule.
class DeadLoad : public NodalForce {
 public:
  DeadLoad(const BodyLoad& load, std::span<const double> mass);
  explicit DeadLoad(const NodeLoad& load);
  ForceWork apply(const StepMotion& motion, std::span<double> residual) override;
  [[nodiscard]] bool quiet(double begin, double end) const override {
    return factor_.zero_in(begin, end);
  }
  [[nodiscard]] std::span<double> state() override { return last_; }

 private:
  std::vector<std::int32_t> nodes_;
  std::vector<double> forces_;  ///< [nodes, 3] N at factor 1
  Schedule factor_;
  std::vector<double> last_{0.0};  ///< factor at the last step
};

/// Springs and dashpots to ground.
class Springs : public NodalForce {
 public:
  explicit Springs(SpringSet set);
  ForceWork apply(const StepMotion& motion, std::span<double> residual) override;
  void add_stiffness(std::span<const double> x, std::span<double> y) const override;
  [[nodiscard]] double damping_ratio(double omega, std::span<const double> mass) const override;
  [[nodiscard]] std::span<double> state() override { return last_; }

 private:
  SpringSet set_;
  std::vector<double> last_;  ///< [nodes, 3] damper forces, N
};

/// Damping in proportion to mass: force -alpha m v, alpha in 1/s.
class MassDamping : public NodalForce {
 public:
  MassDamping(double alpha, std::span<const double> mass);
  ForceWork apply(const StepMotion& motion, std::span<double> residual) override;
  [[nodiscard]] double damping_ratio(double omega, std::span<const double> mass) const override;
  [[nodiscard]] std::span<double> state() override { return last_; }

 private:
  double alpha_;
  std::vector<double> mass_;
  std::vector<double> last_;  ///< [nodes, 3] forces, N
};

}  // namespace ocublast::solid
