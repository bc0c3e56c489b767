// What damps a body, moves its nodes and chooses its step.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "tests/support/solid_runs.hpp"

namespace ocublast::solid {
namespace {

using namespace test;

constexpr std::size_t z_axis = 2;

/// A column of cubes that moves along its axis only, free at both ends, in its first mode: velocity
/// V cos(pi z / L), a pressure wave of frequency c / (2 L).
struct Column {
  static constexpr int cells = 20;
  static constexpr double length = 1.0;
  static constexpr double edge = length / cells;
  static constexpr double area = edge * edge;
  static constexpr double density = 1000.0;
  Material material = make_neo_hookean(1e6, 0.3, density);
  SolidSetup setup;
  double c = material.sound_speed();
  double omega = pi * c / length;

  void make() {
    auto viscosity = setup.assembly.viscosity;
    const double alpha = setup.mass_damping;
    setup =
        make_setup(make_block({.cells = {1, 1, cells}, .size = {edge, edge, length}}), material);
    setup.assembly.viscosity = viscosity;
    setup.mass_damping = alpha;
    for (const char* side : {"x0", "x1", "y0", "y1"})
      setup.fixed.push_back(fixed_set(*setup.mesh, side, {true, true, false}));
  }
  [[nodiscard]] SolidRun swing(double speed) const {
    SolidRun solid(setup);
    for (std::size_t n = 0; n < setup.mesh->n_nodes(); ++n)
      solid.set_velocity(
          static_cast<std::int32_t>(n),
          {0.0, 0.0, speed * std::cos(pi * setup.mesh->nodes[3 * n + z_axis] / length)});
    return solid;
  }
};

/// Kinetic and strain energy left, over what there was.
double energy_left(SolidRun& solid) {
  CellResults cells;
  solid.assembly().evaluate(solid.state().displacement, cells);
  const auto e = solid.compute_energies(cells);
  return (e.kinetic_scheme + e.internal) / e.initial;
}

/// The energy of the first mode of damping ratio xi falls by exp(-2 xi omega t).
void check_decay(const char* what, const Column& column, double xi) {
  auto solid = column.swing(1e-4 * column.c);
  const double end = 5.0 * 2.0 * pi / column.omega;
  const double error = run(solid, end, 20, [](double) {});
  const double found = -0.5 * std::log(energy_left(solid)) / (column.omega * end);
  std::printf("%s: damping ratio %.6f of %.6f (%+.2f %%), energy error %.1e\n", what, found, xi,
              100.0 * (found / xi - 1.0), error);
  // The mode's wave number of 20 elements is off by (pi / 20)^2 / 24 = 0.1 %, the step adds as
  // much.
  EXPECT_NEAR(found, xi, 0.01 * xi) << what;
}

TEST(Damping, InProportionToMassTakesItsShare) {
  Column column;
  column.setup.assembly.viscosity = {.linear = 0.0, .quadratic = 0.0};
  column.setup.mass_damping = 0.02 * column.omega;
  column.make();
  check_decay("mass damping", column, 0.01);
}

TEST(Damping, InProportionToStiffnessTakesItsShare) {
  Column column;
  column.material.stiffness_damping = 0.02 / column.omega;
  column.setup.assembly.viscosity = {.linear = 0.0, .quadratic = 0.0};
  column.make();
  check_decay("stiffness damping", column, 0.01);
}

TEST(BulkViscosity, LinearPartDampsAsItsCoefficientSays) {
  // Stress c1 rho c h on the rate of strain: xi = c1 h omega / (2 c).
  Column column;
  column.setup.assembly.viscosity = {.linear = 0.06, .quadratic = 0.0};
  column.make();
  check_decay("linear bulk viscosity", column,
              0.06 * Column::edge * column.omega / (2.0 * column.c));
}

TEST(BulkViscosity, QuadraticPartTakesTheWorkOfCompression) {
  // Pressure rho (c0 h)^2 rate^2 in compression: over a period T of strain rates of amplitude e
  // it takes rho (c0 h)^2 e^3 A (4 L / (3 pi)) (4 T / (3 pi)) / 2.
  Column column;
  constexpr double c0 = 4.0;
  column.setup.assembly.viscosity = {.linear = 0.0, .quadratic = c0};
  column.make();
  column.setup.control.safety = 0.2;  // the sum of works over a step errs by the step squared
  const double speed = 1e-3 * column.c;
  auto solid = column.swing(speed);
  const double period = 2.0 * pi / column.omega;
  const double error = run(solid, 4.0 * period, 80, [](double) {});
  const double rate = pi / Column::length * speed;
  const double expected = Column::density * std::pow(c0 * Column::edge, 2) * std::pow(rate, 3) *
                          Column::area * Column::length * 4.0 * period * 8.0 / (9.0 * pi * pi);
  std::printf(
      "quadratic bulk viscosity took %.4g of %.4g J (%+.2f %%), of %.4g J, energy error %.1e\n",
      solid.sums().viscous, expected, 100.0 * (solid.sums().viscous / expected - 1.0),
      solid.sums().initial, error);
  // Wave number of the mesh -0.3 %, the first step's rise from no stress -0.3 %, frequency -0.1 %,
  // energy lost on the way -0.2 %.
  EXPECT_NEAR(solid.sums().viscous, expected, 0.02 * expected);
}

SolidSetup make_pillar() {
  auto setup = make_setup(make_block({.cells = {2, 2, 8}, .size = {0.1, 0.1, 0.4}}),
                          make_neo_hookean(1e6, 0.3, 1000.0));
  setup.fixed.push_back(fixed_set(*setup.mesh, "z0", {true, true, true}));
  return setup;
}

/// Moves the top for 20 ms; where it is then (m), its velocity (m/s) and the energy error.
struct Top {
  double displacement;
  double velocity;
  double energy_error;
};
Top move_top(PrescribedNodes::Quantity quantity, Schedule schedule) {
  auto setup = make_pillar();
  setup.prescribed.push_back({.nodes = setup.mesh->node_sets.at("z1"),
                              .direction = z_axis,
                              .quantity = quantity,
                              .schedule = std::move(schedule)});
  SolidRun solid(setup);
  const double error = run(solid, 0.02, 40, [](double) {});
  const auto at = 4 * static_cast<std::size_t>(solid.mesh().node_sets.at("z1").front()) + z_axis;
  return {solid.state().displacement[at], solid.state().velocity[at], error};
}

TEST(PrescribedNodes, DisplacementAndAccelerationMoveAsTheyShould) {
  const auto by_displacement =
      move_top(PrescribedNodes::Quantity::displacement, {{0.0, 0.01, 0.03}, {0.0, 0.002, 0.012}});
  const auto by_acceleration = move_top(PrescribedNodes::Quantity::acceleration, {{0.0}, {50.0}});
  for (const auto& top : {by_displacement, by_acceleration})
    std::printf("top at %.12f m, %.9f m/s, energy error %.1e\n", top.displacement, top.velocity,
                top.energy_error);
  EXPECT_NEAR(by_displacement.displacement, 0.007, 1e-15);
  EXPECT_NEAR(by_displacement.velocity, 0.5, 1e-12);
  EXPECT_NEAR(by_acceleration.displacement, 0.5 * 50.0 * 0.02 * 0.02, 1e-12);
  EXPECT_NEAR(by_acceleration.velocity, 1.0, 1e-12);
}

TEST(StableStep, IsFoundAgainWhenElementsHaveShrunk) {
  // Pressed to half its height between smooth walls the pillar's elements have half the length
  // along it: its stable step must fall with them, or the run would blow up.
  auto setup = make_pillar();
  for (const char* side : {"x0", "x1"})
    setup.fixed.push_back(fixed_set(*setup.mesh, side, {true, false, false}));
  for (const char* side : {"y0", "y1"})
    setup.fixed.push_back(fixed_set(*setup.mesh, side, {false, true, false}));
  setup.prescribed.push_back({.nodes = setup.mesh->node_sets.at("z1"),
                              .direction = z_axis,
                              .quantity = PrescribedNodes::Quantity::displacement,
                              .schedule = {{0.0, 0.5}, {0.0, -0.2}}});
  setup.control.check_every = 20;
  setup.control.renew_every = 1000000;  // by the shrinking alone
  SolidRun solid(setup);
  const double before = solid.stable_step();
  const double error = run(solid, 0.5, 100, [](double) {});
  const double after = solid.stable_step();
  std::printf("stable step %.4g s, pressed to half %.4g s (%.2f), energy error %.1e\n", before,
              after, after / before, error);
  EXPECT_LT(after, 0.75 * before);
  EXPECT_GT(after, 0.25 * before);
}

TEST(StableStep, ElementRuleTakesTheElementsOwn) {
  auto setup = make_pillar();
  setup.control.rule = StepControl::Rule::element;
  setup.node_loads.push_back({.nodes = setup.mesh->node_sets.at("z1"),
                              .share = std::vector<double>(9, 1.0 / 9.0),
                              .force = {10.0, 0.0, 10.0},
                              .factor = {{0.0}, {1.0}}});
  SolidRun solid(setup);
  // 0.7 of the passage time of cubes of 5 cm (README: below the measured limits of all hexes).
  const double expected = 0.7 * 0.05 / setup.materials[0].sound_speed();
  EXPECT_NEAR(solid.stable_step(), expected, 1e-12 * expected);
  EXPECT_EQ(solid.largest_omega(), 0.0);
  const double error = run(solid, 0.05, 50, [](double) {});
  std::printf("step by the elements' rule %.4g s, energy error %.1e\n", solid.stable_step(), error);
}

}  // namespace
}  // namespace ocublast::solid
