#include "solid_solver/boundary/constraint.hpp"

#include <algorithm>

#include "solid_solver/boundary/facet_search.hpp"

namespace ocublast::solid {
namespace {

std::size_t index(std::int32_t n) {
  return static_cast<std::size_t>(n);
}

}  // namespace

SlidingPlane::SlidingPlane(std::vector<std::int32_t> nodes, const std::array<double, 3>& normal)
    : nodes_(std::move(nodes)), normal_(normal) {
  const double length = norm(normal_);
  for (double& n : normal_) n /= length;
}

void SlidingPlane::project(std::span<double> field) const {
  for (const auto n : nodes_) {
    double* f = &field[4 * index(n)];
    const double across = normal_[0] * f[0] + normal_[1] * f[1] + normal_[2] * f[2];
    for (std::size_t i = 0; i < 3; ++i) f[i] -= across * normal_[i];
  }
}

TiedNodes::TiedNodes(const SolidMesh& mesh, const std::vector<std::int32_t>& nodes,
                     const std::vector<Facet>& facets, double reach) {
  FacetSearch search(facets);
  search.build(mesh.nodes, reach);
  for (const auto n : nodes) {
    if (std::binary_search(search.nodes().begin(), search.nodes().end(), n)) continue;
    const Vec3 x = place_of(mesh.nodes, n);
    double least = reach;
    Tie tie{.node = -1};
    for (const auto t : search.near(x)) {
      const auto& corners = search.triangles()[index(t)];
      const Vec3 a = place_of(mesh.nodes, corners[0]);
      const Vec3 b = place_of(mesh.nodes, corners[1]);
      const Vec3 c = place_of(mesh.nodes, corners[2]);
      const Vec3 w = closest_weights(x, a, b, c);
      Vec3 gap = x;
      for (std::size_t i = 0; i < 3; ++i) gap[i] -= w[0] * a[i] + w[1] * b[i] + w[2] * c[i];
      if (norm(gap) > least) continue;
      least = norm(gap);
      tie = {.node = n, .carriers = corners, .weights = w};
    }
    if (tie.node < 0) continue;
    ties_.push_back(tie);
    largest_gap_ = std::max(largest_gap_, least);
  }
}

std::vector<std::int32_t> TiedNodes::tied() const {
  std::vector<std::int32_t> nodes;
  for (const auto& tie : ties_) nodes.push_back(tie.node);
  return nodes;
}

void TiedNodes::move_mass(std::span<double> mass) const {
  for (const auto& tie : ties_) {
    for (std::size_t k = 0; k < 3; ++k)
      mass[index(tie.carriers[k])] += tie.weights[k] * mass[index(tie.node)];
    mass[index(tie.node)] = 0.0;
  }
}

void TiedNodes::reduce(std::span<double> forces) const {
  for (const auto& tie : ties_) {
    double* from = &forces[4 * index(tie.node)];
    for (std::size_t k = 0; k < 3; ++k)
      for (std::size_t i = 0; i < 3; ++i)
        forces[4 * index(tie.carriers[k]) + i] += tie.weights[k] * from[i];
    for (std::size_t i = 0; i < 3; ++i) from[i] = 0.0;
  }
}

void TiedNodes::expand(std::span<double> field) const {
  for (const auto& tie : ties_)
    for (std::size_t i = 0; i < 3; ++i) {
      double sum = 0.0;
      for (std::size_t k = 0; k < 3; ++k)
        sum += tie.weights[k] * field[4 * index(tie.carriers[k]) + i];
      field[4 * index(tie.node) + i] = sum;
    }
}

}  // namespace ocublast::solid
