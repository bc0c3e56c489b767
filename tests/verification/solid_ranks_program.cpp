// The program under mpirun: files, checkpoints, refusals and failures.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "coupler/base/hdf5_file.hpp"
#include "tests/support/mpirun.hpp"
#include "tests/support/solid_files.hpp"

namespace ocublast::solid {
namespace {

using namespace test;
using ocublast::test::run_ranks;

std::string case_text(double peak, const std::string& more = "") {
  return std::string(case_head) + "[time]\nend_s = 2e-4\n[solid]\nmesh = \"ball.h5\"\n" +
         case_material +
         "[[solid.pressure]]\nfaces = \"x0\"\ntimes_s = [0.0, 5e-5, 1e-4]\noverpressures_Pa = "
         "[0.0, " +
         std::to_string(peak) +
         ", 0.0]\n[solid.output]\nevery_s = 1e-4\nhistory_every_s = 1e-5\ncheckpoint_every_s = "
         "1e-4\n"
         "[[solid.history]]\nname = \"ball\"\ntissue = \"block\"\n"
         "[[solid.history]]\nname = \"place\"\nposition_m = [0.004, 0.0, 0.001]\n"
         "[[solid.history]]\nname = \"side\"\nnodes = \"y1\"\n" +
         more;
}

Folder* make_folder(const std::string& text) {
  auto* folder = new Folder;
  write_mesh(folder->path() / "ball.h5", make_ball(4, 0.012));
  write_text(folder->path() / "case.toml", text);
  // Every facet of y0 its own pressure, in a pulse of 0.1 ms.
  std::string titles = "time_s";
  std::string peak = "5e-5";
  std::string none;
  for (int f = 0; f < 16; ++f) {
    titles += ",facet_" + std::to_string(f) + "_Pa";
    peak += ", " + std::to_string(100.0 * f * f);
    none += ",0.0";
  }
  write_text(folder->path() / "facets.csv",
             titles + "\n0.0" + none + "\n" + peak + "\n1e-4" + none + "\n");
  return folder;
}

/// Runs the case of a folder on n ranks (1: without mpirun).
ocublast::test::Outcome run_solid(const Folder& folder, int n, const std::string& out,
                                  const std::string& more = "") {
  const auto path = folder.path().string();
  const std::string command = std::string(SOLID_SOLVER) + " " + path + "/case.toml --mesh-dir " +
                              path + " --out " + path + "/" + out + " --threads 1 --quiet " + more;
  return n == 1 ? ocublast::test::run_command(command) : run_ranks(n, command);
}

int count(const std::string& text, const std::string& part) {
  int n = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++n;
  return n;
}

TEST(SolidRanksProgram, WritesTheFilesOfOne) {
  const std::unique_ptr<Folder> folder(
      make_folder(case_text(2e4, "[[solid.pressure]]\nfaces = \"y0\"\ntable = \"facets.csv\"\n")));
  for (const int n : {1, 2}) {
    const auto outcome = run_solid(*folder, n, std::to_string(n));
    ASSERT_EQ(outcome.code, 0) << outcome.output;
  }
  const auto one = folder->path() / "1";
  const auto two = folder->path() / "2";
  EXPECT_EQ(read_text(one / "solid.xmf"), read_text(two / "solid.xmf"));
  double worst = 0.0;
  for (const char* table : {"solid_globals.csv", "solid_probes.csv"}) {
    const auto a = read_csv(one / table);
    const auto b = read_csv(two / table);
    for (const auto& [name, values] : a) {
      ASSERT_EQ(values.size(), b.at(name).size()) << name;
      if (name == "energy_error_1") continue;  // a difference of nothing
      // Columns of one unit share a scale: some vanish by symmetry.
      double scale = 0.0;
      const auto unit = name.substr(name.find_last_of('_'));
      for (const auto& [other, column] : a)
        if (other.ends_with(unit))
          for (const double v : column) scale = std::max(scale, std::abs(v));
      for (std::size_t i = 0; i < values.size(); ++i)
        worst = std::max(worst, std::abs(values[i] - b.at(name)[i]) / scale);
    }
  }
  std::printf("tables of two ranks less those of one: %.2g of the peaks\n", worst);
  EXPECT_LT(worst, 1e-9);  // written with ten digits
  const auto file_one = Hdf5File::open(one / "solid" / "0002.h5");
  const auto file_two = Hdf5File::open(two / "solid" / "0002.h5");
  for (const char* name : {"position", "velocity", "hex8/pressure"}) {
    const auto a = file_one.read<double>(name);
    const auto b = file_two.read<double>(name);
    ASSERT_EQ(a.size(), b.size());
    double scale = 0.0;
    double difference = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) {
      scale = std::max(scale, std::abs(a[i]));
      difference = std::max(difference, std::abs(a[i] - b[i]));
    }
    EXPECT_LE(difference, 1e-6 * scale) << name;  // single precision
  }
}

TEST(SolidRanksProgram, ResumesBitForBit) {
  const std::unique_ptr<Folder> folder(make_folder(case_text(2e4)));
  auto outcome = run_solid(*folder, 2, "whole");
  ASSERT_EQ(outcome.code, 0) << outcome.output;
  // The first checkpoint only, as after a kill between the two.
  std::filesystem::copy(folder->path() / "whole", folder->path() / "parted",
                        std::filesystem::copy_options::recursive);
  std::vector<std::filesystem::path> checkpoints;
  for (const auto& entry :
       std::filesystem::directory_iterator(folder->path() / "parted" / "checkpoint"))
    checkpoints.push_back(entry.path());
  std::sort(checkpoints.begin(), checkpoints.end());
  ASSERT_EQ(checkpoints.size(), 2u);
  std::filesystem::remove_all(checkpoints[1]);
  const auto resume = "--resume " + (folder->path() / "parted").string();
  outcome = run_solid(*folder, 3, "parted", resume);
  EXPECT_EQ(outcome.code, 2) << outcome.output;
  EXPECT_EQ(count(outcome.output, "written by 2 ranks of the solid, resumed with 3"), 1)
      << outcome.output;
  outcome = run_solid(*folder, 2, "parted", resume);
  ASSERT_EQ(outcome.code, 0) << outcome.output;
  for (const char* table : {"solid_globals.csv", "solid_probes.csv"})
    EXPECT_TRUE(read_text(folder->path() / "whole" / table) ==
                read_text(folder->path() / "parted" / table))
        << table;
}

TEST(SolidRanksProgram, EndsAllWhenAnElementOfOneInverts) {
  const std::unique_ptr<Folder> folder(make_folder(case_text(5e8)));
  const auto outcome = run_solid(*folder, 3, "out");
  EXPECT_EQ(outcome.code, 4) << outcome.output;
  EXPECT_EQ(count(outcome.output, "of tissue block inverted or lost at t ="), 1) << outcome.output;
}

TEST(SolidRanksProgram, TellsAFaultOfTheCaseOnce) {
  const std::unique_ptr<Folder> folder(
      make_folder(case_text(2e4, "[solid.integrator]\nsafety = 2.0\n")));
  auto outcome = run_solid(*folder, 2, "out");
  EXPECT_EQ(outcome.code, 2) << outcome.output;
  EXPECT_EQ(count(outcome.output, "safety is 2"), 1) << outcome.output;
  write_text(folder->path() / "case.toml", case_text(2e4));
  write_mesh(folder->path() / "ball.h5", make_ball(1, 0.012));
  outcome = run_solid(*folder, 2, "out");
  EXPECT_EQ(outcome.code, 2) << outcome.output;
  EXPECT_EQ(count(outcome.output, "2 ranks are too many for 1 cells"), 1) << outcome.output;
}

#ifdef COUPLER
TEST(SolidRanksProgram, CouplesAsOneDoes) {
  Folder folder;
  write_mesh(folder.path() / "ball.h5", make_ball(4, 0.012));
  write_text(
      folder.path() / "case.toml",
      std::string(case_head) + "[time]\nend_s = 2e-4\n[solid]\nmesh = \"ball.h5\"\n" +
          case_material +
          "[solid.output]\nevery_s = 1e-4\nhistory_every_s = 1e-6\n"
          "[[solid.history]]\nname = \"ball\"\ntissue = \"block\"\n"
          "[coupling]\n[flow]\npeak_Pa = 2e4\nduration_s = 1e-4\nstart_s = 2e-5\nstep_s = 1e-6\n");
  const auto path = folder.path().string();
  write_text(folder.path() / "two", "#!/bin/sh\n" + std::string("export ") +
                                        ocublast::test::mpi_environment + "\nexec mpirun -n 2 " +
                                        SOLID_SOLVER + " \"$@\"\n");
  std::filesystem::permissions(folder.path() / "two", std::filesystem::perms::owner_all);
  for (const auto& [out, solid] :
       {std::pair<std::string, std::string>{"1", SOLID_SOLVER}, {"2", path + "/two"}}) {
    const auto outcome =
        ocublast::test::run_command(std::string(COUPLER) + " " + path + "/case.toml --mesh-dir " +
                                    path + " --out " + path + "/" + out + " --flow " + TOY_FLOW +
                                    " --solid " + solid + " --threads-solid 1 --threads-flow 1");
    ASSERT_EQ(outcome.code, 0) << outcome.output;
  }
  const auto a = read_csv(folder.path() / "1" / "solid_probes.csv").at("ball_pressure_mean_Pa");
  const auto b = read_csv(folder.path() / "2" / "solid_probes.csv").at("ball_pressure_mean_Pa");
  ASSERT_EQ(a.size(), b.size());
  double scale = 0.0;
  double difference = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    scale = std::max(scale, std::abs(a[i]));
    difference = std::max(difference, std::abs(a[i] - b[i]));
  }
  std::printf("coupled on two ranks less on one: %.2g of the peak\n", difference / scale);
  EXPECT_GT(scale, 1e4);
  EXPECT_LT(difference, 1e-9 * scale);
}
#endif

}  // namespace
}  // namespace ocublast::solid
