#include "flow_solver/io/flow_case.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "coupler/base/errors.hpp"
#include "flow_solver/io/make_bodies.hpp"
#include "flow_solver/io/run.hpp"

namespace ocublast::flow {
namespace {

const char* const good_case = R"(
[case]
name = "tube"
title = "a tube"
[time]
end_s = 1e-3
[ambient]
pressure_Pa = 101325.0
temperature_K = 288.15
[flow.gas]
heat_capacity_ratio = 1.4
gas_constant_J_per_kgK = 287.05
viscosity = "none"
[flow.grid.x]
min_m = 0.0
max_m = 1.0
spacing_m = 0.01
[flow.boundary]
x_min = "symmetry"
x_max = "outflow"
)";

class FlowCaseTest : public ::testing::Test {
 protected:
  std::filesystem::path file_ = std::filesystem::temp_directory_path() /
                                ("ocublast_flow_case_" + std::to_string(getpid()) + ".toml");
  void TearDown() override { std::filesystem::remove(file_); }

  /// The faults of the good case with more text and overrides; empty when it is accepted.
  std::string faults(const std::string& more, std::vector<std::string> overrides = {}) {
    std::ofstream(file_) << good_case << more;
    try {
      CaseReader reader(
          {.case_file = file_, .overrides = std::move(overrides), .mesh_directory = {}});
      static_cast<void>(read_flow_case(reader));
      reader.finish();
    } catch (const CaseError& error) {
      return error.what();
    }
    return {};
  }
  void expect_fault(const std::string& more, const std::string& text,
                    std::vector<std::string> overrides = {}) {
    const std::string found = faults(more, std::move(overrides));
    EXPECT_NE(found.find(text), std::string::npos) << "expected '" << text << "' in:\n" << found;
  }
};

TEST_F(FlowCaseTest, AcceptsTheSmallestCase) {
  EXPECT_EQ(faults(""), "");
}

TEST_F(FlowCaseTest, NamesTheNearestKeyForAnUnknownOne) {
  expect_fault("[flow.numerics]\nclf = 0.9\n",
               "flow.numerics.clf: no such key; did you mean 'cfl'?");
}

TEST_F(FlowCaseTest, NamesTheKeyWithTheRightUnit) {
  expect_fault("[[flow.probe]]\nname = 'a'\nposition_mm = [1, 2, 3]\n",
               "did you mean 'position_m'?");
}

TEST_F(FlowCaseTest, RefusesANegativePressureAndSaysWhatIsAccepted) {
  expect_fault("", "ambient.pressure_Pa: pressure_Pa is -5 Pa, accepted > 0 Pa",
               {"ambient.pressure_Pa=-5.0"});
}

TEST_F(FlowCaseTest, RefusesAStepAboveTheStabilityLimit) {
  expect_fault("[flow.numerics]\ncfl = 1.9\n", "cfl is 1.9, accepted (0, 1.2]; start from 1.2");
}

TEST_F(FlowCaseTest, RefusesAMissingSurfaceFile) {
  expect_fault("[[flow.body]]\nname = 'plate'\nmotion = 'fixed'\nsurface = 'plate.h5'\n",
               "flow.body.surface: no such file: 'plate.h5'");
}

TEST_F(FlowCaseTest, RefusesNoSlipWithoutViscosity) {
  expect_fault("[[flow.body]]\nname = 'globe'\nmotion = 'coupled'\nslip = 'no_slip'\n",
               "no_slip needs flow.gas.viscosity");
}

TEST_F(FlowCaseTest, RefusesPeriodicWithoutItsPartnerAndBodiesAcrossIt) {
  expect_fault("", "periodic needs the opposite face", {"flow.boundary.x_min=periodic"});
  expect_fault("[[flow.body]]\nname = 'globe'\nmotion = 'coupled'\n",
               "a body in a domain with a periodic",
               {"flow.boundary.x_min=periodic", "flow.boundary.x_max=periodic"});
}

TEST_F(FlowCaseTest, RefusesPlacesOutsideTheGrid) {
  expect_fault("[[flow.probe]]\nname = 'a'\nposition_m = [1.5, 0, 0]\n",
               "x = 1.5 m lies outside the grid, accepted [0, 1]");
  expect_fault(
      "[[flow.burst]]\ncenter_m = [-0.5, 0, 0]\nradius_m = 0.1\nenergy_J = 1.0\ntemperature_K = "
      "500.0\n",
      "x = -0.5 m lies outside the grid");
}

TEST_F(FlowCaseTest, RefusesABurstWithEnergyAndPressure) {
  expect_fault(
      "[[flow.burst]]\ncenter_m = [0.5, 0, 0]\nradius_m = 0.1\nenergy_J = 1.0\npressure_Pa = 2e5\n"
      "temperature_K = 500.0\n",
      "give either energy_J or pressure_Pa");
}

TEST_F(FlowCaseTest, RefusesGridsThatDoNotRise) {
  const std::string nodes =
      "flow.grid.x.nodes_m=[0.05, 0.15, 0.25, 0.35, 0.45, 0.55, 0.65, 0.75, 0.85, ";
  EXPECT_EQ(faults("", {nodes + "0.95]"}), "");
  expect_fault("", "cell centre 10 is 0.8 m and follows 0.85 m: they must rise", {nodes + "0.8]"});
  expect_fault("", "cell centre 10 is 1.05 m, accepted (0, 1) m", {nodes + "1.05]"});
  expect_fault("", "the spacing changes from", {nodes + "0.99]"});
  expect_fault("", "holds 2 cell centres, accepted at least 8", {"flow.grid.x.nodes_m=[0.2, 0.7]"});
}

TEST_F(FlowCaseTest, RefusesInflowsThatAreNone) {
  const std::string state = "[flow.boundary.x_min_state]\nvelocity_m_s = ";
  expect_fault(state + "[300.0, 0, 0]\n", "supersonic_inflow needs more",
               {"flow.boundary.x_min=supersonic_inflow"});
  expect_fault(state + "[-10.0, 0, 0]\n", "for subsonic_inflow",
               {"flow.boundary.x_min=subsonic_inflow"});
  expect_fault(state + "[400.0, 0, 0]\n", "for subsonic_inflow",
               {"flow.boundary.x_min=subsonic_inflow"});
  expect_fault(state + "[1.0, 0, 0]\n", "gas in a reservoir is at rest",
               {"flow.boundary.x_min=reservoir"});
}

TEST_F(FlowCaseTest, RefusesWallsThatCannotBe) {
  expect_fault("", "a no_slip_wall needs flow.gas.viscosity", {"flow.boundary.x_min=no_slip_wall"});
  const std::string wall = "[flow.boundary.x_min_wall]\n";
  expect_fault(wall + "temperature_K = 300.0\n", "an isothermal wall needs flow.gas.viscosity",
               {"flow.boundary.x_min=slip_wall"});
  expect_fault(wall + "velocity_m_s = [1.0, 0, 0]\n", "a wall moves along itself; take piston",
               {"flow.boundary.x_min=no_slip_wall", "flow.gas.viscosity=constant"});
  expect_fault(wall + "temperature_K = 300.0\n", "only slip_wall and no_slip_wall have a wall");
}

TEST_F(FlowCaseTest, RefusesInflowTablesWithFaults) {
  const auto table = std::filesystem::temp_directory_path() /
                     ("ocublast_inflow_" + std::to_string(getpid()) + ".csv");
  const auto refused = [&](const std::string& text) {
    std::ofstream(table) << text;
    return faults(
        "", {"flow.boundary.x_min=fixed_state", "flow.boundary.x_min_table=" + table.string()});
  };
  const std::string header = "time_s,pressure_Pa,temperature_K,speed_m_s\n";
  EXPECT_EQ(refused(header + "0,1e5,300,0\n1e-3,2e5,360,100\n"), "");
  EXPECT_NE(refused("t,p\n0,1\n").find("line 1 must be"), std::string::npos);
  EXPECT_NE(refused(header + "0,1e5,300\n").find(":2: '0,1e5,300' is not four numbers"),
            std::string::npos);
  EXPECT_NE(refused(header + "1,1e5,300,0\n1,1e5,300,0\n").find("times must rise"),
            std::string::npos);
  EXPECT_NE(refused(header + "0,-1,300,0\n").find("both must be above 0"), std::string::npos);
  EXPECT_NE(refused(header).find("it has no points"), std::string::npos);
  std::filesystem::remove(table);
}

TEST_F(FlowCaseTest, RefusesPistonsWhereTheyCannotStand) {
  const std::vector<std::string> piston = {"flow.boundary.x_min=piston"};
  const std::string keys = "[flow.boundary.x_min_piston]\nposition_m = ";
  EXPECT_EQ(faults(keys + "0.1\n", piston), "");
  expect_fault(keys + "-0.1\n", "the cells behind it must reach as far as it ever recedes", piston);
  expect_fault(keys + "0.1\n[flow.grid.x.stretch_low]\ncells = 8\n",
               "a piston cannot stand in the stretched layer", piston);
  expect_fault(keys + "0.1\n[flow.numerics]\nskip_quiescent = true\n",
               "stir gas that would be skipped", piston);
}

TEST_F(FlowCaseTest, RefusesABodyThatTouchesAStretchedLayer) {
  std::ofstream(file_) << good_case
                       << "[flow.grid.x.stretch_high]\ncells = 8\n[[flow.body]]\nname = 'globe'\n"
                          "motion = 'coupled'\n";
  CaseReader reader({.case_file = file_, .overrides = {}, .mesh_directory = {}});
  const FlowCase flow_case = read_flow_case(reader);
  const auto refused = [&](double reach) {
    link::InterfaceMesh mesh;
    mesh.vertices = {0.5, 0, 0, reach, 0, 0, 0.5, 1, 0, 0.5, 0, 1};
    mesh.triangles = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
    try {
      static_cast<void>(make_bodies(flow_case, {&mesh, 1}));
    } catch (const CaseError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(refused(0.99), "");
  EXPECT_NE(refused(1.01).find(
                "flow.body 'globe': spans x = [0.5, 1.01] m and touches the stretched layer"),
            std::string::npos);
}

TEST_F(FlowCaseTest, RefusesAnIntervalThatMakesMillionsOfOutputs) {
  const std::string found =
      faults("", {"flow.output.every_s=1e-308", "flow.output.interface_every_s=0.0"});
  EXPECT_NE(found.find("flow.output.every_s"), std::string::npos) << found;
  EXPECT_NE(found.find("more than a million times"), std::string::npos) << found;
  EXPECT_EQ(found.find("interface_every_s"), std::string::npos) << found;
}

TEST_F(FlowCaseTest, ShowsAllFaultsTogether) {
  const std::string found =
      faults("", {"flow.gas.viscosity=honey", "flow.grid.x.max_m=-1.0", "time.end_s=0.0"});
  EXPECT_NE(found.find("flow.gas.viscosity"), std::string::npos) << found;
  EXPECT_NE(found.find("flow.grid.x.max_m"), std::string::npos) << found;
  EXPECT_NE(found.find("time.end_s"), std::string::npos) << found;
}

}  // namespace
}  // namespace ocublast::flow
