#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "tests/support/solid_runs.hpp"

namespace ocublast::solid {
namespace {

using namespace test;

/// Adds a mesh to another, its sets with a prefix, its tissue as a new one.
void append(SolidMesh& mesh, const SolidMesh& other, const std::string& prefix) {
  const auto shift = static_cast<std::int32_t>(mesh.n_nodes());
  mesh.nodes.insert(mesh.nodes.end(), other.nodes.begin(), other.nodes.end());
  mesh.tissues.push_back(prefix);
  for (std::size_t s = 0; s < n_shapes; ++s) {
    for (const auto n : other.cells[s].nodes) mesh.cells[s].nodes.push_back(n + shift);
    for (std::size_t k = 0; k < other.cells[s].tissue.size(); ++k)
      mesh.cells[s].tissue.push_back(static_cast<std::int32_t>(mesh.tissues.size()) - 1);
  }
  for (const auto& [name, set] : other.node_sets)
    for (const auto n : set) mesh.node_sets[prefix + name].push_back(n + shift);
  for (const auto& [name, set] : other.face_sets)
    for (auto f : set) {
      for (auto& n : f)
        if (n >= 0) n += shift;
      mesh.face_sets[prefix + name].push_back(f);
    }
}

void move(SolidMesh& mesh, const Point& by) {
  for (std::size_t i = 0; i < mesh.nodes.size(); ++i) mesh.nodes[i] += by[i % 3];
}

SolidSetup two_blocks(double gap, double friction) {
  SolidMesh mesh;
  append(mesh, make_block({.cells = {6, 6, 3}, .size = {0.3, 0.3, 0.1}}), "lower_");
  auto upper = make_block({.cells = {4, 4, 4}, .size = {0.1, 0.1, 0.1}});
  move(upper, {0.1013, 0.0987, 0.1 + gap});
  append(mesh, upper, "upper_");
  auto setup = make_setup(mesh, make_neo_hookean(1e6, 0.3, 1000.0));
  setup.contacts.push_back({.first = setup.mesh->face_sets.at("upper_wet"),
                            .second = setup.mesh->face_sets.at("lower_wet"),
                            .friction = friction});
  return setup;
}

void throw_nodes(SolidRun& solid, const std::string& tissue, const Point& velocity) {
  const auto& mesh = solid.mesh();
  std::vector<bool> in(mesh.n_nodes(), false);
  for (std::size_t c = 0; c < mesh.n_cells(); ++c)
    if (mesh.tissues[static_cast<std::size_t>(mesh.tissue_of(c))] == tissue)
      for (const auto n : mesh.cell(c).nodes) in[static_cast<std::size_t>(n)] = true;
  for (std::size_t n = 0; n < in.size(); ++n)
    if (in[n]) solid.set_velocity(static_cast<std::int32_t>(n), velocity);
}

TEST(Contact, CollisionKeepsMomentumAndEnergy) {
  // A contact closes within a step, which costs energy of the order of the penalty times that of
  // the surface's nodes: a thirtieth keeps it below 1e-3.
  auto setup = two_blocks(0.002, 0.0);
  setup.contacts.front().penalty = 0.03;
  SolidRun solid(setup);
  throw_nodes(solid, "upper_", {0.2, 0.0, -1.0});
  const auto before = solid.momenta();
  double worst = 0.0;
  double turning = 0.0;
  double lowest = 0.0;
  const double error = run(solid, 0.03, 60, [&](double) {
    const auto now = solid.momenta();
    for (std::size_t i = 0; i < 3; ++i) worst = std::max(worst, std::abs(now[i] - before[i]));
    for (std::size_t i = 3; i < 6; ++i) turning = std::max(turning, std::abs(now[i] - before[i]));
    double z = 0.0;
    for (const auto n : solid.mesh().node_sets.at("lower_z0"))
      z = std::min(z, solid.state().velocity[4 * static_cast<std::size_t>(n) + 2]);
    lowest = std::min(lowest, z);
  });
  std::printf(
      "momentum changes by %.1e of 1 N s, angular by %.1e of 0.1 N m s; lower block reaches "
      "%.3f m/s; energy error %.1e\n",
      worst, turning, lowest, error);
  EXPECT_LT(worst, 1e-12);
  // Forces act along the line from node to facet, so that only round-off turns the bodies.
  EXPECT_LT(turning, 1e-12);
  EXPECT_LT(lowest, -0.05);  // it was hit
  EXPECT_LT(error, 1e-3);
}

TEST(Contact, SlidingBlockStopsWhereFrictionSaysSo) {
  // Thrown at v on a rigid wall under gravity g, it stops after v^2 / (2 mu g).
  const double g = 10.0;
  const double mu = 0.3;
  const double v = 0.3;
  auto setup = make_setup(make_block({.cells = {4, 4, 2}, .size = {0.1, 0.1, 0.05}}),
                          make_neo_hookean(1e6, 0.3, 1000.0));
  setup.body_loads.push_back({.acceleration = {0.0, 0.0, -g}, .factor = {{0.0}, {1.0}}});
  setup.walls.push_back({.nodes = setup.mesh->node_sets.at("z0"),
                         .penalty = 0.03,
                         .point = {0.0, 0.0, 0.0},
                         .normal = {0.0, 0.0, 1.0},
                         .friction = mu});
  SolidRun solid(setup);
  solid.relax(1e-3, 100000);
  throw_nodes(solid, "block", {v, 0.0, 0.0});
  double mean = 0.0;
  const auto middle = [&] {
    double sum = 0.0;
    for (std::size_t n = 0; n < solid.mesh().n_nodes(); ++n)
      sum += solid.state().displacement[4 * n] / static_cast<double>(solid.mesh().n_nodes());
    return sum;
  };
  const double start = middle();
  double farthest = 0.0;
  const double error = run(solid, 0.15, 150, [&](double) {
    mean = middle() - start;
    farthest = std::max(farthest, mean);
  });
  const double exact = v * v / (2.0 * mu * g);
  std::printf(
      "slid %.5f m of %.5f (%+.2f %%), rests at %.5f m; friction took %.4g J of %.4g; energy "
      "error %.1e\n",
      farthest, exact, 100.0 * (farthest / exact - 1.0), mean, solid.sums().damping,
      0.5 * 0.5 * v * v, error);
  EXPECT_NEAR(farthest, exact, 0.03 * exact);
  EXPECT_LT(error, 1e-3);
}

TEST(Contact, BlockRestsOnABlockByItsWeight) {
  auto setup = two_blocks(1e-5, 0.0);
  setup.fixed.push_back(fixed_set(*setup.mesh, "lower_z0", {true, true, true}));
  setup.body_loads.push_back({.acceleration = {0.0, 0.0, -10.0}, .factor = {{0.0}, {1.0}}});
  setup.mass_damping = 300.0;
  SolidRun solid(setup);
  const double error = run(solid, 0.1, 20, [](double) {});
  const auto* contact = dynamic_cast<const SurfaceContact*>(solid.forces()[1].get());
  ASSERT_NE(contact, nullptr);
  const auto& force = contact->force_on_first();
  std::printf(
      "contact force (%.2e, %.2e, %.6f) N of weight 10 N, %zu nodes closed, energy error "
      "%.1e\n",
      force[0], force[1], force[2], contact->n_closed(), error);
  EXPECT_NEAR(force[2], 10.0, 0.03 * 10.0);
  EXPECT_LT(std::hypot(force[0], force[1]), 0.03 * 10.0);
  EXPECT_LT(error, 1e-3);
}

TEST(Contact, GlobeBouncesInItsOrbitAndKeepsMomentumAndEnergy) {
  // A ball of 12 mm thrown at 1 m/s within a free shell of 12.5 mm.
  SolidMesh mesh;
  append(mesh, make_ball(6, 0.012), "globe_");
  append(mesh, make_shell(6, 1, 0.0125, 0.015), "orbit_");
  auto setup = make_setup(mesh, make_material("neo_hookean", 1e4, 1e6, 1000.0));
  setup.contacts.push_back({.first = setup.mesh->face_sets.at("globe_wet"),
                            .second = setup.mesh->face_sets.at("orbit_inner"),
                            .penalty = 0.03});
  SolidRun solid(setup);
  throw_nodes(solid, "globe_", {0.6, 0.0, -0.8});
  const auto before = solid.momenta();
  const double size = std::hypot(before[0], before[2]);
  double worst = 0.0;
  double turning = 0.0;
  const double error = run(solid, 0.006, 60, [&](double) {
    const auto now = solid.momenta();
    for (std::size_t i = 0; i < 6; ++i) {
      auto& change = i < 3 ? worst : turning;
      change = std::max(change, std::abs(now[i] - before[i]));
    }
  });
  double orbit = 0.0;  // momentum that went over
  for (std::size_t n = make_ball(6, 0.012).n_nodes(); n < solid.mesh().n_nodes(); ++n)
    orbit += solid.nodal_mass()[n] * solid.state().velocity[4 * n + 2];
  std::printf(
      "momentum %.4f N s changes by %.1e, angular by %.1e N m s; the orbit took %.1f %% of it; "
      "energy error %.1e\n",
      size, worst, turning, 100.0 * orbit / before[2], error);
  EXPECT_LT(worst, 1e-12 * size);
  EXPECT_LT(turning, 1e-12 * size);  // times a metre: some radii of the ball
  EXPECT_GT(orbit / before[2], 0.3);
}

/// A part of a shell of `inner` to `inner` + 1 mm about the origin, 70 degrees wide about +z.
SolidMesh make_lid(int n, double inner) {
  auto lid = make_block({.cells = {n, n, 1}, .size = {1.0, 1.0, 1.0}});
  for (std::size_t a = 0; a < lid.n_nodes(); ++a) {
    double* x = &lid.nodes[3 * a];
    const double u = std::tan(35.0 * pi / 180.0 * (2.0 * x[0] - 1.0));
    const double v = std::tan(35.0 * pi / 180.0 * (2.0 * x[1] - 1.0));
    const double r = (inner + 0.001 * x[2]) / std::sqrt(1.0 + u * u + v * v);
    x[0] = r * u;
    x[1] = r * v;
    x[2] = r;
  }
  return lid;
}

TEST(Contact, LidSlidesOnTheCorneaAndTheBooksBalance) {
  // A lid of 1 mm turns about x on a globe of 12 mm while 1 kPa press it on; both are free, so that
  // the momentum is the impulse of the pressure, whatever contact and friction do.
  SolidMesh mesh;
  append(mesh, make_ball(6, 0.012), "globe_");
  append(mesh, make_lid(8, 0.0121), "lid_");
  auto setup = make_setup(mesh, make_material("neo_hookean", 1e4, 1e6, 1000.0));
  setup.contacts.push_back({.first = setup.mesh->face_sets.at("lid_z0"),
                            .second = setup.mesh->face_sets.at("globe_wet"),
                            .penalty = 0.03,
                            .friction = 0.2});
  setup.interface = setup.mesh->face_sets.at("lid_z1");
  SolidRun solid(setup);
  const std::size_t n_globe = make_ball(6, 0.012).n_nodes();
  for (std::size_t n = n_globe; n < solid.mesh().n_nodes(); ++n) {
    const double* x = &solid.mesh().nodes[3 * n];
    solid.set_velocity(static_cast<std::int32_t>(n), {0.0, -20.0 * x[2], 20.0 * x[1]});
  }
  const auto before = solid.momenta();
  const std::vector<double> pressure(solid.interface_nodes().size(), 1000.0);
  std::array<double, 3> impulse{};
  CellResults cells;
  double error = 0.0;
  std::size_t closed = 0;
  for (int w = 0; w < 60; ++w) {
    const auto result = solid.advance({.t_begin = 5e-5 * w,
                                       .t_end = 5e-5 * (w + 1),
                                       .shape = InterfaceLoad::constant,
                                       .overpressure = pressure});
    for (std::size_t i = 0; i < 3; ++i) impulse[i] += result.interface_impulse[i];
    solid.assembly().evaluate(solid.state().displacement, cells);
    error = std::max(error, std::abs(solid.compute_energies(cells).error));
    const auto* contact = dynamic_cast<const SurfaceContact*>(solid.forces().front().get());
    ASSERT_NE(contact, nullptr);
    closed = std::max(closed, contact->n_closed());
  }
  const auto after = solid.momenta();
  const auto energies = solid.compute_energies(cells);
  double worst = 0.0;
  for (std::size_t i = 0; i < 3; ++i)
    worst = std::max(worst, std::abs(after[i] - before[i] - impulse[i]));
  double globe = 0.0;  // angular momentum about x that friction gave the globe
  for (std::size_t n = 0; n < n_globe; ++n) {
    const double* x = &solid.mesh().nodes[3 * n];
    const double* v = &solid.state().velocity[4 * n];
    globe += solid.nodal_mass()[n] * (x[1] * v[2] - x[2] * v[1]);
  }
  std::printf(
      "impulse (%.2e, %.2e, %.4e) N s, momentum beside it %.1e; %zu nodes closed; friction took "
      "%.3g J of %.3g; globe turns with %.2e N m s; coupling work %.3g of external %.3g J; energy "
      "error %.1e\n",
      impulse[0], impulse[1], impulse[2], worst, closed, solid.sums().damping, solid.sums().initial,
      globe, energies.coupling, energies.external, error);
  EXPECT_LT(worst, 1e-12 * std::abs(impulse[2]));
  EXPECT_GT(closed, 20u);
  EXPECT_GT(solid.sums().damping, 0.01 * solid.sums().initial);
  EXPECT_GT(globe, 0.0);
  EXPECT_EQ(energies.coupling, energies.external);
  EXPECT_LT(error, 1e-3);
}

TEST(TiedSurfaces, PassThePatchTestOfAPressedBlock) {
  // Two blocks of different meshes, tied: uniaxial compression by a pressure stays uniform.
  SolidMesh mesh;
  append(mesh, make_block({.cells = {3, 3, 3}, .size = {0.1, 0.1, 0.1}}), "lower_");
  auto upper = make_block({.cells = {4, 4, 4}, .size = {0.1, 0.1, 0.1}});
  move(upper, {0.0, 0.0, 0.1});
  append(mesh, upper, "upper_");
  auto setup = make_setup(mesh, make_neo_hookean(1e6, 0.0, 1000.0));
  setup.fixed.push_back(fixed_set(*setup.mesh, "lower_z0", {false, false, true}));
  setup.planes.push_back(
      {.nodes = setup.mesh->node_sets.at("lower_x0"), .normal = {1.0, 0.0, 0.0}});
  setup.planes.push_back(
      {.nodes = setup.mesh->node_sets.at("lower_y0"), .normal = {0.0, 2.0, 0.0}});
  setup.ties.push_back({.nodes = setup.mesh->node_sets.at("upper_z0"),
                        .facets = setup.mesh->face_sets.at("lower_z1"),
                        .reach = 1e-6});
  setup.pressures.push_back(
      {.facets = setup.mesh->face_sets.at("upper_z1"), .pressure = {{0.0}, {1000.0}}});
  SolidRun solid(setup);
  const double mass_before = 2.0;
  double mass = 0.0;
  for (const double m : solid.nodal_mass()) mass += m;
  solid.relax(1e-9, 200000);
  CellResults cells;
  solid.assembly().evaluate(solid.state().displacement, cells);
  double least = 1e300, most = -1e300;
  for (std::size_t c = 0; c < solid.mesh().n_cells(); ++c) {
    least = std::min(least, cells[c * n_evaluated + stress_zz]);
    most = std::max(most, cells[c * n_evaluated + stress_zz]);
  }
  std::printf("stress_zz between %.3f and %.3f Pa (-1000), mass %.15g of 2 kg\n", least, most,
              mass);
  EXPECT_NEAR(mass, mass_before, 1e-12);
  // Node on facet is no mortar method: the nodes' shares of the load differ from those of the
  // facets, which bends the layers beside the joint; the load as a whole is passed on.
  EXPECT_NEAR(0.5 * (least + most), -1000.0, 0.2 * 1000.0);
  double mean = 0.0;
  for (std::size_t c = 0; c < 9; ++c) mean += cells[c * n_evaluated + stress_zz] / 9.0;
  EXPECT_NEAR(mean, -1000.0, 1.0);  // the bottom layer bears the whole load
}

}  // namespace
}  // namespace ocublast::solid
