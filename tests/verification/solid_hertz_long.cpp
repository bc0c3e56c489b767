#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "tests/support/solid_runs.hpp"

namespace ocublast::solid {
namespace {

using namespace test;

/// Half of a ball of radius 1 (z < 0 when down), n cells across, finest at its pole.
SolidMesh half_ball(int n, bool down) {
  auto mesh = make_block({.cells = {n, n, n / 2}, .size = {2.0, 2.0, 1.0}});
  for (std::size_t a = 0; a < mesh.n_nodes(); ++a) {
    double* x = &mesh.nodes[3 * a];
    Point p{x[0] - 1.0, x[1] - 1.0, x[2] - 1.0};  // the pole is at z = -1
    for (std::size_t i = 0; i < 2; ++i) p[i] *= 0.18 + 0.82 * p[i] * p[i];
    const double up = 1.0 + p[2];
    p[2] = up * (0.18 + 0.82 * up) - 1.0;
    const double largest = std::max({std::abs(p[0]), std::abs(p[1]), std::abs(p[2])});
    const double length = std::hypot(p[0], p[1], p[2]);
    for (std::size_t i = 0; i < 3; ++i) {
      const double sphere = length > 0.0 ? p[i] * largest / length : 0.0;
      x[i] = (1.0 - largest) * 0.62 * p[i] + largest * sphere;
    }
    if (!down) {
      x[2] = -x[2];
    }
  }
  if (!down)  // mirrored: turn the cells and facets back
    for (std::size_t h = 0; h < mesh.count(Shape::hex8); ++h)
      for (std::size_t k = 0; k < 4; ++k)
        std::swap(mesh.of(Shape::hex8).nodes[8 * h + k], mesh.of(Shape::hex8).nodes[8 * h + 4 + k]);
  if (!down)
    for (auto& [name, facets] : mesh.face_sets)
      for (auto& f : facets) std::swap(f[1], f[3]);
  return mesh;
}

TEST(Hertz, TwoSpheresPushAsTheoryPredicts) {
  // F = 4/3 E* sqrt(R*) delta^(3/2), E* = E / (2 (1 - nu^2)), R* = R / 2; half balls with their
  // flat sides moved towards each other. delta such that a / R = 0.1.
  const int n = 16;
  const double young = 1e6;
  const double nu = 0.3;
  SolidMesh mesh = half_ball(n, true);
  const auto other = half_ball(n, false);
  const double delta = 2.0 * 0.1 * 0.1;  // a^2 / R*
  const auto shift = static_cast<std::int32_t>(mesh.n_nodes());
  for (std::size_t a = 0; a < mesh.n_nodes(); ++a) mesh.nodes[3 * a + 2] += 1.0;  // pole at 0
  for (std::size_t a = 0; a < other.n_nodes(); ++a)
    mesh.nodes.insert(mesh.nodes.end(),
                      {other.nodes[3 * a], other.nodes[3 * a + 1], other.nodes[3 * a + 2] - 1.0});
  for (const auto v : other.of(Shape::hex8).nodes) mesh.of(Shape::hex8).nodes.push_back(v + shift);
  mesh.of(Shape::hex8).tissue.assign(mesh.count(Shape::hex8), 0);
  ContactKeys contact{.first = mesh.face_sets.at("z0"), .penalty = 2.0};
  for (auto f : other.face_sets.at("z0")) {
    for (auto& v : f) v += shift;
    contact.second.push_back(f);
  }
  auto material = make_material("linear_elastic", young / (2.0 * (1.0 + nu)),
                                young / (3.0 * (1.0 - 2.0 * nu)), 1000.0);
  auto setup = make_setup(mesh, material);
  setup.contacts.push_back(contact);
  const auto base = setup.mesh->node_sets.at("z1");  // of the upper half
  std::vector<std::int32_t> other_base;
  for (const auto v : base) other_base.push_back(v + shift);
  setup.fixed.push_back({.nodes = other_base});
  setup.fixed.push_back({.nodes = base, .directions = {true, true, false}});
  setup.prescribed.push_back({.nodes = base,
                              .direction = 2,
                              .quantity = PrescribedNodes::Quantity::displacement,
                              .schedule = {{0.0}, {-delta}}});
  SolidRun solid(setup);
  const auto relaxed = solid.relax(1e-3, 20000);
  const auto* force = dynamic_cast<const SurfaceContact*>(solid.forces().front().get());
  ASSERT_NE(force, nullptr);
  const double E_star = young / (2.0 * (1.0 - nu * nu));
  const double exact = 4.0 / 3.0 * E_star * std::sqrt(0.5) * std::pow(delta, 1.5);
  const double found = std::abs(force->force_on_first()[2]);
  std::printf("force %.5g N of Hertz %.5g N (%+.2f %%), %zu nodes closed, %zu steps\n", found,
              exact, 100.0 * (found / exact - 1.0), force->n_closed(), relaxed.steps);
  // Half balls on rigid bases are stiffer than half-spaces, the penalty is softer than none: each
  // by some per cent at a / R = 0.1.
  EXPECT_NEAR(found, exact, 0.03 * exact);
}

}  // namespace
}  // namespace ocublast::solid
