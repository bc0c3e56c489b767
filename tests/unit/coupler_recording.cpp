#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>

#include "coupler/base/errors.hpp"
#include "coupler/link/payload.hpp"
#include "coupler/recording.hpp"

using namespace ocublast;
using namespace ocublast::coupler;

namespace {

constexpr std::size_t n_records = 8;

/// A file of this process, as other tests of the same program run beside it.
struct TrafficFile {
  std::filesystem::path path = std::filesystem::temp_directory_path() /
                               ("ocublast_traffic_" + std::to_string(getpid()) + ".ocu");
  ~TrafficFile() { std::filesystem::remove(path); }
};
const TrafficFile traffic;

link::Header header_for(std::size_t i, const zmq::message_t& payload) {
  link::Header h;
  h.kind = link::Kind::step;
  h.window = i + 1;
  h.t_end = static_cast<double>(i);
  h.fields = link::field::overpressure;
  h.n_vertices = payload.size() / sizeof(double);
  h.payload_bytes = payload.size();
  h.payload_checksum =
      link::checksum({static_cast<const std::byte*>(payload.data()), payload.size()});
  return h;
}

/// A recording of n_records messages; every second one repeats the payload before it.
std::filesystem::path write_recording(
    std::size_t vertices, TrafficWriter::Packing packing = TrafficWriter::Packing::none) {
  const auto& file = traffic.path;
  TrafficWriter writer(
      file, {.program = "test", .case_name = "piston", .case_hash = 1, .mesh_hash = 2}, packing);
  std::uint64_t last = 0;
  for (std::size_t i = 0; i < n_records; ++i) {
    std::vector<double> values(vertices, static_cast<double>(i / 2));
    zmq::message_t payload(values.data(), values.size() * sizeof(double));
    const auto header = link::encode(header_for(i, payload));
    const auto direction =
        i % 2 == 0 ? Direction{Party::flow, true} : Direction{Party::solid, false};
    if (i % 2 == 0)
      last = writer.append(direction, header, payload);
    else
      writer.append(direction, header, payload, last);
  }
  writer.close();
  return file;
}

std::string read_all(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

void write_all(const std::filesystem::path& file, const std::string& bytes) {
  std::ofstream(file, std::ios::binary | std::ios::trunc) << bytes;
}

/// Number of records that come back right; fails the test for a wrong one.
std::size_t count_right(TrafficReader& reader, std::size_t vertices) {
  std::size_t count = 0;
  while (const auto record = reader.next()) {
    EXPECT_EQ(record->number, count);
    EXPECT_EQ(record->payload.size(), vertices * sizeof(double));
    double first = -1.0;
    std::memcpy(&first, record->payload.data(), sizeof first);
    EXPECT_EQ(first, static_cast<double>(count / 2));
    EXPECT_EQ(link::decode(record->header).window, count + 1);
    ++count;
  }
  return count;
}

}  // namespace

TEST(Recording, ComesBackRecordForRecord) {
  for (const std::size_t vertices : {1, 3, 10'000}) {  // copied and shared payloads
    const auto file = write_recording(vertices);
    TrafficReader reader(file);
    EXPECT_TRUE(reader.complete());
    EXPECT_EQ(reader.description().case_name, "piston");
    EXPECT_EQ(count_right(reader, vertices), n_records);
    EXPECT_EQ(reader.damage(), "");
  }
}

TEST(Recording, PackedComesBackRecordForRecord) {
  for (const std::size_t vertices : {1, 3, 10'000}) {
    const auto file = write_recording(vertices, TrafficWriter::Packing::zstd);
    TrafficReader reader(file);
    EXPECT_EQ(count_right(reader, vertices), n_records);
    EXPECT_EQ(reader.damage(), "");
  }
}

TEST(Recording, PacksFieldsThatChangeLittleAndReturnsTheirBits) {
  // A smooth wave that moves a little per window, with its rounding: what a run records.
  constexpr std::size_t n = 5000, windows = 20;
  const auto wave = [](std::size_t w) {
    std::vector<double> values(n);
    for (std::size_t i = 0; i < n; ++i)
      values[i] = 1e5 * std::sin(1e-3 * static_cast<double>(i) + 1e-4 * static_cast<double>(w));
    return values;
  };
  std::array<std::uintmax_t, 2> sizes{};
  for (const auto packing : {TrafficWriter::Packing::none, TrafficWriter::Packing::zstd}) {
    {
      TrafficWriter writer(traffic.path, {.program = "test", .case_name = "piston"}, packing);
      for (std::size_t w = 0; w < windows; ++w) {
        const auto values = wave(w);
        zmq::message_t payload(values.data(), values.size() * sizeof(double));
        writer.append({Party::flow, true}, link::encode(header_for(w, payload)), payload);
      }
      writer.close();
    }
    sizes[packing == TrafficWriter::Packing::zstd ? 1 : 0] =
        std::filesystem::file_size(traffic.path);
    TrafficReader reader(traffic.path);
    for (std::size_t w = 0; w < windows; ++w) {
      const auto record = reader.next();
      ASSERT_TRUE(record) << reader.damage();
      const auto values = wave(w);
      EXPECT_EQ(std::memcmp(record->payload.data(), values.data(), n * sizeof(double)), 0);
    }
  }
  std::printf("packed %zu of %zu bytes\n", static_cast<std::size_t>(sizes[1]),
              static_cast<std::size_t>(sizes[0]));
  EXPECT_LT(sizes[1], sizes[0]);
}

TEST(Recording, ARepeatedPayloadIsStoredOnce) {
  const auto file = write_recording(10'000);
  EXPECT_LT(std::filesystem::file_size(file), (n_records / 2 + 1) * 80'000);
}

TEST(Recording, CutAtAnyByteItGivesAllRecordsBeforeTheCut) {
  constexpr std::size_t vertices = 3;
  const auto file = write_recording(vertices);
  const std::string whole = read_all(file);
  std::size_t last_count = n_records;
  for (std::size_t size = whole.size(); size-- > 0;) {
    write_all(file, whole.substr(0, size));
    std::size_t count = 0;
    try {
      TrafficReader reader(file);
      EXPECT_FALSE(reader.complete()) << size;
      count = count_right(reader, vertices);
    } catch (const LinkError&) {
      EXPECT_EQ(last_count, 0U) << "refused although records are there, cut at " << size;
    }
    EXPECT_LE(count, last_count);
    EXPECT_GE(count + 1, last_count) << "cut at " << size;  // one byte less costs at most a record
    last_count = count;
  }
  EXPECT_EQ(last_count, 0U);
}

TEST(Recording, AFlippedByteAnywhereIsNoticed) {
  constexpr std::size_t vertices = 3;
  const auto file = write_recording(vertices);
  const std::string whole = read_all(file);
  const std::size_t first_record = whole.find("RUCO");
  ASSERT_NE(first_record, std::string::npos);
  for (std::size_t at = first_record; at < whole.size(); ++at) {
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x10);
    write_all(file, damaged);
    TrafficReader reader(file);
    const std::size_t count = count_right(reader, vertices);
    EXPECT_TRUE(!reader.damage().empty() || !reader.complete()) << at;
    EXPECT_LE(count, n_records);
  }
}

TEST(Recording, AFullDiskIsReportedAndNamesTheFile) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP();
  TrafficWriter writer("/dev/full", {});
  std::vector<double> values(1000, 1.0);
  zmq::message_t payload(values.data(), values.size() * sizeof(double));
  writer.append(Direction{Party::flow, true}, link::encode(header_for(0, payload)), payload);
  try {
    writer.close();
    FAIL() << "a full disk went unnoticed";
  } catch (const LinkError& error) {
    EXPECT_NE(std::string(error.what()).find("/dev/full"), std::string::npos);
  }
}
