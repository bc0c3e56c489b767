#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "coupler/base/hdf5_file.hpp"
#include "solid_solver/mesh/mesh_check.hpp"
#include "tests/support/solid_files.hpp"
#include "tests/support/solid_materials.hpp"

namespace ocublast::solid {
namespace {

using namespace test;

SolidMesh block() {
  return make_block({.cells = {2, 2, 2}, .size = {0.1, 0.1, 0.1}});
}

Outcome check(const Folder& folder, const std::string& more, const SolidMesh& mesh = block()) {
  write_mesh(folder.path() / "mesh.h5", mesh);
  const auto path = folder.path().string();
  write_text(folder.path() / "case.toml",
             std::string(case_head) + "[time]\nend_s = 1e-3\n[solid]\nmesh = \"mesh.h5\"\n" + more);
  return run_command(std::string(SOLID_SOLVER) + " " + path + "/case.toml --mesh-dir " + path +
                     " --out " + path + "/out");
}

#define EXPECT_SAYS(outcome, words) \
  EXPECT_NE((outcome).text.find(words), std::string::npos) << (outcome).text

TEST(SolidBadInput, AllFaultsComeInOneMessage) {
  Folder folder;
  const auto outcome =
      check(folder,
            "[[solid.material]]\nname = \"a\"\ntissues = [\"jelly\"]\nlaw = "
            "\"neo_hookean\"\ndensity_kg_m3 = 1.0\n"
            "shear_modulus_Pa = 1e7\nbulk_modulus_Pa = 1e5\n"
            "[[solid.fixed]]\nnodes = \"bottom\"\ndirections = [\"w\"]\n"
            "[[solid.pressure]]\nfaces = \"lid\"\ntimes_s = [1.0, 0.0]\noverpressures_Pa = [1.0]\n"
            "[solid.integrator]\nsafty = 0.5\n");
  EXPECT_EQ(outcome.code, 2);
  EXPECT_SAYS(outcome, "has no tissue 'jelly'; it has block");
  EXPECT_SAYS(outcome, "tissue 'block' of the mesh has no material");
  EXPECT_SAYS(outcome, "is no density of a tissue");
  EXPECT_SAYS(outcome, "is below the shear modulus");
  EXPECT_SAYS(outcome, "no node set 'bottom'; it has x0");
  EXPECT_SAYS(outcome, "'w' is no direction");
  EXPECT_SAYS(outcome, "no face set 'lid'");
  EXPECT_SAYS(outcome, "2 times for 1 values");
  EXPECT_SAYS(outcome, "did you mean 'safety'");
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "out"));
}

TEST(SolidBadInput, MeshMaterialsSetsAndHoldsAreToldTogether) {
  // Every kind of fault at once: an inverted cell and one without volume, a loose node, a double
  // node, an unknown parameter, a bulk modulus below the shear modulus, a density in g/cm^3, a
  // missing set, a node moved twice.
  auto mesh = block();
  auto& hexes = mesh.of(Shape::hex8).nodes;
  std::swap(hexes[8 * 3 + 0], hexes[8 * 3 + 6]);
  for (std::size_t a = 4; a < 8; ++a) hexes[8 * 7 + a] = hexes[8 * 7 + a - 4];
  mesh.nodes.insert(mesh.nodes.end(), {0.5, 0.25, 0.125, 0.05, 0.05, 0.05});
  const std::string moved =
      "[[solid.prescribed]]\nnodes = \"z0\"\ndirection = \"z\"\ntimes_s = [0.0]\n"
      "displacements_m = [0.0]\n";
  Folder folder;
  const auto outcome =
      check(folder,
            "[[solid.material]]\nname = \"a\"\ntissues = [\"block\"]\nlaw = \"neo_hookean\"\n"
            "density_kg_m3 = 1.0\nshear_modulus_Pa = 1e7\nbulk_modulus_Pa = 1e5\n"
            "shear_modulus_kPa = 1.0\n[[solid.fixed]]\nnodes = \"bottom\"\n" +
                moved + moved,
            mesh);
  EXPECT_EQ(outcome.code, 2);
  EXPECT_SAYS(outcome, "2 inverted or zero-volume cells");
  EXPECT_SAYS(outcome, "hex8 3 in block at (0.075, 0.075, 0.025) m");
  EXPECT_SAYS(outcome, "hex8 7 in block");
  EXPECT_SAYS(outcome, "node 27 at (0.5, 0.25, 0.125) m");
  EXPECT_SAYS(outcome, "nodes 13 and 28 at (0.05, 0.05, 0.05) m");
  EXPECT_SAYS(outcome, "shear_modulus_kPa");
  EXPECT_SAYS(outcome, "is below the shear modulus");
  EXPECT_SAYS(outcome, "is no density of a tissue");
  EXPECT_SAYS(outcome, "no node set 'bottom'; it has x0");
  EXPECT_SAYS(outcome, "9 nodes are moved by two entries: node 0 in z");
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "out"));
}

