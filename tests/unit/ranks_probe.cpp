// A program for several ranks; its first argument chooses what it does (see ranks.cpp).

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <numeric>
#include <string>
#include <thread>
#include <vector>

#include "coupler/base/errors.hpp"
#include "coupler/base/rank_exchange.hpp"
#include "coupler/base/ranks.hpp"

namespace {

using ocublast::RankExchange;
using ocublast::Ranks;

/// Sums whose value depends on the order of addition; prints their bits and the other operations'
/// results once per rank.
int operations(const Ranks& ranks) {
  const double r = ranks.rank();
  std::vector<double> values{0.1 * (r + 1.0), ranks.root() ? 1.0 : 1e-16};
  ranks.sum_of_all(values);
  std::uint64_t bits[2];
  std::memcpy(bits, values.data(), sizeof bits);
  const auto text = ranks.broadcast(ranks.root() ? "from the root" : "", 0);
  std::vector<int> mine(static_cast<std::size_t>(ranks.rank() + 1), ranks.rank());
  const auto all = ranks.gather(std::span<const int>(mine));
  std::vector<std::vector<int>> parts(static_cast<std::size_t>(ranks.size()));
  for (std::size_t k = 0; ranks.root() && k < parts.size(); ++k) {
    if (all[k] != std::vector<int>(k + 1, static_cast<int>(k))) return 1;
    parts[k].assign(2, static_cast<int>(10 * k));
  }
  std::vector<int> back(2);
  ranks.scatter(parts, std::span<int>(back));
  if (back != std::vector<int>(2, 10 * ranks.rank())) return 1;
  std::printf("min %g max %g any %d sums %016lx %016lx %s\n", ranks.min_of_all(r),
              ranks.max_of_all(r), ranks.any_of_all(ranks.rank() == ranks.size() - 1), bits[0],
              bits[1], text.c_str());
  return 0;
}

/// Every rank sends its number and the round to both neighbours in a ring, three times.
int ring(const Ranks& ranks) {
  const int left = (ranks.rank() + ranks.size() - 1) % ranks.size();
  const int right = (ranks.rank() + 1) % ranks.size();
  std::vector<double> out(1000);
  std::vector<double> from_left(1000);
  std::vector<double> from_right(1000);
  RankExchange exchange(ranks, 3, std::vector<RankExchange::Message>{{left, out}, {right, out}},
                        std::vector<RankExchange::Message>{{right, from_right}, {left, from_left}});
  for (int round = 0; round < 3; ++round) {
    std::fill(out.begin(), out.end(), 10.0 * ranks.rank() + round);
    exchange.start();
    exchange.poll();
    exchange.finish();
    if (from_left[999] != 10.0 * left + round || from_right[0] != 10.0 * right + round) return 1;
  }
  std::printf("ring closed\n");
  return 0;
}

int run(const std::string& mode, const Ranks& ranks) {
  const bool last = ranks.rank() == ranks.size() - 1;
  if (mode == "operations") return operations(ranks);
  if (mode == "ring") return ring(ranks);
  if (mode == "last_fails") {  // the others wait for it, in vain
    if (last) throw ocublast::NumericsError("lost at 3 s");
    ranks.wait_for_all();
    return 0;
  }
  if (mode == "all_fail") throw ocublast::CaseError("key x: 1, accepted 2");
  if (mode == "together") {
    try {
      ranks.together([&] {
        if (last) throw ocublast::NumericsError("negative density");
      });
    } catch (const ocublast::NumericsError& error) {
      std::printf("rank %d heard of: %s\n", ranks.rank(), error.what());
      return 0;
    }
  }
  return 1;
}

}  // namespace

int main(int, char** argv) {
  return ocublast::run_on_ranks("ranks_probe",
                                [&](const Ranks& ranks) { return run(argv[1], ranks); });
}
