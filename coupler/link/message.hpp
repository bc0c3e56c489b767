#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "coupler/link/participant.hpp"
#include "coupler/link/shared_memory.hpp"

namespace ocublast::link {

/// Version of the wire contract. Participants with another major number are refused.
inline constexpr std::uint32_t protocol_major = 1;
inline constexpr std::uint32_t protocol_minor = 2;

/// No header frame is longer: the longest text in it is cut to a tenth of this.
inline constexpr std::size_t max_header_bytes = 64 * 1024;
inline constexpr std::size_t max_status_bytes = 200;
inline constexpr std::size_t max_text_bytes = 4096;
/// Largest interface mesh accepted: 2e7 vertices are 1 GB of motion, far beyond any eye.
inline constexpr std::uint64_t max_interface_vertices = 20'000'000;
/// More solids than any case has.
inline constexpr std::uint32_t max_interfaces = 64;

enum class Kind {
  hello = 1,
  welcome,
  mesh,
  ready,
  step,
  result,
  checkpoint,
  done,
  finish,
  bye,
  abort,
  wait
};

/// What a payload holds, as bits of Header::fields, in this order.
namespace field {
inline constexpr std::uint32_t position = 1;      ///< [n, 3] m
inline constexpr std::uint32_t velocity = 2;      ///< [n, 3] m/s
inline constexpr std::uint32_t acceleration = 4;  ///< [n, 3] m/s^2
inline constexpr std::uint32_t overpressure = 8;  ///< [n] Pa
inline constexpr std::uint32_t mesh = 16;         ///< [n, 3] m, then [n_triangles, 3] int32
inline constexpr std::uint32_t force = 32;        ///< [n, 3] N
inline constexpr std::uint32_t balance = 64;  ///< [n_interfaces, 4] J, then N s: work and impulse
}  // namespace field

/// The first frame of every message as a value. Members that a kind does not use keep their
/// initial values and are not sent. Units and meanings: proto/coupling.proto.
struct Header {
  Kind kind = Kind::hello;
  std::uint64_t run_id = 0;
  std::uint64_t seq = 0;
  std::uint64_t window = 0;
  std::uint32_t fields = 0;
  std::uint64_t n_vertices = 0;
  std::uint64_t n_triangles = 0;
  std::uint64_t n_quads = 0;  ///< of the triangles: see InterfaceMesh
  std::uint64_t payload_bytes = 0;
  std::uint64_t payload_checksum = 0;  ///< 0 for a payload in shared memory, too
  MemoryPlace memory;                  ///< of the payload; HELLO, WELCOME: of the probe
  std::uint64_t memory_mark = 0;
  bool shares_memory = false;
  std::string packet_path;  ///< WELCOME: of the coupler's PacketListener
  std::uint64_t packet_mark = 0;
  bool takes_packets = false;  ///< READY
  bool takes_force = false;

  std::uint32_t major = protocol_major;
  std::uint32_t minor = protocol_minor;
  Role role = Role::flow;
  std::string name;
  std::string program;
  std::string token;
  std::uint64_t case_hash = 0;

  double silence_limit = 0.0;
  std::uint64_t mesh_hash = 0;
  std::string mesh_name;
  std::uint32_t n_interfaces = 1;

  double t_begin = 0.0;
  double t_end = 0.0;
  std::uint32_t steps = 0;
  bool idle = false;
  LoadShape load_shape = LoadShape::linear;
  WallPath wall_path = WallPath::cubic;
  std::uint32_t iteration = 0;
  bool wants_acceleration = false;

  double stable_step = 0.0;
  double work = 0.0;
  std::array<double, 3> impulse{};
  double impedance = 0.0;
  double mass_per_area = 0.0;
  double compute_seconds = 0.0;
  std::string status;
  double time = 0.0;
  std::string directory;
  std::string reason;
  std::uint32_t exit_code = 1;

  bool operator==(const Header&) const = default;
};

/// The header as bytes of a first frame. Texts longer than their limit are cut.
[[nodiscard]] std::string encode(const Header& header);

/// The header from the bytes of a first frame. Throws LinkError that says what is wrong: too long,
/// not a header, a mandatory number of this kind missing, not finite or out of range, unknown
/// fields, a payload length that does not follow from the counts. Never allocates more than a small
/// multiple of the frame.
[[nodiscard]] Header decode(std::string_view bytes);

/// Length the payload must have by `fields` and the counts, bytes.
[[nodiscard]] std::uint64_t payload_bytes_expected(const Header& header);

/// The contract itself, the text of the schema's descriptor; recordings carry it.
[[nodiscard]] std::string contract_text();

[[nodiscard]] std::string_view to_word(Kind kind);
[[nodiscard]] std::string_view to_word(Role role);

}  // namespace ocublast::link
