#include "flow_solver/io/flow_case.hpp"

#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>
#include <unistd.h>

#include "coupler/base/errors.hpp"

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
      CaseReader reader({.case_file = file_, .overrides = std::move(overrides), .mesh_directory = {}});
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

TEST_F(FlowCaseTest, AcceptsTheSmallestCase) { EXPECT_EQ(faults(""), ""); }

TEST_F(FlowCaseTest, NamesTheNearestKeyForAnUnknownOne) {
  expect_fault("[flow.numerics]\nclf = 0.9\n", "flow.numerics.clf: no such key; did you mean 'cfl'?");
}

TEST_F(FlowCaseTest, NamesTheKeyWithTheRightUnit) {
  expect_fault("[[flow.probe]]\nname = 'a'\nposition_mm = [1, 2, 3]\n", "did you mean 'position_m'?");
}

TEST_F(FlowCaseTest, RefusesANegativePressureAndSaysWhatIsAccepted) {
  expect_fault("", "ambient.pressure_Pa: pressure_Pa is -5 Pa, accepted > 0 Pa", {"ambient.pressure_Pa=-5.0"});
}

TEST_F(FlowCaseTest, RefusesAStepAboveTheStabilityLimit) {
  expect_fault("[flow.numerics]\ncfl = 1.9\n", "cfl is 1.9, accepted (0, 1.2]; start from 0.9");
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
  expect_fault("[[flow.body]]\nname = 'globe'\nmotion = 'coupled'\n", "a body in a domain with a periodic",
               {"flow.boundary.x_min=periodic", "flow.boundary.x_max=periodic"});
}

TEST_F(FlowCaseTest, RefusesPlacesOutsideTheGrid) {
  expect_fault("[[flow.probe]]\nname = 'a'\nposition_m = [1.5, 0, 0]\n",
               "x = 1.5 m lies outside the grid, accepted [0, 1]");
  expect_fault("[[flow.burst]]\ncenter_m = [-0.5, 0, 0]\nradius_m = 0.1\nenergy_J = 1.0\ntemperature_K = 500.0\n",
               "x = -0.5 m lies outside the grid");
}

TEST_F(FlowCaseTest, RefusesABurstWithEnergyAndPressure) {
  expect_fault("[[flow.burst]]\ncenter_m = [0.5, 0, 0]\nradius_m = 0.1\nenergy_J = 1.0\npressure_Pa = 2e5\n"
               "temperature_K = 500.0\n", "give either energy_J or pressure_Pa");
}

TEST_F(FlowCaseTest, ShowsAllFaultsTogether) {
  const std::string found = faults("", {"flow.gas.viscosity=honey", "flow.grid.x.max_m=-1.0", "time.end_s=0.0"});
  EXPECT_NE(found.find("flow.gas.viscosity"), std::string::npos) << found;
  EXPECT_NE(found.find("flow.grid.x.max_m"), std::string::npos) << found;
  EXPECT_NE(found.find("time.end_s"), std::string::npos) << found;
}

}  // namespace
}  // namespace ocublast::flow
