#include "coupler/base/ranks.hpp"

#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <string>

#include "tests/support/mpirun.hpp"

namespace ocublast::test {
namespace {

const std::string probe = RANKS_PROBE;

int count(const std::string& text, const std::string& part) {
  int n = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++n;
  return n;
}

/// Open sockets of this process.
int count_sockets() {
  int sockets = 0;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
    std::error_code gone;  // the iterator's own
    const auto target = std::filesystem::read_symlink(entry.path(), gone).string();
    sockets += target.rfind("socket:", 0) == 0 ? 1 : 0;
  }
  return sockets;
}

TEST(Ranks, AloneStartNoMpi) {
  const int sockets = count_sockets();
  const Ranks ranks;
  EXPECT_EQ(ranks.size(), 1);
  EXPECT_TRUE(ranks.root());
  EXPECT_EQ(ranks.sum_of_all(0.1), 0.1);
  EXPECT_EQ(ranks.gather(std::span<const int>(std::array{7})).at(0).at(0), 7);
  // Nothing of MPI runs: it would listen on sockets and keep threads of its own.
  EXPECT_EQ(count_sockets(), sockets);
  const std::filesystem::directory_iterator threads("/proc/self/task");
  EXPECT_EQ(std::distance(begin(threads), end(threads)), 1);
}

TEST(Ranks, AddInRankOrderToTheSameBitsEverywhere) {
  // From the left 0.1 + 0.2 + 0.3 ends in ...34 and 1 + 1e-16 + 1e-16 is 1; from the right ...33
  // and 1 + 2.2e-16.
  const auto outcome = run_ranks(3, probe + " operations");
  ASSERT_EQ(outcome.code, 0) << outcome.output;
  EXPECT_EQ(count(outcome.output,
                  "min 0 max 2 any 1 sums 3fe3333333333334 3ff0000000000000 from the root"),
            3)
      << outcome.output;
}

TEST(Ranks, ExchangeWithNeighboursAgainAndAgain) {
  for (const int n : {2, 3}) {
    const auto outcome = run_ranks(n, probe + " ring");
    EXPECT_EQ(outcome.code, 0) << outcome.output;
    EXPECT_EQ(count(outcome.output, "ring closed"), n);
  }
}

TEST(Ranks, EndAllWhenOneFails) {
  const auto outcome = run_ranks(3, probe + " last_fails");
  EXPECT_EQ(outcome.code, 4) << outcome.output;  // a failed computation
  EXPECT_EQ(count(outcome.output, "ranks_probe (rank 2): computation failed:\nlost at 3 s"), 1)
      << outcome.output;
}

TEST(Ranks, TellAFaultOfAllOnce) {
  const auto outcome = run_ranks(2, probe + " all_fail");
  EXPECT_EQ(outcome.code, 2) << outcome.output;
  EXPECT_EQ(count(outcome.output, "key x: 1, accepted 2"), 1) << outcome.output;
}

TEST(Ranks, ThrowTogether) {
  const auto outcome = run_ranks(2, probe + " together");
  EXPECT_EQ(outcome.code, 0) << outcome.output;
  EXPECT_EQ(count(outcome.output, "heard of: negative density"), 2) << outcome.output;
}

}  // namespace
}  // namespace ocublast::test
