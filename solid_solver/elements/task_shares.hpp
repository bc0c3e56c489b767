#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <vector>

namespace ocublast::solid {

/// The tasks of a loop shared out to threads. Each begins with consecutive ones of its own, the
/// same in every loop, so that what it works on stays in its cache; when they are done it takes
/// over what others have left.
class TaskShares {
 public:
  static constexpr std::size_t none = static_cast<std::size_t>(-1);

  explicit TaskShares(int threads) : shares_(static_cast<std::size_t>(std::max(threads, 1))) {}
  /// Shares out tasks [begin, end); outside the parallel region.
  void share_out(std::size_t begin, std::size_t end) {
    const std::size_t n = shares_.size();
    for (std::size_t t = 0; t < n; ++t) {
      shares_[t].next.store(begin + (end - begin) * t / n, std::memory_order_relaxed);
      shares_[t].end = begin + (end - begin) * (t + 1) / n;
    }
  }
  /// The next task for a thread, or none.
  [[nodiscard]] std::size_t take(int thread) {
    const std::size_t n = shares_.size();
    for (std::size_t k = 0; k < n; ++k) {
      auto& share = shares_[(static_cast<std::size_t>(thread) + k) % n];
      if (share.next.load(std::memory_order_relaxed) >= share.end) continue;
      const std::size_t task = share.next.fetch_add(1, std::memory_order_relaxed);
      if (task < share.end) return task;
    }
    return none;
  }

 private:
  struct alignas(64) Share {  // a cache line of its own
    std::atomic<std::size_t> next{0};
    std::size_t end = 0;
  };
  std::vector<Share> shares_;
};

}  // namespace ocublast::solid
