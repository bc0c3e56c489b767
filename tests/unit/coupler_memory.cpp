#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstring>
#include <string>

#include "coupler/base/errors.hpp"
#include "coupler/link/message.hpp"
#include "coupler/link/packet_socket.hpp"
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
  EXPECT_THROW(static_cast<void>(reader.view({pid, static_cast<std::uint32_t>(plain), 0}, 8)),
               LinkError);
  int pipe[2];
  ASSERT_EQ(::pipe(pipe), 0);
  EXPECT_THROW(static_cast<void>(reader.view({pid, static_cast<std::uint32_t>(pipe[0]), 0}, 8)),
               LinkError);
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

namespace {

std::string scratch_path(const char* name) {
  return "/tmp/ocublast-packets-" + std::to_string(::getpid()) + name;
}

}  // namespace

TEST(PacketSocket, KeepsPacketsApartAndInOrder) {
  PacketListener listener(scratch_path("-order"));
  ASSERT_TRUE(listener);
  auto theirs = PacketSocket::connect(listener.path(), 42);
  ASSERT_TRUE(theirs);
  auto ours = listener.take(42);
  ASSERT_TRUE(ours);
  for (int n = 0; n < 20; ++n)
    EXPECT_TRUE(theirs.send(std::string(static_cast<std::size_t>(n + 1), 'a')));
  std::string got;
  for (int n = 0; n < 20; ++n) {
    ASSERT_TRUE(ours.receive(got));
    EXPECT_EQ(got.size(), static_cast<std::size_t>(n + 1));
  }
  EXPECT_FALSE(ours.receive(got));
  EXPECT_TRUE(ours);
  theirs.close();
  EXPECT_FALSE(ours.receive(got));
  EXPECT_FALSE(ours);  // the end was seen, nobody polls it any more
}

TEST(PacketSocket, IsFoundByItsMarkOnly) {
  PacketListener listener(scratch_path("-mark"));
  const auto stranger = PacketSocket::connect(listener.path(), 1);
  EXPECT_FALSE(listener.take(2));
  const auto theirs = PacketSocket::connect(listener.path(), 2);
  EXPECT_TRUE(listener.take(2));
  EXPECT_FALSE(listener.take(2));  // once
  EXPECT_FALSE(PacketSocket::connect("/nowhere/at-all", 2));
  EXPECT_FALSE(PacketSocket::connect(std::string(200, 'x'), 2));
}

TEST(PacketSocket, FullQueuesAndLongPacketsAreSeen) {
  PacketListener listener(scratch_path("-full"));
  auto theirs = PacketSocket::connect(listener.path(), 7);
  auto ours = listener.take(7);
  int sent = 0;
  while (sent < 100'000 && theirs.send("header")) ++sent;
  EXPECT_GT(sent, 1);
  EXPECT_LT(sent, 100'000);  // it does not wait: the sender takes the other way
  std::string got;
  while (ours.receive(got)) EXPECT_EQ(got, "header");
  EXPECT_TRUE(theirs.send(std::string(max_header_bytes + 1, 'x')));
  EXPECT_THROW(static_cast<void>(ours.receive(got)), LinkError);
}
