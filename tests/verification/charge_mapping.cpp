// The way of a spherical wave onto a grid: sums kept on coarse grids, waves from outside, refusals.

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "coupler/base/errors.hpp"
#include "flow_solver/io/charge_start.hpp"
#include "tests/verification/charge_trace.hpp"
#include "tests/verification/flow_run.hpp"

namespace ocublast::flow {
namespace {

const Gas air;
const State ambient{.rho = 1.225, .p = 101325.0};

TEST(WaveOnGrid, KeepsEnergyAndMassOnCoarseGrids) {
  BallWave ball(air, ambient, {.energy = 1e5, .radius = 0.05, .mass = 0.02}, 0.8,
                {.cells_per_ball = 12, .growth = 0.01});
  ball.run_to_front(0.35);
  JwlWave jwl(air, ambient, {}, 0.02, 0.5, {.charge_cells = 16, .air_growth = 0.03});
  jwl.run_to_front(0.35);
  for (const SteppedWave* wave :
       {static_cast<const SteppedWave*>(&ball), static_cast<const SteppedWave*>(&jwl)}) {
    for (const int n : {8, 12, 40}) {
      Grid whole = uniform_grid({n, n, n}, {-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5});
      Grid octant = uniform_grid({n, n, n}, {0, 0, 0}, {0.5, 0.5, 0.5});
      Grid rings = uniform_grid({n, n, 1}, {0, -0.5, 0}, {0.5, 0.5, 1});
      rings.geometry = Geometry::axisymmetric;
      const std::pair<const Grid*, double> grids[] = {
          {&whole, 1.0}, {&octant, 0.125}, {&rings, 1.0}};
      for (const auto& [grid, share] : grids) {
        const WaveOnGrid on = make_wave_on_grid(*grid, *wave, {0.0, 0.0, 0.0});
        double energy = 0.0, mass = 0.0, lowest = 1e300;
        std::size_t cell = 0;
        for (int k = 0; k < grid->axis[2].n; ++k)
          for (int j = 0; j < grid->axis[1].n; ++j)
            for (int i = 0; i < grid->axis[0].n; ++i) {
              const auto& c = on.change[cell++];
              energy += c[4] * cell_volume(*grid, i, j, k);
              mass += c[0] * cell_volume(*grid, i, j, k);
              const double rho = ambient.rho + c[0];
              lowest = std::min(lowest, c[4] + ambient.p / 0.4 -
                                            0.5 * (c[1] * c[1] + c[2] * c[2] + c[3] * c[3]) / rho);
            }
        const RadialTotals asked = wave->totals();
        std::printf("n %2d: energy %.9g J of %.9g, mass %.9g kg of %.9g\n", n, energy,
                    share * asked.energy, mass, share * asked.mass);
        // Corrected sums; the rest is round-off. (The limit asked for is 1e-3.)
        EXPECT_NEAR(energy / (share * asked.energy), 1.0, 1e-10);
        EXPECT_NEAR(mass / (share * asked.mass), 1.0, 1e-9);
        EXPECT_GT(lowest, 0.0);
      }
    }
  }
}

TEST(IncidentWaves, BringAFarChargeThroughTheOpenFace) {
  // A spherical shell of gas 2 to 3 m from 1 kg of TNT; the same wave computed from its source is
  // exact.
  const auto make = [] {
    auto wave = std::make_shared<BallWave>(air, ambient, tnt_ball(1.0, BurstKind::free_air), 3.3,
                                           RadialResolution{.cells_per_ball = 80, .growth = 0.001});
    wave->run_to_front(1.98);
    return wave;
  };
  const std::shared_ptr<BallWave> wave = make();
  const double start = wave->time();
  Grid grid = uniform_grid({200, 1, 1}, {2.0, 0, 0}, {3.0, 1, 1});
  grid.geometry = Geometry::spherical;
  const auto field = std::make_shared<IncidentWaves>(
      ambient, std::vector<PlacedWave>{{{0.0, 0.5, 0.5}, wave, 0.0}}, start);
  FlowOptions o;
  Flow flow(grid, all_faces(BoundaryKind::outflow, ambient), o);
  flow.set_state([](double, double, double) { return ambient; });
  field->cover(0.0, 0.0);
  flow.set_incoming(field);
  const double end = 1.4e-3;
  double t = 0.0;
  while (t < end * (1.0 - 1e-12)) {
    const double dt = std::min(flow.stable_step(), end - t);
    field->cover(t, t + dt);
    flow.advance(t, dt);
    t += dt;
  }
  double error = 0.0, size = 0.0, peak = 0.0, exact_peak = 0.0;
  for (int i = 0; i < 200; ++i) {
    const double r = grid.axis[0].x(i),
                 p = pressure(air, flow.primitives()(0, i, 0, 0), flow.primitives()(4, i, 0, 0));
    const double exact = wave->at(r, start + end).p;
    error += std::abs(p - exact);
    size += std::abs(exact - ambient.p);
    peak = std::max(peak, p - ambient.p);
    exact_peak = std::max(exact_peak, exact - ambient.p);
  }
  std::printf("incident wave: L1 of overpressure %.2f %%, peak %.2f of %.2f kPa\n",
              100.0 * error / size, peak * 1e-3, exact_peak * 1e-3);
  // Two schemes at about 0.5 cm: fronts of three to five cells on 50 cells of wave differ by a
  // cell; the largest value of the muscl front falls short by some 4.5 % (as the point blast below
  // prints).
  EXPECT_LT(error / size, 0.04);
  EXPECT_NEAR(peak / exact_peak, 1.0, 0.05);
}

/// Largest overpressure of 1 kg of TNT, prescribed at 4 m, at the first node beyond 5 m of a
/// spherical line of cells of h, over that of the curve there, less one.
double receive_on_a_line(double h, Scheme scheme) {
  Grid grid = uniform_grid({static_cast<int>(std::lround(2 / h)), 1, 1}, {4.0, 0, 0}, {6.0, 1, 1});
  grid.geometry = Geometry::spherical;
  const auto wave =
      std::make_shared<PrescribedWave>(air, ambient, BurstKind::free_air, 1.0, 3.9, 6.2);
  const double start = .99 * kingery_bulmash(BurstKind::free_air, BlastQuantity::arrival_time, 4.0);
  const auto field = std::make_shared<IncidentWaves>(
      ambient, std::vector<PlacedWave>{{{0.0, 0.5, 0.5}, wave, 0.0}}, start);
  FlowOptions o;
  o.scheme = scheme;
  Flow flow(grid, all_faces(BoundaryKind::outflow, ambient), o);
  flow.set_state([](double, double, double) { return ambient; });
  field->cover(0.0, 0.0);
  flow.set_incoming(field);
  const int i = static_cast<int>(1.0 / h);
  double t = 0.0, peak = 0.0;
  while (t < 5e-3) {
    const double dt = flow.stable_step();
    field->cover(t, t + dt);
    flow.advance(t, dt);
    t += dt;
    peak =
        std::max(peak, pressure(air, flow.primitives()(0, i, 0, 0), flow.primitives()(4, i, 0, 0)) -
                           ambient.p);
  }
  return peak / kingery_bulmash(BurstKind::free_air, BlastQuantity::incident_pressure,
                                grid.axis[0].x(i)) -
         1;
}

TEST(IncidentWaves, BringAPrescribedFrontThroughOneFace) {
  double muscl_last = 1.0;
  for (const double h : {.04, .02, .01, .005}) {
    const double own = receive_on_a_line(h, Scheme::compact6),
                 muscl = receive_on_a_line(h, Scheme::muscl);
    std::printf(
        "prescribed wave of 1 kg, 4 to 5 m, cells of %2.0f mm: largest value %+.1f %% (muscl %+.1f "
        "%%)\n",
        1e3 * h, 100 * own, 100 * muscl);
    // What the front's width takes from the peak and the overshoot of a sharp front, of a few per
    // cent each.
    EXPECT_LT(std::abs(own), .08);
    // A front without overshoot loses height with the cell.
    EXPECT_LT(std::abs(muscl), muscl_last);
    muscl_last = std::abs(muscl);
  }
  EXPECT_LT(muscl_last, .05);  // the aim for charges
}

TEST(PrescribedWave, GivesTheCurvesAtTheFront) {
  const PrescribedWave wave(air, ambient, BurstKind::free_air, 8.0, 4.0, 30.0);
  for (const double r : {5.0, 9.0, 20.0}) {
    const double t =
        2.0 * kingery_bulmash(BurstKind::free_air, BlastQuantity::arrival_time, 0.5 * r);
    const double p =
        kingery_bulmash(BurstKind::free_air, BlastQuantity::incident_pressure, 0.5 * r);
    // Linear between curves 1 % of r apart: below 1e-4, and 1e-6 of the duration past the front.
    EXPECT_NEAR((wave.at(r, t * (1.0 + 1e-4)).p - ambient.p) / p, 1.0, 2e-3);
    EXPECT_EQ(wave.at(r, 0.99 * t).p, ambient.p);
  }
}

class ChargeCaseTest : public ::testing::Test {
 protected:
  std::filesystem::path file_ = std::filesystem::temp_directory_path() /
                                ("ocublast_charge_case_" + std::to_string(getpid()) + ".toml");
  void TearDown() override { std::filesystem::remove(file_); }

