#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "tests/support/solid_files.hpp"

namespace ocublast::solid {
namespace {

using namespace test;

constexpr double peak = 2e4;
constexpr double start = 2e-5;
constexpr double duration = 1e-4;
constexpr double step = 1e-6;
constexpr double end = 2e-4;

std::string solid_tables() {
  return std::string(case_head) + "[time]\nend_s = 2e-4\n[solid]\nmesh = \"ball.h5\"\n" +
         case_material +
         "[solid.output]\nevery_s = 1e-4\nhistory_every_s = 1e-6\n"
         "[[solid.history]]\nname = \"ball\"\ntissue = \"block\"\n";
}

/// A ball under the pulse, coupled to the toy flow.
void write_coupled(const Folder& folder, const std::string& coupling) {
  write_mesh(folder.path() / "ball.h5", make_ball(4, 0.012));
  write_text(folder.path() / "case.toml",
             solid_tables() + "[coupling]\n" + coupling +
                 "[flow]\npeak_Pa = 2e4\nduration_s = 1e-4\nstart_s = 2e-5\nstep_s = 1e-6\n");
}

Outcome run_coupler(const Folder& folder, const std::string& more = "") {
  const auto path = folder.path().string();
  return run_command(std::string(COUPLER) + " " + path + "/case.toml --mesh-dir " + path +
                     " --out " + path + "/out --flow " + TOY_FLOW + " --solid " + SOLID_SOLVER +
                     " --threads-solid 1 --threads-flow 1 " + more);
}

TEST(CoupledSolid, GivesTheMotionOfTheSameLoadBySchedule) {
  Folder folder;
  write_coupled(folder, "");
  const auto outcome = run_coupler(folder);
  ASSERT_EQ(outcome.code, 0) << outcome.text;
  // Alone: the piecewise linear schedule that the windows made of the pulse.
  std::string times = "0.0";
  std::string values = "0.0";
  for (int w = 1; w * step <= end * (1.0 + 1e-9); ++w) {
    const double t = w * step;
    const double p = t <= start || t >= start + duration
                         ? 0.0
                         : peak * std::sin(3.14159265358979323846 * (t - start) / duration);
    char text[64];
    std::snprintf(text, sizeof text, ", %.17g", t);
    times += text;
    std::snprintf(text, sizeof text, ", %.17g", p);
    values += text;
  }
  write_text(folder.path() / "alone.toml", solid_tables() +
                                               "[[solid.pressure]]\nfaces = \"wet\"\ntimes_s = [" +
                                               times + "]\noverpressures_Pa = [" + values + "]\n");
  const auto path = folder.path().string();
  const auto alone =
      run_command(std::string(SOLID_SOLVER) + " " + path + "/alone.toml --mesh-dir " + path +
                  " --out " + path + "/alone --threads 1");
  ASSERT_EQ(alone.code, 0) << alone.text;
  const auto a = read_csv(folder.path() / "out" / "solid_probes.csv");
  const auto b = read_csv(folder.path() / "alone" / "solid_probes.csv");
  const auto& p = a.at("ball_pressure_mean_Pa");
  const auto& q = b.at("ball_pressure_mean_Pa");
  ASSERT_EQ(p.size(), q.size());
  double largest = 0.0;
  double difference = 0.0;
  for (std::size_t i = 0; i < p.size(); ++i) {
    largest = std::max(largest, std::abs(q[i]));
    difference = std::max(difference, std::abs(p[i] - q[i]));
  }
  std::printf("peak mean pressure %.6g Pa, coupled less alone %.2g of it\n", largest,
              difference / largest);
  EXPECT_GT(largest, 0.5 * peak);
  // One step per window on both sides, at times that differ by rounding only.
  EXPECT_LT(difference, 1e-9 * largest);
}

TEST(CoupledSolid, ResumesBitForBit) {
  Folder whole;
  Folder parted;
  for (const auto* folder : {&whole, &parted})
    write_coupled(*folder, "checkpoint_every_s = 5e-5\n");
  auto outcome = run_coupler(whole);
  ASSERT_EQ(outcome.code, 0) << outcome.text;
  outcome = run_coupler(parted);
  ASSERT_EQ(outcome.code, 0) << outcome.text;
  outcome = run_coupler(parted, "--resume " + parted.path().string() + "/out");
  ASSERT_EQ(outcome.code, 0) << outcome.text;
  for (const char* table : {"solid_probes.csv", "solid_globals.csv"})
    EXPECT_TRUE(read_text(whole.path() / "out" / table) == read_text(parted.path() / "out" / table))
        << table;
}

}  // namespace
}  // namespace ocublast::solid