TEST(SolidBadInput, FacetTableIsToldByLine) {
  Folder folder;
  const std::string load = "[[solid.pressure]]\nfaces = \"z1\"\ntable = \"table.csv\"\n";
  const auto outcome_of = [&](const std::string& table) {
    write_text(folder.path() / "table.csv", "time_s,a,b,c,d\n" + table);
    return check(folder, std::string(case_material) + load);
  };
  auto outcome =
      outcome_of("0.0,1,2,3,4\n1e-4,1,2,3\n1e-4,1,x,3,4\n-1.0,1,2,3,4\n2e-4,nan,2,3,4\n");
  EXPECT_EQ(outcome.code, 2);
  EXPECT_SAYS(outcome, "table.csv:3: 4 numbers, accepted 5: a time and one for each of 4 facets");
  EXPECT_SAYS(outcome, "table.csv:4: not a list of finite numbers");
  EXPECT_SAYS(outcome, "table.csv:5: time -1 s comes after 0 s");
  EXPECT_SAYS(outcome, "table.csv:6: not a list of finite numbers");
  EXPECT_EQ(outcome_of("").code, 2);
  EXPECT_EQ(outcome_of("0.0,1,2,3,4\n1e-3, 0, 0, 0, 0\n").code, 0);
  std::filesystem::remove(folder.path() / "table.csv");
  outcome = check(folder, std::string(case_material) + load);
  EXPECT_EQ(outcome.code, 2);
  EXPECT_SAYS(outcome, "table");
}

TEST(SolidBadInput, UnknownLawNamesTheKnownOnes) {
  Folder folder;
  const auto outcome = check(folder,
                             "[[solid.material]]\nname = \"a\"\ntissues = [\"block\"]\nlaw = "
                             "\"rubber\"\ndensity_kg_m3 = 1000.0\n");
  EXPECT_EQ(outcome.code, 2);
  EXPECT_SAYS(outcome, "neo_hookean");
}

TEST(SolidBadInput, InvertedCellIsNamedWithPlaceAndTissue) {
  Folder folder;
  auto mesh = block();
  std::swap(mesh.of(Shape::hex8).nodes[8 * 3 + 0], mesh.of(Shape::hex8).nodes[8 * 3 + 6]);
  const auto outcome = check(folder, case_material, mesh);
  EXPECT_EQ(outcome.code, 2);
  EXPECT_SAYS(outcome, "1 inverted or zero-volume cells");
  EXPECT_SAYS(outcome, "hex8 3 in block at (0.075, 0.075, 0.025) m");
}

TEST(SolidBadInput, LooseAndDoubleNodesAndWrongNumbersAreNamed) {
  auto loose = block();
  loose.nodes.insert(loose.nodes.end(), {0.0, 0.0, 0.0});
  const auto faults = check_mesh(loose);
  ASSERT_EQ(faults.size(), 2u);
  EXPECT_NE(faults[0].find("node 27 at (0, 0, 0) m"), std::string::npos) << faults[0];
  EXPECT_NE(faults[1].find("nodes 0 and 27"), std::string::npos) << faults[1];
  auto wrong = block();
  wrong.of(Shape::hex8).nodes[5] = 99;
  wrong.of(Shape::hex8).tissue[1] = 4;
  EXPECT_EQ(check_mesh(wrong).size(), 2u);
}

TEST(SolidBadInput, WetSurfaceMustBeClosedAndOutward) {
  auto open = block();
  open.face_sets["wet"].pop_back();
  EXPECT_NE(check_closed_surface(open, "wet").at(0).find("is not closed"), std::string::npos);
  auto turned = block();
  std::swap(turned.face_sets["wet"][0][1], turned.face_sets["wet"][0][3]);
  EXPECT_NE(check_closed_surface(turned, "wet").at(0).find("turned or repeated"),
            std::string::npos);
  auto inward = block();
  for (auto& f : inward.face_sets["wet"]) std::swap(f[1], f[3]);
  EXPECT_NE(check_closed_surface(inward, "wet").at(0).find("point inward"), std::string::npos);
  EXPECT_TRUE(check_closed_surface(block(), "wet").empty());
}