  /// What reading a case with this charge, and starting it, refuses; empty when it is accepted.
  std::string refusal(const std::string& charge, const std::string& y_min = "outflow",
                      const std::vector<Body>& bodies = {}) {
    std::ofstream file(file_);
    file << "[case]\nname = \"c\"\ntitle = \"t\"\n[time]\nend_s = 1e-3\n[ambient]\npressure_Pa = "
            "101325.0\n"
            "temperature_K = 288.15\n[flow.gas]\nheat_capacity_ratio = 1.4\ngas_constant_J_per_kgK "
            "= 287.05\n"
            "viscosity = \"none\"\n";
    for (const char a : {'x', 'y', 'z'})
      file << "[flow.grid." << a << "]\nmin_m = 0.0\nmax_m = 1.0\nspacing_m = 0.1\n";
    file << "[flow.boundary]\nx_min = \"outflow\"\nx_max = \"outflow\"\ny_min = \"" << y_min
         << "\"\ny_max = \"outflow\"\nz_min = \"outflow\"\nz_max = \"outflow\"\n[[flow.charge]]\n"
         << charge;
    file.close();
    try {
      CaseReader reader({.case_file = file_, .overrides = {}, .mesh_directory = {}});
      const FlowCase read = read_flow_case(reader);
      reader.finish();
      static_cast<void>(start_charges(read, make_grid(read.axes), bodies));
    } catch (const CaseError& error) {
      return error.what();
    }
    return {};
  }
  void expect(const std::string& found, const std::string& text) {
    EXPECT_NE(found.find(text), std::string::npos) << "expected '" << text << "' in:\n" << found;
  }
};

TEST_F(ChargeCaseTest, RefusesWhatCannotBe) {
  const std::string jwl = "source = \"jwl\"\nmass_kg = 0.001\n";
  EXPECT_EQ(refusal(jwl + "center_m = [0.5, 0.5, 0.5]\nstart_radius_m = 0.05\n"), "");
  expect(refusal(jwl + "center_m = [0.5, 0.5, 0.5]\nburst = \"surface\"\n"),
         "the ground must be a symmetry face");
  expect(refusal(jwl + "center_m = [-1.0, 0.5, 0.5]\n", "symmetry"),
         "what that plane reflects outside");
  expect(refusal(jwl + "center_m = [0.5, 0.5, 0.5]\nstart_radius_m = 0.6\n"), "start_radius_m");
  expect(refusal("source = \"calibrated\"\nmass_kg = 10.0\ncenter_m = [0.5, 0.5, 0.5]\n"),
         "needs room");
  expect(refusal("source = \"kingery_bulmash\"\nmass_kg = 1.0\ncenter_m = [0.5, 0.5, 0.5]\n"),
         "lies inside the grid");
  expect(refusal("source = \"ball\"\nmass_kg = 1.0\ncenter_m = [0.5, 0.5, 0.5]\n"), "energy_J");
  expect(refusal("source = \"jwl\"\nmass_kg = -1.0\ncenter_m = [0.5, 0.5, 0.5]\n"), "mass_kg");
  expect(refusal("source = \"dynamite\"\nmass_kg = 1.0\ncenter_m = [0.5, 0.5, 0.5]\n"), "source");
}

Body box_body() {
  // A cube of 0.4 m about (0.5, 0.5, 0.5), outward triangles.
  Body body;
  body.name = "cube";
  for (int v = 0; v < 8; ++v)
    for (int a = 0; a < 3; ++a) body.surface.vertices.push_back(0.3 + 0.4 * ((v >> a) & 1));
  body.surface.triangles = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                            2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
  return body;
}

TEST_F(ChargeCaseTest, RefusesAChargeInABody) {
  for (const std::string source : {"jwl", "calibrated", "ball"}) {
    const std::string ball = source == "ball" ? "energy_J = 100.0\nradius_m = 0.01\n" : "";
    const std::string text =
        "source = \"" + source + "\"\nmass_kg = 0.001\ncenter_m = [0.5, 0.5, 0.45]\n" + ball;
    expect(refusal(text, "outflow", {box_body()}), "lies in flow.body 'cube'");
  }
}

TEST(SignedDistance, IsThatOfACube) {
  const BodySurface cube = box_body().surface;
  // Round-off of sums of twelve triangles.
  EXPECT_NEAR(signed_distance(cube, {0.9, 0.5, 0.5}), 0.2, 1e-12);
  EXPECT_NEAR(signed_distance(cube, {0.5, 0.45, 0.5}), -0.15, 1e-12);
  EXPECT_NEAR(signed_distance(cube, {0.8, 0.8, 0.5}), 0.1 * std::sqrt(2.0), 1e-12);
  EXPECT_NEAR(signed_distance(cube, {0.2, 0.2, 0.2}), 0.1 * std::sqrt(3.0), 1e-12);
}

}  // namespace
}  // namespace ocublast::flow
