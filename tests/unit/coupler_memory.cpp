#include <gtest/gtest.h>

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstring>

#include "coupler/base/errors.hpp"
#include "coupler/link/shared_memory.hpp"

using ocublast::LinkError;
using namespace ocublast::link;

TEST(SharedMemory, IsReadWhereItsPlaceSays) {
  const SharedMemory memory(100, 3);
  MemoryReader reader;
  for (unsigned k = 0; k < 3; ++k) std::memset(memory.slot(k).data(), static_cast<int>(k + 1), 100);
  for (unsigned k = 0; k < 3; ++k) {
    const auto seen = reader.view(memory.place(k), 100);
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(seen.data()) % alignof(double), 0U);
    EXPECT_EQ(seen.front(), std::byte(k + 1));
    EXPECT_EQ(seen.back(), std::byte(k + 1));
  }
  EXPECT_EQ(memory.slot(4).data(), memory.slot(1).data());
  memory.slot(1)[0] = std::byte(77);  // no copy: what is written is seen
  EXPECT_EQ(reader.view(memory.place(1), 1)[0], std::byte(77));
}

TEST(SharedMemory, RefusesWhatLiesOutside) {
  const SharedMemory memory(64, 2);
  MemoryReader reader;
  auto place = memory.place(0);
  EXPECT_THROW(static_cast<void>(reader.view(place, 129)), LinkError);
  place.offset = 4;  // not aligned for doubles
  EXPECT_THROW(static_cast<void>(reader.view(place, 8)), LinkError);
  place.offset = ~std::uint64_t{7};
  EXPECT_THROW(static_cast<void>(reader.view(place, 8)), LinkError);
  EXPECT_EQ(reader.view(memory.place(1), 64).size(), 64U);
}

TEST(SharedMemory, RefusesFilesThatCouldShrinkAndThatAreNone) {
  MemoryReader reader;
  const auto pid = static_cast<std::uint32_t>(::getpid());
  const int plain = ::memfd_create("plain", 0);
  ASSERT_EQ(::ftruncate(plain, 4096), 0);
  EXPECT_THROW(static_cast<void>(reader.view({pid, static_cast<std::uint32_t>(plain), 0}, 8)), LinkError);
  int pipe[2];
  ASSERT_EQ(::pipe(pipe), 0);
  EXPECT_THROW(static_cast<void>(reader.view({pid, static_cast<std::uint32_t>(pipe[0]), 0}, 8)), LinkError);
  EXPECT_THROW(static_cast<void>(reader.view({pid, 999'999, 0}, 8)), LinkError);
  for (const int fd : {plain, pipe[0], pipe[1]}) ::close(fd);
}

TEST(SharedMemory, ProbeIsFoundByItsMarkOnly) {
  const MemoryProbe probe;
  MemoryReader reader;
  EXPECT_TRUE(reader.finds(probe.place(), probe.mark()));
  EXPECT_FALSE(reader.finds(probe.place(), probe.mark() + 1));
  EXPECT_FALSE(reader.finds({.pid = 0x7ffffff0, .fd = 3, .offset = 0}, probe.mark()));
}
