#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "coupler/base/errors.hpp"
#include "coupler/link/checksum_wide.hpp"
#include "coupler/link/message.hpp"
#include "coupler/link/payload.hpp"
#include "coupling.pb.h"

using namespace ocublast;
using namespace ocublast::link;

namespace {

Header make_result() {
  Header h;
  h.kind = Kind::result;
  h.run_id = 77;
  h.seq = 5;
  h.window = 3;
  h.t_begin = 0.1;
  h.t_end = 0.3;
  h.steps = 4;
  h.fields = field::position | field::velocity;
  h.n_vertices = 2;
  h.payload_bytes = 96;
  h.payload_checksum = 42;
  h.stable_step = 1e-6;
  h.work = -2.5;
  h.impulse = {1.0, 2.0, 3.0};
  h.impedance = 410.0;
  h.mass_per_area = 1.5;
  h.compute_seconds = 0.25;
  h.status = "quiet";
  return h;
}

std::span<const std::byte> bytes_of(const std::vector<double>& values) {
  return std::as_bytes(std::span(values));
}

}  // namespace

TEST(Header, ComesBackAsItWasSent) {
  EXPECT_EQ(decode(encode(make_result())), make_result());
  Header step = {};
  step.kind = Kind::step;
  step.window = 9;
  step.t_end = 1.0;
  step.steps = 3;
  step.idle = true;
  step.load_shape = LoadShape::constant;
  step.wall_path = WallPath::straight;
  EXPECT_EQ(decode(encode(step)), step);
}

TEST(Header, StaysFarBelowItsLimitWithTheLongestTexts) {
  Header hello;
  hello.program = hello.token = std::string(1'000'000, 'x');
  EXPECT_LT(encode(hello).size(), max_header_bytes);
  EXPECT_EQ(decode(encode(hello)).program.size(), max_text_bytes);
}

TEST(Header, TextsAreCutAtWholeCharactersAndDamagedOnesStillArrive) {
  Header h = make_result();
  h.status =
      std::string(199, 'a') + "\u00b5s";  // two bytes from 199 on: would be cut in the middle
  EXPECT_EQ(decode(encode(h)).status, std::string(199, 'a'));
  h.status = "caf\xe9 \xff\u00e9";
  EXPECT_EQ(decode(encode(h)).status, "caf? ?\u00e9");
}

TEST(Header, IsRefusedBeyondTheSizeLimitBeforeItIsParsed) {
  EXPECT_THROW(static_cast<void>(decode(std::string(max_header_bytes + 1, '\x0a'))), LinkError);
}

TEST(Header, EmptyFrameIsNotAHeaderOfZeros) {
  EXPECT_THROW(static_cast<void>(decode("")), LinkError);
}

TEST(Header, EveryMandatoryNumberOfAResultIsMissed) {
  // Numbers of proto/coupling.proto that a RESULT must carry; 0 stands in for a value never sent.
  const std::string bytes = encode(make_result());
  for (const int number : {2, 3, 4, 5, 6, 8, 9, 20, 21, 22, 23, 26, 27, 28, 29, 30, 31, 32, 33}) {
    proto::Header message;
    ASSERT_TRUE(message.ParseFromString(bytes));
    const auto* field = proto::Header::descriptor()->FindFieldByNumber(number);
    message.GetReflection()->ClearField(&message, field);
    EXPECT_THROW(static_cast<void>(decode(message.SerializeAsString())), LinkError)
        << field->name();
  }
}

TEST(Header, RefusesNumbersThatAreNotFinite) {
  Header h = make_result();
  h.work = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(static_cast<void>(decode(encode(h))), LinkError);
  h = make_result();
  h.stable_step = 0.0;
  EXPECT_THROW(static_cast<void>(decode(encode(h))), LinkError);
}

TEST(Header, RefusesPayloadLengthsThatDoNotFollowFromTheCounts) {
  Header h = make_result();
  h.payload_bytes += 8;
  EXPECT_THROW(static_cast<void>(decode(encode(h))), LinkError);
  h = make_result();
  h.n_vertices =
      std::numeric_limits<std::uint64_t>::max() / 48 + 2;  // would wrap to a small length
  h.payload_bytes = 48 * h.n_vertices;
  EXPECT_THROW(static_cast<void>(decode(encode(h))), LinkError);
}

