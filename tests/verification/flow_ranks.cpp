// The flow on two and four ranks gives what one rank gives, block by block: fluxes at the borders are
// exact but for weights below 1e-17 and the order of additions.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <string>
#include <vector>

#include "tests/support/mpirun.hpp"

namespace ocublast::test {
namespace {

const std::string program = FLOW_RANKS_RUN;
constexpr std::size_t n_head = 5;  ///< time, redone steps, marked nodes, mass, energy
// The bound. Rounding alone (1e-16 per operation, some 30 solves a step, ten steps, amplified by
// no instability in so short a time) stays below 1e-13; 3e-15 is measured.
constexpr double bound = 1e-12;

struct Split {
  const char* problem;
  int x, y, z;
  int steps;
};
std::ostream& operator<<(std::ostream& out, const Split& s) {
  return out << s.problem << ' ' << s.x << 'x' << s.y << 'x' << s.z;
}

std::vector<double> run(const Split& s, int& code) {
  const std::string file = ::testing::TempDir() + "flow_ranks_" + s.problem + std::to_string(100 * s.x + 10 * s.y + s.z);
  const std::string command = program + " " + s.problem + " " + std::to_string(s.x) + " " + std::to_string(s.y) + " " +
                              std::to_string(s.z) + " " + std::to_string(s.steps) + " " + file;
  const int n = s.x * s.y * s.z;
  const Outcome outcome = n == 1 ? run_command(command) : run_ranks(n, command);
  code = outcome.code;
  EXPECT_EQ(outcome.code, 0) << outcome.output;
  std::ifstream in(file, std::ios::binary | std::ios::ate);
  std::vector<double> out(in ? static_cast<std::size_t>(in.tellg()) / sizeof(double) : 0);
  in.seekg(0);
  in.read(reinterpret_cast<char*>(out.data()), static_cast<std::streamsize>(out.size() * sizeof(double)));
  std::remove(file.c_str());
  return out;
}

class FlowOnRanks : public ::testing::TestWithParam<Split> {};

TEST_P(FlowOnRanks, AgreesWithOneRank) {
  const Split& split = GetParam();
  int code = 0;
  Split whole = split;
  whole.x = whole.y = whole.z = 1;
  const auto one = run(whole, code);
  ASSERT_EQ(code, 0);
  const auto many = run(split, code);
  ASSERT_EQ(code, 0);
  ASSERT_EQ(one.size(), many.size());
  EXPECT_EQ(one[1], many[1]) << "redone steps";
  EXPECT_EQ(one[2], many[2]) << "marked nodes";
  for (const std::size_t h : {0u, 3u, 4u}) EXPECT_NEAR(many[h], one[h], bound * std::abs(one[h]));
  const std::size_t n = (one.size() - n_head) / 5;
  double worst = 0.0;
  // Velocities by the largest of all three.
  double speed = 0.0;
  for (std::size_t i = n; i < 4 * n; ++i) speed = std::max(speed, std::abs(one[n_head + i]));
  for (std::size_t f = 0; f < 5; ++f) {
    double scale = f >= 1 && f <= 3 ? speed : 0.0, difference = 0.0;
    for (std::size_t i = n_head + f * n; i < n_head + (f + 1) * n; ++i) {
      scale = std::max(scale, std::abs(one[i]));
      difference = std::max(difference, std::abs(many[i] - one[i]));
    }
    worst = std::max(worst, difference / scale);
  }
  std::printf("  largest relative difference %.1e, %g steps redone, %g marked\n", worst, one[1], one[2]);
  EXPECT_LE(worst, bound);
}

INSTANTIATE_TEST_SUITE_P(
    Blocks, FlowOnRanks,
    ::testing::Values(Split{"line", 2, 1, 1, 20}, Split{"line", 4, 1, 1, 20}, Split{"line_c8", 4, 1, 1, 20},
                      Split{"sod_x", 2, 1, 1, 15}, Split{"sod_y", 1, 2, 1, 15}, Split{"sod_z", 1, 1, 2, 15},
                      Split{"sod_z", 1, 1, 4, 15}, Split{"sod_y_c8", 1, 4, 1, 10}, Split{"blast", 1, 1, 2, 8},
                      Split{"blast", 2, 2, 1, 8}, Split{"blast_nofilter", 1, 2, 2, 6}, Split{"blast_c8", 2, 1, 2, 6},
                      Split{"strong_blast", 2, 1, 2, 6}, Split{"stretched_blast", 2, 1, 1, 6},
                      Split{"stretched_blast", 1, 1, 4, 6}, Split{"blast_paper", 1, 2, 2, 5},
                      Split{"taylor_green", 1, 1, 2, 5}, Split{"taylor_green_c8", 2, 2, 1, 5},
                      Split{"channel", 1, 2, 2, 5}));

TEST(FlowOnRanks, MarksAndRedoesAcrossBorders) {
  int code = 0;
  const auto out = run({"strong_blast", 1, 1, 2, 6}, code);
  ASSERT_EQ(code, 0);
  // What AgreesWithOneRank compares there is the slow path indeed.
  EXPECT_GT(out[1], 0.0);
  EXPECT_GT(out[2], 0.0);
}

TEST(FlowOnRanks, RefusesBlocksShorterThanTheStencils) {
  const auto outcome = run_ranks(4, program + " short_line 4 1 1 1 none");
  EXPECT_EQ(outcome.code, 2);
  EXPECT_NE(outcome.output.find("4 ranks cannot share 20 x 1 x 1 nodes"), std::string::npos) << outcome.output;
  EXPECT_NE(outcome.output.find("at least 8 nodes"), std::string::npos);
}

}  // namespace
}  // namespace ocublast::test
