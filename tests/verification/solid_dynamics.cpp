#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>

#include "coupler/base/errors.hpp"
#include "solid_solver/integrators/stable_step.hpp"
#include "solid_solver/mesh/cell_geometry.hpp"
#include "tests/support/solid_runs.hpp"

namespace ocublast::solid {
namespace {

using namespace test;

constexpr std::size_t x_axis = 0;
constexpr std::size_t z_axis = 2;

/// A bar along z, step pressure on z1; `clamped_sides` keeps it straight (P-wave), else nu = 0.
struct Column {
  SolidSetup setup;
  double length = 1.0;
  int cells = 400;
};

Column make_column(const Material& material, bool clamped_sides, double pressure) {
  Column column;
  auto mesh = make_block({.cells = {1, 1, column.cells}, .size = {0.01, 0.01, column.length}});
  column.setup = make_setup(mesh, material);
  const auto& m = *column.setup.mesh;
  if (clamped_sides)
    for (const char* side : {"x0", "x1"})
      column.setup.fixed.push_back(fixed_set(m, side, {true, false, false}));
  if (clamped_sides)
    for (const char* side : {"y0", "y1"})
      column.setup.fixed.push_back(fixed_set(m, side, {false, true, false}));
  column.setup.pressures.push_back(
      {.facets = m.face_sets.at("z1"), .pressure = {{0.0}, {pressure}}});
  return column;
}

/// Speed of the front (m/s) from where the velocity passes half its plateau, and the plateau.
void check_wave(Column column, double c, double pressure, double density) {
  SolidRun solid(column.setup);
  const double plateau = pressure / (density * c);
  std::vector<double> times;
  std::vector<double> fronts;
  double mean = 0.0;
  int samples = 0;
  const double energy_error = run(solid, 0.9 * column.length / c, 90, [&](double t) {
    const auto velocity = [&](int k) {
      return -solid.state().velocity[4 * (4 * static_cast<std::size_t>(k)) + z_axis];
    };
    if (t < 0.2 * column.length / c) return;
    for (int k = 0; k < column.cells; ++k) {
      if (!(velocity(k) < 0.5 * plateau && velocity(k + 1) >= 0.5 * plateau)) continue;
      const double s = (0.5 * plateau - velocity(k)) / (velocity(k + 1) - velocity(k));
      times.push_back(t);
      fronts.push_back(column.length * (1.0 - (k + s) / column.cells));
      break;
    }
    // Mean from the loaded end to half way to the front: behind the ringing of the front.
    const int reach = static_cast<int>(0.5 * t * c / column.length * column.cells);
    for (int k = column.cells; k > column.cells - reach; --k, ++samples) mean += velocity(k);
  });
  mean /= samples;
  double st = 0.0, sf = 0.0, stt = 0.0, stf = 0.0;
  const auto n = static_cast<double>(times.size());
  for (std::size_t i = 0; i < times.size(); ++i) {
    st += times[i];
    sf += fronts[i];
    stt += times[i] * times[i];
    stf += times[i] * fronts[i];
  }
  const double speed = (n * stf - st * sf) / (n * stt - st * st);
  std::printf(
      "speed %.4f of %.4f m/s (%+.3f %%), velocity %.6f of %.6f m/s (%+.3f %%), energy error "
      "%.1e\n",
      speed, c, 100.0 * (speed / c - 1.0), mean, plateau, 100.0 * (mean / plateau - 1.0),
      energy_error);
  ASSERT_GT(times.size(), 20u);
  EXPECT_NEAR(speed, c, 0.005 * c);
  EXPECT_NEAR(mean, plateau, 0.01 * plateau);
  EXPECT_LT(energy_error, 1e-3);
}

TEST(BarWave, StepLoadTravelsAtTheBarSpeed) {
  const double young = 1e6;
  const double density = 1000.0;
  // 100 Pa strains by 1e-4: the neo-Hookean bar is linear to 1e-4.
  check_wave(make_column(make_neo_hookean(young, 0.0, density), false, 100.0),
             std::sqrt(young / density), 100.0, density);
}

TEST(PressureWave, StepLoadTravelsAtTheDilatationalSpeed) {
  const auto material = make_neo_hookean(1e6, 0.49, 1000.0);
  check_wave(make_column(material, true, 1000.0), material.sound_speed(), 1000.0, 1000.0);
}

TEST(BreathingMode, ShellRingsAtTheExactFrequency) {
  // Free shell a = 11 mm, b = 12 mm, E = 1 MPa, nu = 0.49, rho = 1000: 868.496 Hz (spherical Bessel
  // functions). 10 x 10 facets per cap: flat facets lose 0.5 % of area, which tells the tolerance.
  auto setup = make_setup(make_shell(10, 2, 0.011, 0.012), make_neo_hookean(1e6, 0.49, 1000.0));
  SolidRun solid(setup);
  const auto& mesh = solid.mesh();
  for (std::size_t n = 0; n < mesh.n_nodes(); ++n) {
    const double* x = &mesh.nodes[3 * n];
    const double r = std::hypot(x[0], x[1], x[2]);
    // Volume-preserving radial field, amplitude 1e-4 of a sound crossing: the mode nearly alone.
    const double v = 1e-3 * 0.0115 * 0.0115 / (r * r);
    solid.set_velocity(static_cast<std::int32_t>(n), {v * x[0] / r, v * x[1] / r, v * x[2] / r});
  }
  std::vector<double> radius;
  const double sample = 1e-5;
  const double energy_error = run(solid, 400 * sample, 400, [&](double) {
    double sum = 0.0;
    for (std::size_t n = 0; n < mesh.n_nodes(); ++n) {
      double u = 0.0;
      double r = 0.0;
      for (std::size_t i = 0; i < 3; ++i) {
        u += mesh.nodes[3 * n + i] * solid.state().displacement[4 * n + i];
        r += mesh.nodes[3 * n + i] * mesh.nodes[3 * n + i];
      }
      sum += u / std::sqrt(r);
    }
    radius.push_back(sum);
  });
  const double f = frequency_of(radius, sample);
  std::printf("breathing mode %.3f Hz of 868.496 (%+.2f %%), energy error %.1e\n", f,
              100.0 * (f / 868.496 - 1.0), energy_error);
  EXPECT_NEAR(f, 868.496, 0.005 * 868.496);
  EXPECT_LT(energy_error, 1e-3);
}

TEST(SpinningCube, KeepsMomentumAndEnergy) {
  auto setup = make_setup(make_block({.cells = {4, 4, 4}, .size = {1.0, 1.0, 1.0}}),
                          make_neo_hookean(17e6, 0.3, 1100.0));
  SolidRun solid(setup);
  const Eigen::Vector3d omega = 105.0 * Eigen::Vector3d(1, 1, 1).normalized();
  for (std::size_t n = 0; n < solid.mesh().n_nodes(); ++n) {
    const Eigen::Vector3d x(solid.mesh().nodes[3 * n] - 0.5, solid.mesh().nodes[3 * n + 1] - 0.5,
                            solid.mesh().nodes[3 * n + 2] - 0.5);
    const Eigen::Vector3d v = omega.cross(x);
    solid.set_velocity(static_cast<std::int32_t>(n), {v[0], v[1], v[2]});
  }
  const auto before = solid.momenta();
  std::array<double, 6> worst{};
  double scale = 0.0;
  for (std::size_t i = 3; i < 6; ++i) scale = std::max(scale, std::abs(before[i]));
  const double energy_error = run(solid, 0.06, 600, [&](double) {  // one turn
    const auto now = solid.momenta();
    for (std::size_t i = 0; i < 6; ++i)
      worst[i] = std::max(worst[i], std::abs(now[i] - before[i]) / scale);
  });
  const double linear = *std::max_element(worst.begin(), worst.begin() + 3);
  const double angular = *std::max_element(worst.begin() + 3, worst.end());
  std::printf("linear momentum %.1e, angular %.1e of the angular one, energy error %.1e\n", linear,
              angular, energy_error);
  EXPECT_LT(linear, 1e-10);
  EXPECT_LT(angular, 1e-10);
  EXPECT_LT(energy_error, 1e-3);
}

TEST(WaterSphere, SwingsAboutTheAppliedPressureAtItsAcousticFrequency) {
  // K = 2.25 GPa, G = 1 kPa, R = 12 mm: 62 500 Hz; a sudden uniform 100 kPa leaves a mean of 100
  // kPa.
  auto setup = make_setup(make_ball(10, 0.012), make_material("neo_hookean", 1e3, 2.25e9, 1000.0));
  setup.pressures.push_back(
      {.facets = setup.mesh->face_sets.at("wet"), .pressure = {{0.0}, {1e5}}});
  SolidRun solid(setup);
  std::vector<double> pressure;
  CellResults cells;
  const double sample = 0.5e-6;
  const double energy_error = run(solid, 320 * sample, 320, [&](double) {
    solid.assembly().evaluate(solid.state().displacement, cells);
    double sum = 0.0;
    double volume = 0.0;
    for (std::size_t c = 0; c < solid.mesh().n_cells(); ++c) {
      const double v = cell_volume(solid.mesh(), c);
      for (std::size_t k = 0; k < 3; ++k) sum -= v * cells[c * n_evaluated + k] / 3.0;
      volume += v;
    }
    pressure.push_back(sum / volume);
  });
  const double mean =
      std::accumulate(pressure.begin(), pressure.end(), 0.0) / static_cast<double>(pressure.size());
  const double f = strongest_frequency(pressure, sample, 40e3, 90e3);
  std::printf("frequency %.0f Hz of 62500 (%+.2f %%), mean %.2f kPa of 100, energy error %.1e\n", f,
              100.0 * (f / 62500.0 - 1.0), 1e-3 * mean, energy_error);
  EXPECT_NEAR(f, 62500.0, 0.005 * 62500.0);
  EXPECT_NEAR(mean, 1e5, 5e3);
  EXPECT_LT(energy_error, 1e-3);
}

TEST(Springs, CarryABlockAtTheirFrequency) {
  // A stiff cube of 1 kg on springs of 8 x 1e4 N/m: omega = sqrt(8e4) rad/s, its own modes are 1000
  // times higher.
  auto setup = make_setup(make_block({.cells = {1, 1, 1}, .size = {0.1, 0.1, 0.1}}),
                          make_neo_hookean(1e9, 0.3, 1000.0));
  SpringSet set{.nodes = {0, 1, 2, 3, 4, 5, 6, 7}};
  set.stiffness.assign(8, 1e4);
  set.damping.assign(8, 0.0);
  setup.springs.push_back(set);
  SolidRun solid(setup);
  for (std::int32_t n = 0; n < 8; ++n) solid.set_velocity(n, {0.0, 0.01, 0.0});
  std::vector<double> y;
  const double sample = 5e-4;
  const double energy_error =
      run(solid, 0.2, 400, [&](double) { y.push_back(solid.state().displacement[1]); });
  const double exact = std::sqrt(8e4) / (2.0 * pi);
  const double f = frequency_of(y, sample);
  std::printf("spring frequency %.4f Hz of %.4f, energy error %.1e\n", f, exact, energy_error);
  EXPECT_NEAR(f, exact, 1e-3 * exact);
  EXPECT_LT(energy_error, 1e-3);
}

TEST(Dashpots, TakeExactlyTheEnergyThatIsLost) {
  auto setup = make_setup(make_block({.cells = {2, 2, 2}, .size = {0.1, 0.1, 0.1}}),
                          make_neo_hookean(1e6, 0.3, 1000.0));
  SpringSet set{.nodes = setup.mesh->node_sets.at("z0")};
  set.stiffness.assign(set.nodes.size(), 1e3);
  set.damping.assign(set.nodes.size(), 1.0);
  setup.springs.push_back(set);
  SolidRun solid(setup);
  for (std::size_t n = 0; n < solid.mesh().n_nodes(); ++n)
    solid.set_velocity(static_cast<std::int32_t>(n), {0.0, 0.0, 0.1});
  const double energy_error = run(solid, 0.05, 50, [](double) {});
  std::printf("dissipated %.4g J of %.4g, energy error %.1e\n", solid.sums().damping,
              solid.sums().initial, energy_error);
  EXPECT_GT(solid.sums().damping, 0.05 * solid.sums().initial);
  EXPECT_LT(energy_error, 1e-3);
}

TEST(PrescribedNodes, FollowTheScheduleAndDoTheWork) {
  auto setup = make_setup(make_block({.cells = {2, 2, 8}, .size = {0.1, 0.1, 0.4}}),
                          make_neo_hookean(1e6, 0.3, 1000.0));
  // Velocity ramps up and down: 1 cm in 20 ms.
  setup.prescribed.push_back({.nodes = setup.mesh->node_sets.at("z0"),
                              .direction = z_axis,
                              .quantity = PrescribedNodes::Quantity::velocity,
                              .schedule = {{0.0, 0.01, 0.02}, {0.0, 1.0, 0.0}}});
  SolidRun solid(setup);
  const double energy_error = run(solid, 0.04, 80, [](double) {});
  const auto node = static_cast<std::size_t>(solid.mesh().node_sets.at("z0").front());
  const double moved = solid.state().displacement[4 * node + z_axis];
  std::printf("moved %.9f m, work %.4g J, energy error %.1e\n", moved, solid.sums().external,
              energy_error);
  EXPECT_NEAR(moved, 0.01, 1e-12);  // sums of some hundred steps' rounding
  EXPECT_GT(solid.sums().external, 0.0);
  EXPECT_LT(energy_error, 1e-3);
}

TEST(FollowerPressure, OfAClosedDeformedSurfaceHasNoResultant) {
  const auto mesh = make_ball(4, 1.0);
  const FollowerPressure surface(mesh, mesh.face_sets.at("wet"));
  AlignedVector<double> d(4 * mesh.n_nodes());
  for (std::size_t i = 0; i < d.size(); ++i)
    d[i] = i % 4 == 3 ? 0.0 : 0.1 * std::sin(static_cast<double>(i));
  const std::vector<double> p(surface.nodes().size(), 1e5);
  std::vector<double> f(3 * p.size());
  surface.compute_forces(d, p, f);
  double sum[3] = {};
  double largest = 0.0;
  for (std::size_t i = 0; i < f.size(); ++i) {
    sum[i % 3] += f[i];
    largest = std::max(largest, std::abs(f[i]));
  }
  // Both cuts of a warped quad have its area vector, so a closed surface of quads stays closed.
  for (const double s : sum) EXPECT_LT(std::abs(s), 1e-11 * largest);
}

TEST(StableStep, LanczosFindsTheLargestEigenvalueOfTheDenseMatrix) {
  auto mesh = make_block({.cells = {3, 2, 2}, .size = {3.0, 1.5, 1.0}, .distortion = 0.2});
  auto setup = make_setup(mesh, make_neo_hookean(1e6, 0.49, 1000.0));
  Assembly assembly(*setup.mesh, setup.materials, {0}, setup.assembly);
  const std::size_t n = setup.mesh->n_nodes();
  const double h = 1e-6;
  Eigen::MatrixXd A(3 * n, 3 * n);
  AlignedVector<double> d(4 * n), force(4 * n), inverse_mass(4 * n);
  for (std::size_t a = 0; a < n; ++a)
    for (std::size_t i = 0; i < 3; ++i) inverse_mass[4 * a + i] = 1.0 / assembly.nodal_mass()[a];
  const auto product = [&](std::span<const double> x, const TakePart& take) {
    for (const double s : {h, -h}) {
      for (std::size_t i = 0; i < x.size(); ++i) d[i] = s * x[i];
      assembly.compute_force(d, force, 0.0);
      take(force, 0.5 / s);
    }
  };
  AlignedVector<double> unit(4 * n), column(4 * n);
  for (std::size_t c = 0; c < 3 * n; ++c) {
    std::fill(unit.begin(), unit.end(), 0.0);
    unit[4 * (c / 3) + c % 3] = 1.0;
    std::fill(column.begin(), column.end(), 0.0);
    product(unit, [&](std::span<const double> y, double s) {
      for (std::size_t i = 0; i < y.size(); ++i) column[i] += s * y[i];
    });
    for (std::size_t r = 0; r < 3 * n; ++r)
      A(static_cast<long>(r), static_cast<long>(c)) =
          column[4 * (r / 3) + r % 3] *
          std::sqrt(inverse_mass[4 * (r / 3)] * inverse_mass[4 * (c / 3)]);
  }
  const double exact =
      std::sqrt(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(0.5 * (A + A.transpose()))
                    .eigenvalues()
                    .maxCoeff());
  const auto found = largest_frequency(inverse_mass, product, 20);
  SolidRun solid(setup);
  std::printf("omega %.6e, dense %.6e (%.1e), %d products\n", found.omega, exact,
              found.omega / exact - 1.0, found.products);
  EXPECT_NEAR(found.omega, exact,
              1e-3 * exact);  // Ritz values converge as the square of the vector's error
  EXPECT_NEAR(solid.stable_step(), 0.9 * 2.0 / exact, 1e-3 * 2.0 / exact);
}

TEST(Sleep, GivesTheSameBitsAsComputing) {
  const auto make = [](bool sleep) {
    auto setup = make_setup(make_block({.cells = {4, 4, 4}, .size = {0.1, 0.1, 0.1}}),
                            make_neo_hookean(1e6, 0.49, 1000.0));
    setup.assembly.viscosity = {};
    setup.control.sleep = sleep;
    setup.pressures.push_back({.facets = setup.mesh->face_sets.at("z1"),
                               .pressure = {{0.0, 1e-3, 1.1e-3}, {0.0, 0.0, 5e4}}});
    return SolidRun(setup);
  };
  auto asleep = make(true);
  auto computing = make(false);
  for (int w = 1; w <= 20; ++w) {
    const Window window{.t_begin = 1e-4 * (w - 1), .t_end = 1e-4 * w};
    const bool idle = asleep.advance(window).idle;
    EXPECT_EQ(idle, w <= 10) << w;
    EXPECT_FALSE(computing.advance(window).idle);
  }
  EXPECT_EQ(asleep.state().displacement, computing.state().displacement);
  EXPECT_EQ(asleep.state().velocity, computing.state().velocity);
  EXPECT_GT(std::abs(asleep.state().displacement[asleep.state().displacement.size() - 2]), 0.0);
}

/// A block whose top is the interface to a flow that is not there.
SolidRun make_coupled_block(double quiet_overpressure) {
  auto setup = make_setup(make_block({.cells = {4, 4, 4}, .size = {0.1, 0.1, 0.1}}),
                          make_neo_hookean(1e6, 0.49, 1000.0));
  setup.control.quiet_overpressure = quiet_overpressure;
  setup.interface = setup.mesh->face_sets.at("z1");
  return SolidRun(setup);
}

TEST(Sleep, LeavesOutQuietLoadsOnlyWhenAskedToAndCountsThem) {
  // Noise of 1 Pa for ten windows, then a load of 1 kPa.
  const double window = 1e-5;
  auto exact = make_coupled_block(0.0);
  auto tolerant = make_coupled_block(2.0);
  auto silent = make_coupled_block(0.0);
  for (int w = 1; w <= 20; ++w) {
    const std::vector<double> noise(exact.interface_nodes().size(), w % 2 == 0 ? 1.0 : -0.5);
    const std::vector<double> load(noise.size(), 1000.0);
    const std::vector<double> zero(noise.size(), 0.0);
    const auto advance = [&](SolidRun& solid, const std::vector<double>& p) {
      return solid
          .advance({.t_begin = window * (w - 1),
                    .t_end = window * w,
                    .shape = InterfaceLoad::linear,
                    .overpressure = p})
          .idle;
    };
    EXPECT_FALSE(advance(exact, w <= 10 ? noise : load)) << w;
    EXPECT_EQ(advance(tolerant, w <= 10 ? noise : load), w <= 10) << w;
    EXPECT_EQ(advance(silent, w <= 10 ? zero : load), w <= 10) << w;
  }
  // What is left out counts as zero, to the bit.
  EXPECT_EQ(tolerant.state().velocity, silent.state().velocity);
  EXPECT_EQ(tolerant.sums().ignored_pressure, 1.0);
  EXPECT_NEAR(tolerant.sums().ignored_impulse, 10 * window * 0.75, 1e-18);
  EXPECT_EQ(silent.sums().ignored_impulse, 0.0);
  // And the speed it would have given stays below its impulse over the mass per area; the last
  // ramp reaches into the first window that counts by half of its length.
  double largest = 0.0;
  for (std::size_t i = 0; i < exact.state().velocity.size(); ++i)
    largest = std::max(largest, std::abs(exact.state().velocity[i] - tolerant.state().velocity[i]));
  const double bound = (tolerant.sums().ignored_impulse + 0.5 * window) / exact.mass_per_area(0.0);
  std::printf("speed left out %.2e m/s, bound %.2e m/s\n", largest, bound);
  EXPECT_LT(largest, bound);
  EXPECT_GT(largest, 0.0);
}

TEST(Sleep, LoadThatIsNotANumberDoesNotPassForSilence) {
  auto solid = make_coupled_block(2.0);
  const std::vector<double> lost(solid.interface_nodes().size(), std::nan(""));
  EXPECT_THROW(solid.advance({.t_begin = 0.0, .t_end = 1e-5, .overpressure = lost}), NumericsError);
}

TEST(FacetTable, OfEqualColumnsIsTheUniformPressure) {
  const Schedule pulse{{0.0, 1e-4, 3e-4}, {0.0, 5e3, 0.0}};
  const auto end_state = [&](bool by_facet) {
    auto setup = make_setup(make_ball(4, 0.012), make_neo_hookean(1e6, 0.45, 1000.0));
    PressureLoad load{.facets = setup.mesh->face_sets.at("x0"), .pressure = pulse};
    load.by_facet = by_facet;
    if (by_facet) load.of_facet.assign(load.facets.size(), pulse);
    setup.pressures.push_back(load);
    SolidRun solid(setup);
    run(solid, 4e-4, 8, [](double) {});
    return solid.state().velocity;
  };
  const auto uniform = end_state(false);
  const auto table = end_state(true);
  double largest = 0.0;
  double difference = 0.0;
  for (std::size_t i = 0; i < uniform.size(); ++i) {
    largest = std::max(largest, std::abs(uniform[i]));
    difference = std::max(difference, std::abs(uniform[i] - table[i]));
  }
  std::printf("speed %.3f m/s, difference %.1e\n", largest, difference);
  EXPECT_GT(largest, 0.01);
  EXPECT_LT(difference, 1e-12 * largest);  // another order of additions at nodes
}

TEST(FacetTable, GivesEveryFacetItsOwnImpulse) {
  // Four facets of a quarter of 0.01 m^2 each, of which only two are loaded, by triangles of 1 ms
  // up to 10 and -4 Pa: the top hardly moves, so that areas stay, and the momentum is their
  // impulse.
  auto setup = make_setup(make_block({.cells = {2, 2, 2}, .size = {0.1, 0.1, 0.1}}),
                          make_neo_hookean(1e6, 0.3, 1000.0));
  const auto& facets = setup.mesh->face_sets.at("z1");
  PressureLoad load{.facets = facets, .by_facet = true};
  load.of_facet.assign(facets.size(), Schedule{{0.0}, {0.0}});
  load.of_facet[1] = {{0.0, 5e-4, 1e-3}, {0.0, 10.0, 0.0}};
  load.of_facet[2] = {{0.0, 5e-4, 1e-3}, {0.0, -4.0, 0.0}};
  setup.pressures.push_back(load);
  SolidRun solid(setup);
  const double error = run(solid, 1.5e-3, 15, [](double) {});
  const auto momentum = solid.momenta();
  const double area = 0.0025;
  const double p1 = 10.0 * area * 5e-4;  // N s
  const double p2 = -4.0 * area * 5e-4;
  std::printf("momentum %.9e N s of %.9e, energy error %.1e\n", momentum[2], -p1 - p2, error);
  EXPECT_NEAR(momentum[2], -p1 - p2, 1e-4 * p1);  // areas change by strains of 1e-5
  // Moments about x and y of forces at the facets' centres, 0.025 and 0.075 m from the edges.
  const auto centre = [&](std::size_t f, std::size_t i) {
    double sum = 0.0;
    for (const auto n : facets[f])
      sum += 0.25 * solid.mesh().nodes[3 * static_cast<std::size_t>(n) + i];
    return sum;
  };
  EXPECT_NEAR(momentum[3], -p1 * centre(1, 1) - p2 * centre(2, 1), 1e-3 * p1 * 0.1);
  EXPECT_NEAR(momentum[4], p1 * centre(1, 0) + p2 * centre(2, 0), 1e-3 * p1 * 0.1);
}

TEST(Threads, DoNotChangeARun) {
  const auto end_state = [](int threads) {
    auto setup = make_setup(make_ball(6, 0.012), make_material("neo_hookean", 1e3, 2.25e9, 1000.0));
    setup.assembly.threads = threads;
    setup.assembly.viscosity = {};
    setup.assembly.chunk_elements = 16;
    setup.pressures.push_back(
        {.facets = setup.mesh->face_sets.at("wet"), .pressure = {{0.0}, {1e5}}});
    SolidRun solid(setup);
    solid.advance({.t_begin = 0.0, .t_end = 2e-5});
    return solid.state().velocity;
  };
  const auto one = end_state(1);
  EXPECT_EQ(one, end_state(2));
  EXPECT_EQ(one, end_state(3));
}

}  // namespace
}  // namespace ocublast::solid