TEST(SolidBadInput, MissingFibresAreFoundBeforeTheStart) {
  const std::string cornea =
      "[[solid.material]]\nname = \"cornea\"\ntissues = [\"block\"]\nlaw = "
      "\"holzapfel_gasser_ogden\"\ndensity_kg_m3 = 1000.0\nshear_modulus_Pa = 1e5\n"
      "bulk_modulus_Pa = 1e7\nk1_Pa = 1e5\nk2 = 10.0\n"
      "dispersion = 0.1\n";
  Folder folder;
  auto outcome = check(folder, cornea);
  EXPECT_EQ(outcome.code, 2);
  EXPECT_SAYS(outcome, "law holzapfel_gasser_ogden of tissue 'block' needs two unit vectors");
  EXPECT_SAYS(outcome, "8 cells have none (the first is hex8 0)");
  auto mesh = block();
  mesh.fibres = make_fibres(mesh.n_cells());
  mesh.fibres[6 * 3] = 0.0;
  outcome = check(folder, cornea, mesh);
  EXPECT_EQ(outcome.code, 2);
  EXPECT_SAYS(outcome, "1 cells have none (the first is hex8 3)");
}

TEST(SolidBadInput, NodeMovedByTwoEntriesIsNamed) {
  Folder folder;
  const std::string entry =
      "[[solid.prescribed]]\nnodes = \"z0\"\ndirection = \"z\"\ntimes_s = [0.0]\ndisplacements_m = "
      "[0.0]\n";
  const auto outcome = check(folder, std::string(case_material) + entry + entry);
  EXPECT_EQ(outcome.code, 2);
  EXPECT_SAYS(outcome, "9 nodes are moved by two entries: node 0 in z");
}

TEST(SolidBadInput, MissingMeshAndForeignFileAreCaseErrors) {
  Folder folder;
  auto outcome = check(folder, case_material);
  std::filesystem::remove(folder.path() / "mesh.h5");
  const auto path = folder.path().string();
  const std::string command =
      std::string(SOLID_SOLVER) + " " + path + "/case.toml --mesh-dir " + path + " --check";
  EXPECT_EQ(run_command(command).code, 2);
  write_text(folder.path() / "mesh.h5", "not HDF5");
  outcome = run_command(command);
  EXPECT_EQ(outcome.code, 2);
  EXPECT_SAYS(outcome, "mesh.h5");
}

TEST(SolidBadInput, ElementThatInvertsStopsTheRunWithPlaceAndTime) {
  Folder folder;
  const auto outcome =
      check(folder,
            std::string(case_material) +
                "[[solid.pressure]]\nfaces = \"z1\"\ntimes_s = [0.0]\noverpressures_Pa = [5e8]\n");
  EXPECT_EQ(outcome.code, 4);
  EXPECT_SAYS(outcome, "of tissue block inverted");
  EXPECT_SAYS(outcome, "at t = ");
  EXPECT_SAYS(outcome, "last good checkpoint: none");
}

TEST(SolidBadInput, StoppedRunNamesItsLastGoodCheckpoint) {
  Folder folder;
  const auto outcome =
      check(folder,
            std::string(case_material) +
                "[[solid.pressure]]\nfaces = \"z1\"\ntimes_s = [0.0, 5e-4, 6e-4]\n"
                "overpressures_Pa = [1e3, 1e3, 5e8]\n[solid.output]\ncheckpoint_every_s = 2e-4\n");
  EXPECT_EQ(outcome.code, 4);
  EXPECT_SAYS(outcome, "of tissue block inverted");
  const std::string words = "last good checkpoint: ";
  ASSERT_NE(outcome.text.find(words), std::string::npos) << outcome.text;
  const auto from = outcome.text.find(words) + words.size();
  const auto named = outcome.text.substr(from, outcome.text.find_first_of("\n;", from) - from);
  EXPECT_TRUE(std::filesystem::exists(named)) << named;
}

TEST(SolidBadInput, LawsElementsAndHoldsAreCheckedTogether) {
  Folder folder;
  const auto outcome =
      check(folder,
            "[[solid.material]]\nname = \"a\"\ntissues = [\"block\"]\nlaw = \"ogden\"\n"
            "density_kg_m3 = 1000.0\nmu_1_Pa = -1e5\nalpha_1 = 2.0\nbulk_modulus_Pa = 1e8\n"
            "prony_ratios = [0.7, 0.4]\nprony_times_s = [1e-3]\n"
            "[[solid.group]]\ntissues = [\"block\"]\nelement = \"tet10\"\n"
            "[[solid.tie]]\nnodes = \"z0\"\nfaces = \"z1\"\nreach_m = 1e-6\n"
            "[[solid.wall]]\nnodes = \"z0\"\npoint_m = [0.0, 0.0, 0.0]\nnormal = [0.0, 0.0, 0.0]\n"
            "[[solid.contact]]\nfaces = \"z0\"\nagainst = \"ceiling\"\n"
            "[[solid.gravity]]\nacceleration_m_s2 = [0.0, 0.0, -9.81]\ntimes_s = [0.0, 1.0]\n"
            "factors = [1.0]\n");
  EXPECT_EQ(outcome.code, 2);
  EXPECT_SAYS(outcome, "shear modulus at zero strain is -100000 Pa");
  EXPECT_SAYS(outcome, "1 times for 2 ratios");
  EXPECT_SAYS(outcome, "sum is 1.1");
  EXPECT_SAYS(outcome, "tissue 'block' has no cells tet10; tet10 does not apply");
  EXPECT_SAYS(outcome, "no node lies within 1e-06 m of the faces");
  EXPECT_SAYS(outcome, "is zero");
  EXPECT_SAYS(outcome, "no face set 'ceiling'");
  EXPECT_SAYS(outcome, "2 times for 1 values");
}

