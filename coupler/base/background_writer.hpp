#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>

namespace ocublast {

/// Writes files in a thread of its own, in the order they were handed over, while the caller
/// computes on. What waits is bounded: `post` blocks while more than `most_bytes` are queued. The
/// thread starts with the first job, so a run without output has none. HDF5 is entered by one
/// thread at a time: `finish` before other work on HDF5 files.
class BackgroundWriter {
 public:
  explicit BackgroundWriter(std::size_t most_bytes) : most_bytes_(most_bytes) {}
  ~BackgroundWriter();  ///< writes what is queued; a failure nobody asked for is lost
  BackgroundWriter(const BackgroundWriter&) = delete;
  BackgroundWriter& operator=(const BackgroundWriter&) = delete;
  /// Queues a job that owns `bytes` of data. Rethrows what an earlier job threw (disk full); those
  /// behind it were dropped then.
  void post(std::size_t bytes, std::function<void()> job);
  /// Returns when everything is written; rethrows what a job threw.
  void finish();

 private:
  struct Job {
    std::size_t bytes;
    std::function<void()> write;
  };
  void work();
  void rethrow();

  std::size_t most_bytes_, queued_bytes_ = 0;
  bool busy_ = false, ends_ = false;
  std::deque<Job> jobs_;
  std::exception_ptr failure_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::thread thread_;
};

}  // namespace ocublast
