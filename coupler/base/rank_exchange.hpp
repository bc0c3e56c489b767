#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "coupler/base/ranks.hpp"

namespace ocublast {

/// Messages of fixed place and length between ranks, sent again and again (halos, shared nodes):
/// non-blocking, so that work fits between `start` and `finish`.
class RankExchange {
 public:
  struct Message {
    int peer = 0;
    std::span<std::byte> data;
    /// The values stay where they are while the exchange lives.
    template <class Values>
    Message(int other, Values&& values)
        : peer(other), data(std::as_writable_bytes(std::span(values))) {}
  };
  /// Pairs of ranks may exchange several messages: they match in the order of the lists. `channel`
  /// (0 to 999) keeps exchanges that are under way at the same time apart; it is the same on all
  /// ranks.
  RankExchange(const Ranks& ranks, int channel, std::span<const Message> sends,
               std::span<const Message> receives);
  ~RankExchange();
  RankExchange(RankExchange&&) noexcept;
  RankExchange& operator=(RankExchange&&) noexcept;

  /// The data of the sends must be complete, and stay until `finish`.
  void start();
  /// Lets messages move on while the caller computes; worth a call every some 100 us, since MPI
  /// without a thread of its own moves long messages inside its calls only.
  void poll();
  /// Afterwards the received data are there.
  void finish();

 private:
  struct Requests;
  std::unique_ptr<Requests> requests_;
};

}  // namespace ocublast