TEST(SolidEquilibrium, CaseStartsFromItAndResumesBitForBit) {
  Folder folder;
  const std::string load =
      "[[solid.fixed]]\nnodes = \"z0\"\n"
      "[[solid.gravity]]\nacceleration_m_s2 = [0.0, 0.0, -9.81]\n"
      "[solid.initial]\nequilibrium = true\ntolerance = 1e-8\n"
      "[[solid.pressure]]\nfaces = \"z1\"\ntimes_s = [0.0, 1e-3]\noverpressures_Pa = [0.0, 1e3]\n"
      "[solid.output]\nhistory_every_s = 5e-5\ncheckpoint_every_s = 4e-4\n";
  const auto outcome = check(folder, std::string(case_material) + load);
  ASSERT_EQ(outcome.code, 0) << outcome.text;
  const auto first = read_text(folder.path() / "out" / "solid_globals.csv");
  const auto columns = read_csv(folder.path() / "out" / "solid_globals.csv");
  EXPECT_LT(columns.at("kinetic_J").front(), 1e-12 * columns.at("internal_J").front());
  EXPECT_GT(columns.at("displacement_largest_m").front(), 0.0);
  for (const double error : columns.at("energy_error_1")) EXPECT_LT(std::abs(error), 1e-3);
  const auto path = folder.path().string();
  const auto resumed =
      run_command(std::string(SOLID_SOLVER) + " " + path + "/case.toml --mesh-dir " + path +
                  " --out " + path + "/again --resume " + path + "/out");
  ASSERT_EQ(resumed.code, 0) << resumed.text;
  EXPECT_EQ(read_text(folder.path() / "again" / "solid_globals.csv"), first);
}

TEST(SolidBadInput, CoupledCaseWithoutCouplerSaysHowToStartIt) {
  Folder folder;
  const auto outcome = check(folder, std::string(case_material) + "[coupling]\n");
  EXPECT_EQ(outcome.code, 3);
  EXPECT_SAYS(outcome, "coupler");
}

TEST(SolidRestart, ContinuesBitForBit) {
  Folder folder;
  const std::string load =
      "[[solid.pressure]]\nfaces = \"z1\"\ntimes_s = [0.0, 1e-3]\noverpressures_Pa = [1e3, 0.0]\n"
      "[[solid.spring]]\nfaces = \"z0\"\nstiffness_Pa_m = 1e8\ndamping_Pa_s_m = 1e4\n"
      "[solid.output]\nevery_s = 2e-4\nhistory_every_s = 5e-5\ncheckpoint_every_s = 4e-4\n";
  const auto outcome = check(folder, std::string(case_material) + load);
  ASSERT_EQ(outcome.code, 0) << outcome.text;
  const auto path = folder.path().string();
  const auto first = read_text(folder.path() / "out" / "solid_globals.csv");
  // Again from the checkpoint at 0.4 ms: the later ones are taken away.
  std::filesystem::path last;
  std::vector<std::filesystem::path> checkpoints;
  for (const auto& entry :
       std::filesystem::directory_iterator(folder.path() / "out" / "checkpoint"))
    checkpoints.push_back(entry.path());
  std::sort(checkpoints.begin(), checkpoints.end());
  ASSERT_EQ(checkpoints.size(), 2u);
  std::filesystem::remove_all(checkpoints[1]);
  const auto resumed =
      run_command(std::string(SOLID_SOLVER) + " " + path + "/case.toml --mesh-dir " + path +
                  " --out " + path + "/again --resume " + path + "/out");
  ASSERT_EQ(resumed.code, 0) << resumed.text;
  EXPECT_TRUE(first == read_text(folder.path() / "again" / "solid_globals.csv"));
  EXPECT_GT(first.size(), 1000u);
  const auto last_field = [&](const char* run, const char* name) {
    return Hdf5File::open(folder.path() / run / "solid" / "0005.h5").read<float>(name);
  };
  for (const char* name : {"position", "velocity", "hex8/stress"})
    EXPECT_TRUE(last_field("out", name) == last_field("again", name)) << name;
}

}  // namespace
}  // namespace ocublast::solid
