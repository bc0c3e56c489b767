#include "coupler/base/case_reader.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "coupler/base/case_common.hpp"
#include "coupler/base/errors.hpp"

namespace ocublast {
namespace {

struct Numbers {
  double cfl = 0.9;
  double spacing = 0.0;
};

void read_numbers(CaseReader& reader, Numbers& numbers) {
  auto flow = reader.section("flow");
  flow.real("cfl", numbers.cfl,
            {.unit = "1",
             .min = 0.0,
             .max = 1.0,
             .above_min = true,
             .help = "Courant number",
             .advice = "start from 0.4"});
  flow.table("grid").real(
      "spacing_m", numbers.spacing,
      {.unit = "m", .min = 0.0, .above_min = true, .required = true, .help = "spacing"});
}

class CaseReaderTest : public ::testing::Test {
 protected:
  std::filesystem::path file_ = std::filesystem::temp_directory_path() /
                                ("ocublast_case_" + std::to_string(getpid()) + ".toml");
  void TearDown() override { std::filesystem::remove(file_); }
  CaseReader read(const std::string& text, std::vector<std::string> overrides = {}) {
    std::ofstream(file_) << text;
    return CaseReader(
        {.case_file = file_, .overrides = std::move(overrides), .mesh_directory = {}});
  }
  static std::string faults_of(CaseReader& reader) {
    try {
      reader.finish();
    } catch (const CaseError& error) {
      return error.what();
    }
    return {};
  }
};

TEST_F(CaseReaderTest, ReadsValuesAndKeepsDefaults) {
  auto reader = read("[flow]\ngrid.spacing_m = 0.5\n");
  Numbers numbers;
  read_numbers(reader, numbers);
  EXPECT_EQ(faults_of(reader), "");
  EXPECT_EQ(numbers.spacing, 0.5);
  EXPECT_EQ(numbers.cfl, 0.9);
  EXPECT_NE(reader.effective().find("cfl = 0.9"), std::string::npos);
}

TEST_F(CaseReaderTest, ShowsEveryFaultWithLineFoundAndAccepted) {
  auto reader = read("[flow]\ncfl = 1.4\n[flow.grid]\nspacing_mm = 1\n");
  Numbers numbers;
  read_numbers(reader, numbers);
  const std::string faults = faults_of(reader);
  EXPECT_NE(faults.find(":2: flow.cfl: cfl is 1.4, accepted (0, 1]; start from 0.4"),
            std::string::npos)
      << faults;
  EXPECT_NE(faults.find("flow.grid.spacing_m: missing"), std::string::npos) << faults;
  EXPECT_NE(faults.find(":4: flow.grid.spacing_mm: no such key; did you mean 'spacing_m'?"),
            std::string::npos)
      << faults;
}

TEST_F(CaseReaderTest, AppliesPresetThenOverrides) {
  const std::string text =
      "[case]\nresolution = \"coarse\"\n[flow]\ngrid.spacing_m = 1.0\n"
      "[resolution.coarse]\n\"flow.grid.spacing_m\" = 2.0\n"
      "[resolution.fine]\n\"flow.grid.spacing_m\" = 0.25\n\"flow.cfl\" = 0.5\n";
  Numbers coarse;
  auto reader = read(text);
  read_numbers(reader, coarse);
  EXPECT_EQ(coarse.spacing, 2.0);
  Numbers fine;
  auto other = read(text, {"case.resolution=fine", "flow.cfl=0.7"});
  read_numbers(other, fine);
  EXPECT_EQ(fine.spacing, 0.25);
  EXPECT_EQ(fine.cfl, 0.7);
  EXPECT_NE(reader.hash(), other.hash());
}

TEST_F(CaseReaderTest, RefusesAnUnknownTableAndNamesTheNearest) {
  auto reader = read(
      "[case]\nname='a'\ntitle='b'\n[time]\nend_s=1\n[ambient]\npressure_Pa=1e5\n"
      "temperature_K=300\n[flw]\nx=1\n");
  static_cast<void>(read_case_common(reader));
  EXPECT_NE(faults_of(reader).find("flw: no such table; did you mean 'flow'?"), std::string::npos);
}

TEST_F(CaseReaderTest, ListsEveryDeclaredKeyWithItsUnit) {
  auto reader = CaseReader::make_listing();
  Numbers numbers;
  read_numbers(reader, numbers);
  EXPECT_NE(reader.key_list().find("flow.grid.spacing_m  number in m"), std::string::npos);
}

}  // namespace
}  // namespace ocublast
