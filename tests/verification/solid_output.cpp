#include <gtest/gtest.h>

#include <cmath>

#include "coupler/base/hdf5_file.hpp"
#include "tests/support/solid_files.hpp"

// Everything the solid writes, of a block whose state is known: pressed by p on its top at rest,
// free at its sides, the Cauchy stress is -p along z and nothing else, whatever the law.

namespace ocublast::solid {
namespace {

using namespace test;

constexpr double p = 3e4;     // Pa
constexpr double bulk = 1e6;  // Pa
constexpr double shear = 1e5;

class SolidOutput : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder = new Folder;
    write_mesh(folder->path() / "mesh.h5",
               make_block({.cells = {2, 2, 2}, .size = {0.1, 0.1, 0.1}}));
    write_text(
        folder->path() / "case.toml",
        std::string(case_head) +
            "[time]\nend_s = 1e-3\n[solid]\nmesh = \"mesh.h5\"\n[[solid.material]]\nname = "
            "\"soft\"\ntissues = [\"block\"]\nlaw = \"neo_hookean\"\ndensity_kg_m3 = 1000.0\n"
            "shear_modulus_Pa = 1e5\nbulk_modulus_Pa = 1e6\n"
            "[[solid.symmetry]]\nnodes = \"x0\"\nnormal = [1.0, 0.0, 0.0]\n"
            "[[solid.symmetry]]\nnodes = \"y0\"\nnormal = [0.0, 1.0, 0.0]\n"
            "[[solid.symmetry]]\nnodes = \"z0\"\nnormal = [0.0, 0.0, 1.0]\n"
            "[[solid.pressure]]\nfaces = \"z1\"\ntimes_s = [0.0]\noverpressures_Pa = [3e4]\n"
            "[solid.initial]\nequilibrium = true\ntolerance = 1e-9\n"
            "[[solid.history]]\nname = \"body\"\ntissue = \"block\"\n"
            "[[solid.history]]\nname = \"place\"\nposition_m = [0.02, 0.03, 0.07]\n"
            "[[solid.history]]\nname = \"top\"\nnodes = \"z1\"\n"
            "[solid.output]\nevery_s = 1e-3\nhistory_every_s = 1e-3\nfields = [\"displacement\", "
            "\"velocity\", \"acceleration\", \"pressure\", \"von_mises\", \"stress\", "
            "\"principal_stress\", \"principal_strain\", \"principal_stresses\", "
            "\"principal_strains\", \"deviatoric_norm\", \"volume_ratio\", "
            "\"energy_density\"]\n");
    const auto path = folder->path().string();
    outcome = run_command(std::string(SOLID_SOLVER) + " " + path + "/case.toml --mesh-dir " + path +
                          " --out " + path + "/out");
    ASSERT_EQ(outcome.code, 0) << outcome.text;
  }
  static void TearDownTestSuite() { delete folder; }

  /// J of the law's pressure K/2 (J - 1/J) = -p/3.
  static double volume_ratio() {
    const double q = -p / (3.0 * bulk);
    return q + std::sqrt(1.0 + q * q);
  }
  /// Stretches along z and across: G J^(-5/3) (a^2 - b^2) = -p with a b^2 = J, by bisection.
  static std::array<double, 2> stretches() {
    const double J = volume_ratio();
    double low = 0.5;
    double high = 1.0;
    for (int k = 0; k < 100; ++k) {
      const double a = 0.5 * (low + high);
      (shear * std::pow(J, -5.0 / 3.0) * (a * a - J / a) < -p ? low : high) = a;
    }
    return {low, std::sqrt(J / low)};
  }
  static double energy_density() {
    const double J = volume_ratio();
    const auto [a, b] = stretches();
    return 0.5 * shear * (std::pow(J, -2.0 / 3.0) * (a * a + 2.0 * b * b) - 3.0) +
           0.25 * bulk * (J * J - 1.0 - 2.0 * std::log(J));
  }
  struct Scalar {
    std::string name;
    std::string unit;
    double value;
    double scale;  ///< what rounding is to be compared with
  };
  /// What a cell's scalars are.
  static std::vector<Scalar> exact() {
    const double across = stretches()[1];
    return {{"pressure", "Pa", p / 3.0, p},
            {"von_mises", "Pa", p, p},
            {"principal_stress", "Pa", 0.0, p},
            {"principal_strain", "1", across - 1.0, 1.0},
            {"deviatoric_norm", "Pa", std::sqrt(2.0 / 3.0) * p, p},
            {"volume_ratio", "1", volume_ratio(), 1.0},
            {"energy_density", "J_m3", energy_density(), energy_density()}};
  }

