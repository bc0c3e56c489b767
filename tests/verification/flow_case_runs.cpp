// Whole runs of the program from a case text: boundaries by their keys against exact answers, and
// what a failed step leaves behind.

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "flow_solver/io/run.hpp"

namespace ocublast::flow {
namespace {

constexpr double g = 1.4, R = 287.05, p1 = 1e5, T1 = 300.0;
const double c1 = std::sqrt(g * R * T1);

const char* const head = R"(
[case]
name = "tube"
title = "a tube"
[ambient]
pressure_Pa = 1.0e5
temperature_K = 300.0
[flow.gas]
heat_capacity_ratio = 1.4
gas_constant_J_per_kgK = 287.05
)";

class CaseRun : public ::testing::Test {
 protected:
  std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("ocublast_run_" + std::to_string(getpid()));
  void SetUp() override { std::filesystem::create_directories(folder_); }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  int run(const std::string& text, const std::vector<std::string>& more = {}) {
    std::ofstream(folder_ / "case.toml") << head << text;
    const std::string file = folder_ / "case.toml", out = folder_ / "out";
    std::vector<std::string> words = {"flow_solver", file, "--out", out, "--quiet"};
    words.insert(words.end(), more.begin(), more.end());
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    return run_flow_solver(static_cast<int>(words.size()), argv.data());
  }
  /// Place of a column of a table of the run.
  std::size_t column(const std::string& table, const std::string& name) const {
    std::ifstream in(folder_ / "out" / table);
    std::string header, word;
    std::getline(in, header);
    std::stringstream words(header);
    std::size_t at = 0;
    while (std::getline(words, word, ',') && word != name) ++at;
    return at;
  }
  /// Last line of a table of the run as numbers.
  std::vector<double> last(const std::string& table) const { return mean_of_last(table, 1); }
  /// Mean of the last `count` lines.
  std::vector<double> mean_of_last(const std::string& table, std::size_t count) const {
    std::ifstream in(folder_ / "out" / table);
    std::vector<std::string> lines;
    for (std::string line; std::getline(in, line);) {
      if (!line.empty()) lines.push_back(line);
    }
    std::vector<double> mean;
    for (std::size_t k = lines.size() - count; k < lines.size(); ++k) {
      std::stringstream words(lines[k]);
      std::size_t at = 0;
      for (std::string word; std::getline(words, word, ','); ++at) {
        if (at == mean.size()) mean.push_back(0.0);
        mean[at] += std::stod(word) / static_cast<double>(count);
      }
    }
    return mean;
  }
};

/// Columns of a table with one probe.
enum ProbeColumn : std::size_t { overpressure = 1, rho = 2, speed = 3 };

/// Pressure behind a shock that moves the gas at speed u into rest (Toro 2009, eq. 3.63 and on).
double shock_pressure(double u) {
  const double m = (g + 1.0) / 4.0 * u / c1, mach = m + std::sqrt(1.0 + m * m);
  return p1 * (1.0 + 2.0 * g / (g + 1.0) * (mach * mach - 1.0));
}

std::string tube(const std::string& x_min, double end, const std::string& viscosity = "none") {
  return "viscosity = \"" + viscosity + "\"\n[time]\nend_s = " + std::to_string(end) +
         "\n[flow.grid.x]\nmin_m = 0.0\nmax_m = 1.0\nspacing_m = 0.005\n[flow.boundary]\nx_min = "
         "\"" +
         x_min + "\"\nx_max = \"outflow\"\n";
}
const char* const probe = "[[flow.probe]]\nname = \"gas\"\nposition_m = [0.25, 0.0, 0.0]\n";

TEST_F(CaseRun, SubsonicInflowDrivesTheShockOfItsSpeed) {
  ASSERT_EQ(run(tube("subsonic_inflow", 1.5e-3) +
                "[flow.boundary.x_min_state]\nvelocity_m_s = [150.0, 0.0, 0.0]\n" + probe),
            0);
  const auto v = last("probes.csv");
  const double p = v.at(overpressure) + p1, exact = shock_pressure(150.0);
  std::printf("subsonic inflow 150 m/s: pressure %.1f Pa, exact %.1f, velocity %.3f m/s\n", p,
              exact, v.at(speed));
  // 200 cells. The jump at the start leaves a shallow acoustic trace behind the shock: 0.1 % of the
  // pressure, which is 2 % of rho c u here, so 0.3 % of the velocity.
  EXPECT_NEAR(p, exact, 1e-3 * exact);
  EXPECT_NEAR(v.at(speed), 150.0, 0.45);
}

TEST_F(CaseRun, ReservoirFillsATubeAsTheRiemannProblemSays) {
  constexpr double p0 = 2e5;
  ASSERT_EQ(
      run(tube("reservoir", 1.5e-3) + "[flow.boundary.x_min_state]\npressure_Pa = 2.0e5\n" + probe),
      0);
  // Gas comes to the face at constant total enthalpy and entropy and drives a shock of the same
  // pressure and velocity (the contact between them keeps both).
  double low = 0.0, high = c1;
  for (int n = 0; n < 100; ++n) {
    const double u = 0.5 * (low + high), T = T1 - 0.5 * u * u * (g - 1.0) / (g * R);
    (p0 * std::pow(T / T1, g / (g - 1.0)) > shock_pressure(u) ? low : high) = u;
  }
  const double u = 0.5 * (low + high), p = shock_pressure(u);
  const auto v = last("probes.csv");
  std::printf("reservoir 2 bar: pressure %.1f Pa, exact %.1f; velocity %.3f m/s, exact %.3f\n",
              v.at(overpressure) + p1, p, v.at(speed), u);
  EXPECT_NEAR(v.at(overpressure) + p1, p, 2e-3 * p);
  EXPECT_NEAR(v.at(speed), u, 2e-3 * u);
}

TEST_F(CaseRun, TableBringsItsTemperaturesInWithTheStream) {
  // Supersonic at 700 m/s; a temperature ramp from 300 to 360 K in 1 ms is carried along unchanged.
  std::ofstream(folder_ / "inflow.csv")
      << "time_s,pressure_Pa,temperature_K,speed_m_s\n0,1e5,300,700\n1e-3,1e5,360,700\n";
  ASSERT_EQ(run(tube("supersonic_inflow", 1e-3) + "x_min_table = \"inflow.csv\"\n" +
                "[flow.initial.state]\nvelocity_m_s = [700.0, 0.0, 0.0]\n" + probe),
            0);
  const auto v = last("probes.csv");
  const double exact = 300.0 + 60.0 * (1e-3 - 0.25 / 700.0) / 1e-3;
  const double T = (v.at(overpressure) + p1) / (v.at(rho) * R);
  std::printf("table: temperature %.4f K, exact %.4f, velocity %.4f\n", T, exact, v.at(speed));
  // The ramp is taken at the ghosts' time but without their distance from the face: half to four
  // cells, of which the closure of the line sees the first: 0.0025 m / 700 m/s x 6e4 K/s = 0.2 K.
  EXPECT_NEAR(T, exact, 0.3);
  EXPECT_NEAR(v.at(overpressure), 0.0, 50.0);
}

TEST_F(CaseRun, PistonDrivesTheShockOfItsSpeed) {
  ASSERT_EQ(
      run(tube("piston", 1.2e-3) +
          "[flow.boundary.x_min_piston]\nposition_m = 0.0537\nvelocity_m_s = 100.0\n" + probe),
      0);
  const double exact = shock_pressure(100.0);
  // The second half of the 126 steps: the wall's pressure swings by 0.1 % (standard deviation) as
  // it passes nodes, seven times in 60 steps, which leaves 1e-4 of the mean at most.
  const auto v = mean_of_last("probes.csv", 60), force = mean_of_last("globals.csv", 60);
  // The slab's face has the area of the tube, 1 m^2 in one dimension, and the gas pushes it back.
  const double face = -force.at(column("globals.csv", "piston_x_min_force_x_N")) + p1;
  std::printf(
      "piston 100 m/s: pressure %.1f Pa and %.3f m/s at the probe, %.1f Pa at its face, exact "
      "%.1f\n",
      v.at(overpressure) + p1, v.at(speed), face, exact);
  EXPECT_NEAR(v.at(overpressure) + p1, exact, 5e-4 * exact);
  EXPECT_NEAR(v.at(speed), 100.0, 0.05);
  EXPECT_NEAR(face, exact, 5e-4 * exact);
}

TEST_F(CaseRun, RefusesAChargeInABody) {
  ::testing::internal::CaptureStderr();
  const int code =
      run(tube("piston", 1e-3) + "[flow.boundary.x_min_piston]\nposition_m = 0.1\n" +
          "[[flow.burst]]\nname = \"charge\"\ncenter_m = [0.05, 0.5, 0.5]\nradius_m = 0.02\n"
          "pressure_Pa = 1e6\ntemperature_K = 900.0\n");
  const std::string said = ::testing::internal::GetCapturedStderr();
  EXPECT_EQ(code, 2);
  EXPECT_NE(said.find("flow.burst 'charge': its centre (0.05, 0.5, 0.5) m lies inside a body"),
            std::string::npos)
      << said;
}

TEST_F(CaseRun, StopsAtAFailedStepWithACheckpointOfTheLastGoodOne) {
  // First-order fluxes are positive up to a Courant number of 1 only: at 1.2, without any other
  // help, a start with 1e13 Pa beside 1e5 Pa cannot be saved.
  const std::string text =
      tube("outflow", 1e-3) +
      "[flow.initial]\nkind = \"riemann\"\naxis = \"x\"\nposition_m = 0.5\n"
      "[flow.initial.left]\npressure_Pa = 1.0e13\n[flow.initial.right]\n"
      "[flow.numerics]\ncfl_direction = 1.2\nfilter = false\nartificial_diffusivity = false\n";
  ::testing::internal::CaptureStderr();
  const int code = run(text);
  const std::string said = ::testing::internal::GetCapturedStderr();
  std::printf("%s", said.c_str());
  ASSERT_EQ(code, 4);
  for (const char* part :
       {"cell (", "position (", "t = ", "density", "pressure", "the last good step"}) {
    EXPECT_NE(said.find(part), std::string::npos) << part;
  }
  const auto checkpoint = folder_ / "out" / "checkpoint";
  ASSERT_TRUE(std::filesystem::exists(checkpoint));
  // The state of that checkpoint is the good one: continuing from it fails at the same step again.
  const auto before = last("globals.csv");
  ::testing::internal::CaptureStderr();
  EXPECT_EQ(run(text, {"--resume", (folder_ / "out").string()}), 4);
  const std::string again = ::testing::internal::GetCapturedStderr();
  const auto step_of = [](const std::string& text_of) {
    const auto at = text_of.find("the step from");
    return text_of.substr(at, text_of.find("; state before", at) - at);
  };
  EXPECT_EQ(step_of(said), step_of(again));
  EXPECT_EQ(before, last("globals.csv"));
}

}  // namespace
}  // namespace ocublast::flow
