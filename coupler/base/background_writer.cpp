#include "coupler/base/background_writer.hpp"

#include <utility>

namespace ocublast {

BackgroundWriter::~BackgroundWriter() {
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void BackgroundWriter::post(std::size_t bytes, std::function<void()> job) {
  std::unique_lock lock(mutex_);
  // A job larger than the bound alone waits for all others.
  changed_.wait(lock,
                [&] { return (jobs_.empty() && !busy_) || queued_bytes_ + bytes <= most_bytes_; });
  rethrow();
  jobs_.push_back({bytes, std::move(job)});
  queued_bytes_ += bytes;
  if (!thread_.joinable()) thread_ = std::thread([this] { work(); });
  changed_.notify_all();
}

void BackgroundWriter::finish() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return jobs_.empty() && !busy_; });
  rethrow();
}

void BackgroundWriter::rethrow() {
  if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
}

void BackgroundWriter::work() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [&] { return !jobs_.empty() || ends_; });
    if (jobs_.empty()) return;
    Job job = std::move(jobs_.front());
    jobs_.pop_front();
    busy_ = true;
    lock.unlock();
    std::exception_ptr failure;
    try {
      job.write();
    } catch (...) {
      failure = std::current_exception();
    }
    job.write = nullptr;  // frees its data before it leaves the count
    lock.lock();
    queued_bytes_ -= job.bytes;
    busy_ = false;
    if (failure) {  // what was to follow may count on it
      failure_ = failure;
      jobs_.clear();
      queued_bytes_ = 0;
    }
    changed_.notify_all();
  }
}

}  // namespace ocublast