  static Folder* folder;
  static Outcome outcome;
};
Folder* SolidOutput::folder = nullptr;
Outcome SolidOutput::outcome;

// The equilibrium is found to 1e-9 of the load, tables have ten digits, fields seven.
constexpr double table_rounding = 1e-7;
constexpr double field_rounding = 1e-6;

TEST_F(SolidOutput, TissueTableHasLeastMeanAndLargestOfEveryScalar) {
  const auto table = read_csv(folder->path() / "out" / "solid_probes.csv");
  for (const auto& scalar : exact())
    for (const char* statistic : {"min", "mean", "max"}) {
      const auto column = "body_" + scalar.name + "_" + statistic + "_" + scalar.unit;
      ASSERT_TRUE(table.contains(column)) << column;
      EXPECT_NEAR(table.at(column).front(), scalar.value, table_rounding * scalar.scale) << column;
    }
}

TEST_F(SolidOutput, PlaceAndNodeTablesHaveTheirs) {
  const auto table = read_csv(folder->path() / "out" / "solid_probes.csv");
  for (const auto& scalar : exact())
    EXPECT_NEAR(table.at("place_" + scalar.name + "_" + scalar.unit).front(), scalar.value,
                table_rounding * scalar.scale)
        << scalar.name;
  EXPECT_NEAR(table.at("top_displacement_z_m").front(), 0.1 * (stretches()[0] - 1.0), 1e-8);
  for (const char* column : {"top_velocity_z_m_s", "top_acceleration_z_m_s2"})
    EXPECT_NEAR(table.at(column).front(), 0.0, 1e-3) << column;
}

TEST_F(SolidOutput, GlobalTableHasAllEnergiesAndMomenta) {
  const auto table = read_csv(folder->path() / "out" / "solid_globals.csv");
  for (const char* column :
       {"kinetic_J", "internal_J", "hourglass_J", "viscous_J", "relaxation_J", "spring_J",
        "damping_J", "external_work_J", "coupling_work_J", "initial_J", "energy_error_1",
        "momentum_x_N_s", "angular_momentum_z_N_m_s", "stable_step_s"})
    EXPECT_TRUE(table.contains(column)) << column;
  const double energy = 1e-3 * energy_density();
  EXPECT_NEAR(table.at("internal_J").front(), energy, table_rounding * energy);
  for (const double error : table.at("energy_error_1")) EXPECT_LT(std::abs(error), 1e-3);
}

TEST_F(SolidOutput, FieldsHoldTheSameNumbers) {
  const auto file = Hdf5File::open(folder->path() / "out" / "solid" / "0000.h5");
  for (const auto& scalar : exact())
    for (const double v : file.read<double>("hex8/" + scalar.name))
      EXPECT_NEAR(v, scalar.value, field_rounding * scalar.scale) << scalar.name;
  const auto stresses = file.read<double>("hex8/principal_stresses");
  const auto strains = file.read<double>("hex8/principal_strains");
  const auto [along, across] = stretches();
  ASSERT_EQ(stresses.size(), 24u);
  for (std::size_t i = 0; i < stresses.size(); ++i) {
    EXPECT_NEAR(stresses[i], i % 3 == 2 ? -p : 0.0, field_rounding * p);
    EXPECT_NEAR(strains[i], (i % 3 == 2 ? along : across) - 1.0, field_rounding);
  }
  for (const double v : file.read<double>("acceleration")) EXPECT_NEAR(v, 0.0, 1e-3);
}

TEST_F(SolidOutput, EveryFieldAndKeyIsListedAndTheBoundOfTheStepNamed) {
  const auto keys = run_command(std::string(SOLID_SOLVER) + " --list-keys").text;
  for (const char* word : {"acceleration", "principal_stresses", "principal_strains",
                           "deviatoric_norm", "volume_ratio", "energy_density", "solid.pressure",
                           "table", "quiet_overpressure_Pa", "solid.history", "checkpoint_every_s"})
    EXPECT_NE(keys.find(word), std::string::npos) << word << "\n" << keys;
  EXPECT_NE(outcome.text.find("bounded by hex8"), std::string::npos) << outcome.text;
  const auto summary = read_text(folder->path() / "out" / "solid_summary.json");
  for (const char* word : {"solid_bounded_by", "of block at", "solid_ignored_overpressure"})
    EXPECT_NE(summary.find(word), std::string::npos) << word;
}

}  // namespace
}  // namespace ocublast::solid
