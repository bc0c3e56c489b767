#pragma once

// Several processes of one program under mpirun. MPI is started only when mpirun started the
// program: alone, a program is its own rank 0 of 1 and every operation here is trivial. MPI's own
// header stays inside ranks.cpp and rank_exchange.cpp.

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

namespace ocublast {

/// The ranks of this program. Operations named "all" are collective: every rank calls them in the
/// same order. One thread calls them (MPI_THREAD_FUNNELED). One object per process.
class Ranks {
 public:
  /// Starts MPI if the environment says that mpirun (Open MPI or one with PMI) started this
  /// process. Throws LinkError when MPI cannot be started.
  Ranks();
  ~Ranks();
  Ranks(const Ranks&) = delete;
  Ranks& operator=(const Ranks&) = delete;

  [[nodiscard]] int rank() const { return rank_; }
  [[nodiscard]] int size() const { return size_; }
  [[nodiscard]] bool root() const { return rank_ == 0; }
  [[nodiscard]] bool alone() const { return size_ == 1; }
  /// Ranks that share this machine's processors, this one included.
  [[nodiscard]] int on_this_host() const { return on_this_host_; }

  void wait_for_all() const;
  /// Returns when all are here; ranks other than the root sleep meanwhile instead of spinning,
  /// since the root may be waiting for another program that needs the processor. Costs some 0.1 ms.
  void await_root() const;
  [[nodiscard]] double min_of_all(double value) const;
  [[nodiscard]] double max_of_all(double value) const;
  void max_of_all(std::span<double> values) const;
  [[nodiscard]] bool any_of_all(bool value) const;
  /// Element-wise sum over the ranks, added in rank order: the same bits on every rank and in every
  /// run of as many ranks.
  void sum_of_all(std::span<double> values) const;
  [[nodiscard]] double sum_of_all(double value) const;

  /// Root's values to every rank; the length must be the same everywhere.
  template <class T>
  void broadcast(std::span<T> values, int root = 0) const {
    static_assert(std::is_trivially_copyable_v<T>);
    broadcast_bytes(std::as_writable_bytes(values), root);
  }
  /// Root's text on every rank.
  [[nodiscard]] std::string broadcast(std::string text, int root = 0) const;
  /// On the root every rank's values, one vector per rank; elsewhere empty vectors.
  template <class T>
  [[nodiscard]] std::vector<std::vector<T>> gather(std::span<const T> mine) const {
    static_assert(std::is_trivially_copyable_v<T>);
    std::vector<std::vector<T>> all(static_cast<std::size_t>(size_));
    gather_bytes(std::as_bytes(mine), [&](int from, std::size_t bytes) {
      auto& part = all[static_cast<std::size_t>(from)];
      part.resize(bytes / sizeof(T));
      return std::as_writable_bytes(std::span<T>(part));
    });
    return all;
  }
  /// To every rank its part of what the root holds; `parts` is read on the root only and has one
  /// entry per rank, of the length of that rank's `mine`.
  template <class T>
  void scatter(const std::vector<std::vector<T>>& parts, std::span<T> mine) const {
    static_assert(std::is_trivially_copyable_v<T>);
    std::vector<std::span<const std::byte>> bytes;
    for (const auto& part : parts) bytes.push_back(std::as_bytes(std::span<const T>(part)));
    scatter_bytes(bytes, std::as_writable_bytes(mine));
  }

  /// Runs `work`, which does not communicate, on every rank. When it throws on any of them, every
  /// rank throws the exception of the lowest such rank (same type and text), so that all leave by
  /// the same way. Collective.
  void together(const std::function<void()>& work) const;

 private:
  friend int run_on_ranks(const std::string&, const std::function<int(const Ranks&)>&) noexcept;
  void broadcast_bytes(std::span<std::byte> bytes, int root) const;
  void gather_bytes(std::span<const std::byte> mine,
                    const std::function<std::span<std::byte>(int, std::size_t)>& room) const;
  void scatter_bytes(std::span<const std::span<const std::byte>> parts,
                     std::span<std::byte> mine) const;

  int rank_ = 0;
  int size_ = 1;
  int on_this_host_ = 1;
};

/// Body of `main`: makes the ranks, runs `body` and gives its exit code. An exception is printed to
/// standard error as one message and its exit code returned; with several ranks every rank is then
/// ended with that code (MPI_Abort), since the others may wait for this one for ever. A fault that
/// all ranks find is printed once, by the root.
[[nodiscard]] int run_on_ranks(const std::string& program,
                               const std::function<int(const Ranks&)>& body) noexcept;

}  // namespace ocublast
