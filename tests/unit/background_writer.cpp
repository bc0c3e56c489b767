#include "coupler/base/background_writer.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <stdexcept>
#include <thread>
#include <vector>

namespace ocublast {
namespace {

/// Holds jobs back until it is opened.
class Gate {
 public:
  void open() {
    open_ = true;
    open_.notify_all();
  }
  void pass() const { open_.wait(false); }

 private:
  std::atomic<bool> open_{false};
};

TEST(BackgroundWriter, WritesInOrderWhileTheCallerGoesOn) {
  Gate gate;
  std::vector<int> order;
  BackgroundWriter writer(100);
  writer.post(10, [&] { gate.pass(); });
  for (int i = 0; i < 5; ++i) writer.post(10, [&order, i] { order.push_back(i); });
  gate.open();  // reached although nothing could be written yet
  writer.finish();
  EXPECT_EQ(order, (std::vector<int>{0, 1, 2, 3, 4}));
}

TEST(BackgroundWriter, WaitsWhereMoreIsQueuedThanItsBound) {
  Gate gate;
  std::atomic<int> posted{0};
  BackgroundWriter writer(25);
  writer.post(10, [&] { gate.pass(); });
  std::thread caller([&] {
    for (int i = 0; i < 3; ++i) {
      writer.post(10, [&] {});
      ++posted;
    }
  });
  while (posted < 1) std::this_thread::yield();
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_EQ(posted, 1);  // 10 being written, 10 queued: 10 more exceed 25
  gate.open();
  caller.join();
  writer.finish();
  EXPECT_EQ(posted, 3);
}

TEST(BackgroundWriter, TakesAJobAboveItsBoundAlone) {
  bool done = false;
  BackgroundWriter writer(1);
  writer.post(1000, [&] { done = true; });
  writer.finish();
  EXPECT_TRUE(done);
}

TEST(BackgroundWriter, HandsAFailureToTheCallerOnceAndDropsWhatFollowed) {
  Gate gate;
  bool later = false;
  BackgroundWriter writer(100);
  writer.post(1, [&] {
    gate.pass();
    throw std::runtime_error("disk full");
  });
  writer.post(1, [&] { later = true; });
  gate.open();
  EXPECT_THROW(writer.finish(), std::runtime_error);
  EXPECT_FALSE(later);
  writer.post(1, [&] { later = true; });
  writer.finish();
  EXPECT_TRUE(later);
}

TEST(BackgroundWriter, WritesWhatIsQueuedBeforeItEnds) {
  int written = 0;
  {
    BackgroundWriter writer(100);
    for (int i = 0; i < 4; ++i) writer.post(1, [&] { ++written; });
  }
  EXPECT_EQ(written, 4);
}

}  // namespace
}  // namespace ocublast