TEST(Header, RandomAndDamagedBytesAreRefusedOrDecodedButNeverCrash) {
  std::mt19937_64 random(20240607);
  const std::string good = encode(make_result());
  int decoded = 0;
  for (int i = 0; i < 200'000; ++i) {
    std::string bytes = good;
    if (i % 2 == 0) {
      bytes.resize(random() % 80);
      for (char& c : bytes) c = static_cast<char>(random());
    } else {
      for (int k = 0; k < 3; ++k) bytes[random() % bytes.size()] = static_cast<char>(random());
      bytes.resize(random() % (bytes.size() + 1));
    }
    try {
      const Header h = decode(bytes);
      EXPECT_EQ(h.payload_bytes, payload_bytes_expected(h));
      ++decoded;
    } catch (const LinkError&) {
    }
  }
  std::printf("200000 damaged headers, %d still valid\n", decoded);
}

TEST(Payload, OneFlippedBitIsNoticed) {
  std::vector<double> values(12, 1.25);
  Header h = make_result();
  h.payload_checksum = checksum(bytes_of(values));
  EXPECT_NO_THROW(check_payload(h, bytes_of(values)));
  std::uint64_t bits = 0;
  std::memcpy(&bits, &values[7], sizeof bits);
  bits ^= 1U;
  std::memcpy(&values[7], &bits, sizeof bits);
  EXPECT_THROW(check_payload(h, bytes_of(values)), LinkError);
}

TEST(Payload, TheVertexThatIsNotFiniteIsNamed) {
  for (std::size_t bad = 0; bad < 12; ++bad) {
    std::vector<double> values(12, 1.25);
    values[bad] = bad % 2 == 0 ? std::nan("") : -std::numeric_limits<double>::infinity();
    Header h = make_result();
    h.payload_checksum = checksum(bytes_of(values));
    try {
      check_payload(h, bytes_of(values));
      FAIL() << "value " << bad;
    } catch (const LinkError& error) {
      const std::string expected = std::string(bad < 6 ? "position" : "velocity") + " of vertex " +
                                   std::to_string(bad % 6 / 3);
      EXPECT_NE(std::string(error.what()).find(expected), std::string::npos) << error.what();
    }
  }
}

TEST(Payload, LargestFiniteAndDenormalValuesAreFinite) {
  std::vector<double> values(1000, std::numeric_limits<double>::max());
  values[3] = std::numeric_limits<double>::denorm_min();
  values[4] = -std::numeric_limits<double>::max();
  EXPECT_TRUE(all_finite(values));
}

TEST(Payload, ChecksumIsThatOfThePublishedAlgorithm) {
  // XXH3_64bits("a") as the reference implementation's xxhsum -H3 prints it.
  const char a = 'a';
  EXPECT_EQ(checksum({reinterpret_cast<const std::byte*>(&a), 1}), 0xe6c632b61e964e1fULL);
}

TEST(Payload, ChecksumIsTheSameByAnyRegisters) {
  // python3 -c 'import xxhash; print(hex(xxhash.xxh3_64_intdigest(bytes(i % 251 for i in
  // range(N)))))'
  const std::pair<std::size_t, std::uint64_t> known[] = {{4095, 0xa541030d777f5abeULL},
                                                         {4096, 0x7135ffa504f1bc71ULL},
                                                         {100'001, 0x1aa99e18506ba0aULL}};
  for (const auto& [n, expected] : known) {
    std::vector<std::byte> bytes(n);
    for (std::size_t i = 0; i < n; ++i) bytes[i] = static_cast<std::byte>(i % 251);
    EXPECT_EQ(checksum(bytes), expected) << n;
    if (__builtin_cpu_supports("avx2")) {
      EXPECT_EQ(checksum_avx2(bytes.data(), n), expected) << n;
    }
    if (__builtin_cpu_supports("avx512f")) {
      EXPECT_EQ(checksum_avx512(bytes.data(), n), expected) << n;
    }
  }
}

TEST(Mesh, ComesBackAndItsIndicesAreChecked) {
  InterfaceMesh mesh{"face", {0, 0, 0, 1, 0, 0, 0, 1, 0}, {0, 1, 2}};
  Header h;
  h.kind = Kind::mesh;
  h.fields = field::mesh;
  h.n_vertices = 3;
  h.n_triangles = 1;
  h.mesh_name = mesh.name;
  std::string bytes = mesh_payload(mesh);
  const InterfaceMesh back = mesh_from_payload(h, std::as_bytes(std::span(bytes)));
  EXPECT_EQ(back.vertices, mesh.vertices);
  EXPECT_EQ(back.triangles, mesh.triangles);
  mesh.triangles[1] = 3;
  bytes = mesh_payload(mesh);
  EXPECT_THROW(static_cast<void>(mesh_from_payload(h, std::as_bytes(std::span(bytes)))), LinkError);
}
