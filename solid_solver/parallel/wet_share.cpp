#include "solid_solver/parallel/wet_share.hpp"

#include <algorithm>

#include "coupler/base/errors.hpp"

namespace ocublast::solid {

WetShare::WetShare(const SolidMesh* whole, const std::string& face_set, const SolidRun& run)
    : team_(run.team()), nodes_(run.interface_nodes()) {
  if (team_.root()) surface_ = make_wet_surface(*whole, face_set);
  if (team_.alone()) {
    OCU_ASSERT(surface_.nodes == nodes_);
    return;
  }
  std::vector<std::int32_t> numbers;
  for (const auto n : nodes_)
    numbers.push_back(static_cast<std::int32_t>(team_.number(static_cast<std::size_t>(n))));
  for (const auto& list : team_.part()->ranks->gather(std::span<const std::int32_t>(numbers))) {
    auto& vertices = vertices_.emplace_back();
    for (const auto n : list)
      vertices.push_back(static_cast<std::size_t>(
          std::lower_bound(surface_.nodes.begin(), surface_.nodes.end(), n) -
          surface_.nodes.begin()));
  }
}

std::span<const double> WetShare::scatter_pressure(std::span<const double> whole) {
  if (team_.alone()) return whole;
  pressure_.resize(nodes_.size());
  std::vector<std::vector<double>> parts;
  for (const auto& vertices : vertices_) {
    auto& part = parts.emplace_back();
    for (const auto v : vertices) part.push_back(whole[v]);
  }
  team_.part()->ranks->scatter(parts, std::span<double>(pressure_));
  return pressure_;
}

std::span<const double> WetShare::scatter_forces(std::span<const double> whole) {
  if (team_.alone()) return whole;
  forces_.resize(3 * nodes_.size());
  std::vector<bool> given(whole.size() / 3, false);
  std::vector<std::vector<double>> parts;
  for (const auto& vertices : vertices_) {
    auto& part = parts.emplace_back();
    for (const auto v : vertices) {
      for (std::size_t i = 0; i < 3; ++i) part.push_back(given[v] ? 0.0 : whole[3 * v + i]);
      given[v] = true;
    }
  }
  team_.part()->ranks->scatter(parts, std::span<double>(forces_));
  return forces_;
}

std::vector<double> WetShare::pick(std::span<const double> field) const {
  std::vector<double> mine;
  mine.reserve(3 * nodes_.size());
  for (const auto n : nodes_) {
    const double* row = &field[4 * static_cast<std::size_t>(n)];
    mine.insert(mine.end(), row, row + 3);
  }
  return mine;
}

void WetShare::put(std::vector<double> mine, std::span<double> whole) const {
  if (team_.alone()) {
    std::copy(mine.begin(), mine.end(), whole.begin());
    return;
  }
  const auto all = team_.part()->ranks->gather(std::span<const double>(mine));
  if (!team_.root()) return;
  for (std::size_t r = 0; r < all.size(); ++r)
    for (std::size_t k = 0; k < vertices_[r].size(); ++k)
      std::copy_n(&all[r][3 * k], 3, &whole[3 * vertices_[r][k]]);
}

void WetShare::gather(std::span<const double> field, std::span<double> whole) const {
  put(pick(field), whole);
}

void WetShare::gather_positions(const SolidRun& run, std::span<double> whole) const {
  auto mine = pick(run.state().displacement);
  for (std::size_t k = 0; k < nodes_.size(); ++k)
    for (std::size_t i = 0; i < 3; ++i)
      mine[3 * k + i] =
          run.mesh().nodes[3 * static_cast<std::size_t>(nodes_[k]) + i] + mine[3 * k + i];
  put(std::move(mine), whole);
}

}  // namespace ocublast::solid
