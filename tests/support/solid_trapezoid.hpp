#pragma once

#include <Eigen/Sparse>
#include <vector>

#include "tests/support/solid_runs.hpp"

namespace ocublast::solid::test {

/// A plane body by the trapezoidal rule (Crank-Nicolson) in long steps, as published references are
/// computed: the solver's elements and masses, Newton's method with a tangent from differences of
/// forces. For fixed nodes and constant body loads only.
class TrapezoidRun {
 public:
  TrapezoidRun(const SolidSetup& setup, const std::array<double, 2>& gravity)
      : mesh_(setup.mesh),
        assembly_(*mesh_, setup.materials, setup.material_of_tissue, setup.assembly),
        n_(mesh_->n_nodes()),
        u_(4 * n_),
        force_(4 * n_),
        other_(4 * n_) {
    std::vector<bool> fixed(n_, false);
    for (const auto& f : setup.fixed)
      for (const auto node : f.nodes) fixed[static_cast<std::size_t>(node)] = true;
    unknown_.assign(2 * n_, -1);
    for (std::size_t k = 0; k < 2 * n_; ++k)
      if (!fixed[k / 2]) {
        unknown_[k] = static_cast<int>(free_.size());
        free_.push_back(k);
      }
    const auto n = static_cast<Eigen::Index>(free_.size());
    mass_.resize(n);
    external_.resize(n);
    velocity_ = Eigen::VectorXd::Zero(n);
    for (Eigen::Index k = 0; k < n; ++k) {
      const std::size_t at = free_[static_cast<std::size_t>(k)];
      mass_[k] = assembly_.nodal_mass()[at / 2];
      external_[k] = mass_[k] * gravity[at % 2];
    }
    find_neighbours();
    internal_ = internal_force();
  }

  void step(double dt) {
    const Eigen::VectorXd start = displacement();
    const Eigen::VectorXd internal_at_start = internal_;
    const Eigen::VectorXd inertia = (2.0 / (dt * dt)) * mass_;
    set_displacement(start + dt * velocity_);
    build_tangent(inertia);
    Eigen::VectorXd u = displacement();
    double change = 1.0;
    for (int iteration = 0; change > 1e-11 && iteration < 40; ++iteration) {
      internal_ = internal_force();
      const Eigen::VectorXd residual = inertia.cwiseProduct(u - start - dt * velocity_) +
                                       0.5 * (internal_ + internal_at_start) - external_;
      const Eigen::VectorXd correction = solver_.solve(residual);
      u -= correction;
      set_displacement(u);
      change = correction.cwiseAbs().maxCoeff();
    }
    ASSERT_LT(change, 1e-11) << "m, Newton's last correction";
    internal_ = internal_force();
    velocity_ = (2.0 / dt) * (u - start) - velocity_;
  }

  /// m
  [[nodiscard]] double displacement(std::size_t node, std::size_t direction) const {
    return u_[4 * node + direction];
  }

 private:
  /// Nodes of common cells, and colours: nodes of one colour have no neighbour in common, so that
  /// one difference of forces gives the columns of all of them.
  void find_neighbours() {
    neighbours_.resize(n_);
    for (std::size_t c = 0; c < mesh_->n_cells(); ++c) {
      const auto nodes = mesh_->cell(c).nodes;
      for (const auto a : nodes)
        for (const auto b : nodes)
          neighbours_[static_cast<std::size_t>(a)].push_back(static_cast<std::size_t>(b));
    }
    for (auto& list : neighbours_) {
      std::sort(list.begin(), list.end());
      list.erase(std::unique(list.begin(), list.end()), list.end());
    }
    colour_.assign(n_, -1);
    for (std::size_t node = 0; node < n_; ++node) {
      std::vector<bool> taken(64, false);
      for (const auto a : neighbours_[node])
        for (const auto b : neighbours_[a])
          if (colour_[b] >= 0) taken[static_cast<std::size_t>(colour_[b])] = true;
      colour_[node] =
          static_cast<int>(std::find(taken.begin(), taken.end(), false) - taken.begin());
      n_colours_ = std::max(n_colours_, colour_[node] + 1);
    }
  }

  /// inertia + K/2 at the present displacement; an error of it costs iterations, not accuracy.
  void build_tangent(const Eigen::VectorXd& inertia) {
    constexpr double h = 1e-8;  // m
    std::vector<Eigen::Triplet<double>> entries;
    for (Eigen::Index k = 0; k < inertia.size(); ++k)
      entries.emplace_back(static_cast<int>(k), static_cast<int>(k), inertia[k]);
    for (int colour = 0; colour < n_colours_; ++colour)
      for (std::size_t i = 0; i < 2; ++i) {
        for (const double s : {h, -h}) {
          auto moved = u_;
          for (std::size_t node = 0; node < n_; ++node)
            if (colour_[node] == colour && unknown_[2 * node] >= 0) moved[4 * node + i] += s;
          assembly_.compute_force(moved, s > 0.0 ? force_ : other_, 0.0);
        }
        for (std::size_t node = 0; node < n_; ++node) {
          if (colour_[node] != colour || unknown_[2 * node] < 0) continue;
          for (const auto b : neighbours_[node])
            for (std::size_t j = 0; j < 2; ++j)
              if (unknown_[2 * b + j] >= 0)
                entries.emplace_back(unknown_[2 * b + j], unknown_[2 * node + i],
                                     0.25 * (force_[4 * b + j] - other_[4 * b + j]) / h);
        }
      }
    Eigen::SparseMatrix<double> tangent(inertia.size(), inertia.size());
    tangent.setFromTriplets(entries.begin(), entries.end());
    solver_.compute(tangent);
  }

  Eigen::VectorXd internal_force() {
    assembly_.compute_force(u_, force_, 0.0);
    return gather(force_);
  }
  [[nodiscard]] Eigen::VectorXd displacement() const { return gather(u_); }
  [[nodiscard]] Eigen::VectorXd gather(const AlignedVector<double>& field) const {
    Eigen::VectorXd values(static_cast<Eigen::Index>(free_.size()));
    for (std::size_t k = 0; k < free_.size(); ++k)
      values[static_cast<Eigen::Index>(k)] = field[4 * (free_[k] / 2) + free_[k] % 2];
    return values;
  }
  void set_displacement(const Eigen::VectorXd& values) {
    for (std::size_t k = 0; k < free_.size(); ++k)
      u_[4 * (free_[k] / 2) + free_[k] % 2] = values[static_cast<Eigen::Index>(k)];
  }

  std::shared_ptr<const SolidMesh> mesh_;
  Assembly assembly_;
  std::size_t n_;
  AlignedVector<double> u_;
  AlignedVector<double> force_;
  AlignedVector<double> other_;
  std::vector<std::size_t> free_;  ///< 2 node + direction of each unknown
  std::vector<int> unknown_;       ///< the other way round; -1: fixed
  Eigen::VectorXd mass_, external_, velocity_, internal_;
  std::vector<std::vector<std::size_t>> neighbours_;
  std::vector<int> colour_;
  int n_colours_ = 0;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver_;
};

}  // namespace ocublast::solid::test
