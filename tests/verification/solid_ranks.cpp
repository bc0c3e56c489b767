// One rank and several give the same motion: partial forces of shared nodes are added in rank
// order, so that copies agree to the bit and results differ by rounding only.

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "solid_solver/elements/point_buffer.hpp"
#include "tests/support/mpirun.hpp"
#include "tests/support/solid_files.hpp"

namespace ocublast::solid {
namespace {

using test::Folder;

/// The lists of numbers a probe wrote: figures, displacement, velocity, cells.
std::vector<std::vector<double>> read_lists(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::vector<std::vector<double>> lists;
  std::uint64_t n = 0;
  while (in.read(reinterpret_cast<char*>(&n), sizeof n)) {
    auto& list = lists.emplace_back(n);
    in.read(reinterpret_cast<char*>(list.data()), static_cast<std::streamsize>(8 * n));
  }
  return lists;
}

double largest(const std::vector<double>& values) {
  double most = 0.0;
  for (const double v : values) most = std::max(most, std::abs(v));
  return most;
}

double largest_difference(const std::vector<double>& a, const std::vector<double>& b) {
  double most = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) most = std::max(most, std::abs(a[i] - b[i]));
  return most;
}

class SolidRanks : public testing::TestWithParam<const char*> {};

TEST_P(SolidRanks, GiveTheMotionOfOne) {
  const Folder folder;
  std::vector<std::vector<std::vector<double>>> results;
  for (const int n : {1, 2, 4}) {
    const auto file = folder.path() / std::to_string(n);
    const std::string command = std::string(RANKS_PROBE) + " " + GetParam() + " " + file.string();
    const auto outcome =
        n == 1 ? ocublast::test::run_command(command) : ocublast::test::run_ranks(n, command);
    ASSERT_EQ(outcome.code, 0) << outcome.output;
    std::printf("%s", outcome.output.c_str());
    results.push_back(read_lists(file));
    ASSERT_EQ(results.back().size(), 4u);
  }
  const auto& one = results[0];
  ASSERT_GT(largest(one[1]), 1e-6);  // it moves
  for (std::size_t k = 1; k < results.size(); ++k) {
    const auto& several = results[k];
    double worst = 0.0;
    for (const std::size_t list : {1u, 2u}) {
      ASSERT_EQ(several[list].size(), one[list].size());
      worst = std::max(worst, largest_difference(several[list], one[list]) / largest(one[list]));
    }
    // Cell results mix units; each kind against its own peak.
    constexpr std::size_t kinds = n_evaluated;
    for (std::size_t kind = 0; kind < kinds; ++kind) {
      std::vector<double> a;
      std::vector<double> b;
      for (std::size_t at = kind; at < one[3].size(); at += kinds) {
        a.push_back(several[3][at]);
        b.push_back(one[3][at]);
      }
      const double scale = largest(kind <= stress_zx ? one[3] : b);
      if (scale > 0.0) worst = std::max(worst, largest_difference(a, b) / scale);
    }
    // Of the figures each alone, those that vanish by symmetry against the others.
    ASSERT_EQ(several[0].size(), one[0].size());
    double figures = 0.0;
    for (std::size_t i = 0; i < one[0].size(); ++i)
      figures = std::max(figures,
                         std::abs(several[0][i] - one[0][i]) /
                             std::max(std::abs(one[0][i]), 1e-3 * std::min(1.0, largest(one[0]))));
    std::printf("%s: %d ranks less one: motion and stress %.2g, figures %.2g\n", GetParam(),
                k == 1 ? 2 : 4, worst, figures);
    // Some hundred steps of rounding errors (1e-16) of sums in another order; stresses of nearly
    // incompressible cells multiply those of the motion by K/G.
    EXPECT_LT(worst, 1e-12);
    EXPECT_LT(figures, 1e-11);
  }
}

INSTANTIATE_TEST_SUITE_P(Problems, SolidRanks,
                         testing::Values("hex8_q1p0", "hex8_one_point", "tet4_anp", "tet10",
                                         "loaded", "tie", "contact", "coupled", "coupled_forces",
                                         "equilibrium"),
                         [](const auto& param) { return std::string(param.param); });

}  // namespace
}  // namespace ocublast::solid
