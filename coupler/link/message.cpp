#include "coupler/link/message.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "coupler/base/errors.hpp"
#include "coupling.pb.h"

namespace ocublast::link {
namespace {

constexpr double byte_order_mark = 1.5;

[[noreturn]] void refuse(std::string_view what) {
  throw LinkError(fmt::format("message refused: {}", what));
}

/// Length of the UTF-8 character that begins at `at`; 0 where there is none.
std::size_t character_length(std::string_view text, std::size_t at) {
  const auto first = static_cast<unsigned char>(text[at]);
  const std::size_t length = first < 0x80   ? 1
                             : first < 0xc2 ? 0
                             : first < 0xe0 ? 2
                             : first < 0xf0 ? 3
                             : first < 0xf5 ? 4
                                            : 0;
  if (at + length > text.size()) return 0;
  for (std::size_t k = 1; k < length; ++k)
    if ((static_cast<unsigned char>(text[at + k]) & 0xc0) != 0x80) return 0;
  return length;
}

/// At most `limit` bytes, whole characters, '?' for what is no UTF-8: protobuf refuses a message
/// with a damaged text, and the reason of a failure must always arrive.
std::string cut(const std::string& text, std::size_t limit) {
  std::string out;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t length = character_length(text, at);
    if (out.size() + std::max<std::size_t>(length, 1) > limit) break;
    if (length == 0)
      out += '?';
    else
      out.append(text, at, length);
    at += std::max<std::size_t>(length, 1);
  }
  return out;
}

void put_step(const Header& header, proto::Header& out) {
  out.set_t_begin_s(header.t_begin);
  out.set_t_end_s(header.t_end);
  out.set_steps(header.steps);
  out.set_idle(header.idle);
  if (header.iteration > 0) out.set_iteration(header.iteration);
}

void put_order(const Header& header, proto::Header& out) {
  put_step(header, out);
  out.set_load_shape(header.load_shape == LoadShape::linear ? proto::LOAD_SHAPE_LINEAR
                                                            : proto::LOAD_SHAPE_CONSTANT);
  out.set_wall_path(header.wall_path == WallPath::cubic ? proto::WALL_PATH_CUBIC
                                                        : proto::WALL_PATH_STRAIGHT);
  if (header.wants_acceleration) out.set_wants_acceleration(true);
}

void put_result(const Header& header, proto::Header& out) {
  put_step(header, out);
  out.set_stable_step_s(header.stable_step);
  out.set_work_j(header.work);
  out.set_impulse_x_n_s(header.impulse[0]);
  out.set_impulse_y_n_s(header.impulse[1]);
  out.set_impulse_z_n_s(header.impulse[2]);
  out.set_impedance_kg_m2_s(header.impedance);
  out.set_mass_per_area_kg_m2(header.mass_per_area);
  out.set_compute_s(header.compute_seconds);
  if (!header.status.empty()) out.set_status(cut(header.status, max_status_bytes));
}

void put_memory(const Header& header, proto::Header& out) {
  if (header.memory.pid == 0) return;
  out.set_memory_pid(header.memory.pid);
  out.set_memory_fd(header.memory.fd);
  out.set_memory_offset(header.memory.offset);
  if (header.kind == Kind::hello || header.kind == Kind::welcome)
    out.set_memory_mark(header.memory_mark);
}

void put_hello(const Header& header, proto::Header& out) {
  out.set_protocol_major(header.major);
  out.set_protocol_minor(header.minor);
  out.set_role(header.role == Role::flow ? proto::ROLE_FLOW : proto::ROLE_SOLID);
  if (!header.name.empty()) out.set_name(cut(header.name, max_text_bytes));
  out.set_program(cut(header.program, max_text_bytes));
  out.set_token(cut(header.token, max_text_bytes));
  out.set_case_hash(header.case_hash);
  out.set_byte_order_mark(byte_order_mark);
}

/// Takes mandatory values out of a parsed header; a missing or unacceptable one is refused by name.
class Reader {
 public:
  Reader(const proto::Header& in, Kind kind) : in_(in), kind_(kind) {}

#define OCU_TAKE(member, name)                                                     \
  do {                                                                             \
    if (!in_.has_##name())                                                         \
      refuse(fmt::format("{} without its mandatory '{}'", to_word(kind_), #name)); \
    member = in_.name();                                                           \
  } while (false)
#define OCU_TAKE_FINITE(member, name)                                                       \
  do {                                                                                      \
    OCU_TAKE(member, name);                                                                 \
    if (!std::isfinite(member))                                                             \
      refuse(fmt::format("{}: '{}' is {}, must be finite", to_word(kind_), #name, member)); \
  } while (false)

  void common(Header& out) const {
    OCU_TAKE(out.run_id, run_id);
    OCU_TAKE(out.seq, seq);
    OCU_TAKE(out.window, window);
    OCU_TAKE(out.fields, fields);
    OCU_TAKE(out.payload_bytes, payload_bytes);
    OCU_TAKE(out.payload_checksum, payload_checksum);
    if (out.fields != 0) OCU_TAKE(out.n_vertices, n_vertices);
    if ((out.fields & field::mesh) != 0) OCU_TAKE(out.n_triangles, n_triangles);
    if (in_.has_n_interfaces()) out.n_interfaces = in_.n_interfaces();
    if (out.n_interfaces == 0 || out.n_interfaces > max_interfaces)
      refuse(fmt::format("{} of {} interfaces, 1 to {} are accepted", to_word(kind_),
                         out.n_interfaces, max_interfaces));
    if (in_.memory_pid() == 0) return;
    out.memory.pid = in_.memory_pid();
    OCU_TAKE(out.memory.fd, memory_fd);
    OCU_TAKE(out.memory.offset, memory_offset);
    out.memory_mark = in_.memory_mark();
  }
  void hello(Header& out) const {
    OCU_TAKE(out.major, protocol_major);
    OCU_TAKE(out.minor, protocol_minor);
    OCU_TAKE(out.program, program);
    OCU_TAKE(out.token, token);
    OCU_TAKE(out.case_hash, case_hash);
    out.role = role();
    out.name = cut(in_.name(), max_text_bytes);
    double mark = 0.0;
    OCU_TAKE(mark, byte_order_mark);
    if (mark != byte_order_mark)
      refuse(fmt::format("HELLO: byte order mark is {}, must be {}", mark, byte_order_mark));
  }
  void step(Header& out) const {
    OCU_TAKE_FINITE(out.t_begin, t_begin_s);
    OCU_TAKE_FINITE(out.t_end, t_end_s);
    OCU_TAKE(out.steps, steps);
    OCU_TAKE(out.idle, idle);
    out.iteration = in_.iteration();
  }
  void order(Header& out) const {
    step(out);
    if (in_.load_shape() != proto::LOAD_SHAPE_LINEAR &&
        in_.load_shape() != proto::LOAD_SHAPE_CONSTANT)
      refuse("STEP: unknown load_shape");
    if (in_.wall_path() != proto::WALL_PATH_CUBIC && in_.wall_path() != proto::WALL_PATH_STRAIGHT)
      refuse("STEP: unknown wall_path");
    out.load_shape =
        in_.load_shape() == proto::LOAD_SHAPE_LINEAR ? LoadShape::linear : LoadShape::constant;
    out.wall_path =
        in_.wall_path() == proto::WALL_PATH_CUBIC ? WallPath::cubic : WallPath::straight;
    out.wants_acceleration = in_.wants_acceleration();
  }
  void stable_step(Header& out) const {
    OCU_TAKE_FINITE(out.stable_step, stable_step_s);
    if (out.stable_step <= 0.0)
      refuse(fmt::format("{}: stable_step_s is {}, must be > 0", to_word(kind_), out.stable_step));
  }
  void result(Header& out) const {
    step(out);
    stable_step(out);
    OCU_TAKE_FINITE(out.work, work_j);
    OCU_TAKE_FINITE(out.impulse[0], impulse_x_n_s);
    OCU_TAKE_FINITE(out.impulse[1], impulse_y_n_s);
    OCU_TAKE_FINITE(out.impulse[2], impulse_z_n_s);
    OCU_TAKE_FINITE(out.impedance, impedance_kg_m2_s);
    OCU_TAKE_FINITE(out.mass_per_area, mass_per_area_kg_m2);
    OCU_TAKE_FINITE(out.compute_seconds, compute_s);
    out.status = cut(in_.status(), max_status_bytes);
  }
  void ready(Header& out) const {
    stable_step(out);
    OCU_TAKE_FINITE(out.time, time_s);
    OCU_TAKE(out.mesh_hash, mesh_hash);
    out.shares_memory = in_.shares_memory();
    out.takes_packets = in_.takes_packets();
    out.takes_force = in_.takes_force();
  }
  void by_kind(Header& out) const {
    switch (kind_) {
      case Kind::hello:
        hello(out);
        break;
      case Kind::welcome:
        OCU_TAKE_FINITE(out.silence_limit, silence_limit_s);
        out.packet_path = cut(in_.packet_path(), max_text_bytes);
        out.packet_mark = in_.packet_mark();
        break;
      case Kind::mesh:
        OCU_TAKE(out.mesh_hash, mesh_hash);
        out.mesh_name = cut(in_.mesh_name(), max_text_bytes);
        out.takes_force = in_.takes_force();
        out.n_quads = in_.n_quads();
        if (out.n_quads > out.n_triangles / 2)
          refuse(fmt::format("MESH of {} quads has {} triangles, two are needed for each",
                             out.n_quads, out.n_triangles));
        break;
      case Kind::ready:
        ready(out);
        break;
      case Kind::step:
        order(out);
        break;
      case Kind::result:
        result(out);
        break;
      case Kind::checkpoint:
        OCU_TAKE(out.directory, directory);
        break;
      case Kind::abort:
        OCU_TAKE(out.reason, reason);
        if (in_.has_exit_code()) out.exit_code = in_.exit_code();
        break;
      case Kind::wait:
        out.reason = cut(in_.reason(), max_text_bytes);
        break;
      case Kind::done:
      case Kind::finish:
      case Kind::bye:
        break;
    }
  }
#undef OCU_TAKE
#undef OCU_TAKE_FINITE

 private:
  [[nodiscard]] Role role() const {
    if (in_.role() == proto::ROLE_FLOW) return Role::flow;
    if (in_.role() == proto::ROLE_SOLID) return Role::solid;
    refuse("HELLO: unknown role");
  }
  const proto::Header& in_;
  Kind kind_;
};

/// Fields that may stand in a message of this kind.
std::uint32_t fields_allowed(Kind kind) {
  using namespace field;
  switch (kind) {
    case Kind::mesh:
      return mesh;
    case Kind::ready:
      return position | velocity | acceleration;
    case Kind::step:
      return position | velocity | overpressure | force;
    case Kind::result:
      return position | velocity | acceleration | overpressure | force | balance;
    default:
      return 0;
  }
}

}  // namespace

std::string encode(const Header& header) {
  proto::Header out;
  out.set_kind(static_cast<proto::Kind>(header.kind));
  out.set_run_id(header.run_id);
  out.set_seq(header.seq);
  out.set_window(header.window);
  out.set_fields(header.fields);
  out.set_payload_bytes(header.payload_bytes);
  out.set_payload_checksum(header.payload_checksum);
  if (header.fields != 0) out.set_n_vertices(header.n_vertices);
  if ((header.fields & field::mesh) != 0) out.set_n_triangles(header.n_triangles);
  if (header.n_interfaces != 1) out.set_n_interfaces(header.n_interfaces);
  put_memory(header, out);
  switch (header.kind) {
    case Kind::hello:
      put_hello(header, out);
      break;
    case Kind::welcome:
      out.set_silence_limit_s(header.silence_limit);
      if (header.packet_path.empty()) break;
      out.set_packet_path(header.packet_path);
      out.set_packet_mark(header.packet_mark);
      break;
    case Kind::mesh:
      out.set_mesh_hash(header.mesh_hash);
      out.set_mesh_name(cut(header.mesh_name, max_text_bytes));
      if (header.takes_force) out.set_takes_force(true);
      if (header.n_quads > 0) out.set_n_quads(header.n_quads);
      break;
    case Kind::ready:
      out.set_stable_step_s(header.stable_step);
      out.set_time_s(header.time);
      out.set_mesh_hash(header.mesh_hash);
      out.set_shares_memory(header.shares_memory);
      if (header.takes_packets) out.set_takes_packets(true);
      if (header.takes_force) out.set_takes_force(true);
      break;
    case Kind::step:
      put_order(header, out);
      break;
    case Kind::result:
      put_result(header, out);
      break;
    case Kind::checkpoint:
      out.set_directory(cut(header.directory, max_text_bytes));
      break;
    case Kind::abort:
      out.set_exit_code(header.exit_code);
      [[fallthrough]];
    case Kind::wait:
      out.set_reason(cut(header.reason, max_text_bytes));
      break;
    case Kind::done:
    case Kind::finish:
    case Kind::bye:
      break;
  }
  return out.SerializeAsString();
}

Header decode(std::string_view bytes) {
  if (bytes.size() > max_header_bytes)
    refuse(
        fmt::format("header of {} bytes, at most {} are accepted", bytes.size(), max_header_bytes));
  // What is wrong with a header is said by us; protobuf's own lines on standard error are not
  // wanted.
  const google::protobuf::LogSilencer quiet;
  proto::Header in;
  if (!in.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) refuse("not a header");
  // Fields of a newer minor version are allowed but must not pile up.
  in.DiscardUnknownFields();
  const int kind = in.kind();
  if (kind < static_cast<int>(Kind::hello) || kind > static_cast<int>(Kind::wait))
    refuse(fmt::format("header of unknown kind {}", kind));
  Header out;
  out.kind = static_cast<Kind>(kind);
  const Reader reader(in, out.kind);
  reader.common(out);
  reader.by_kind(out);
  if ((out.fields & ~fields_allowed(out.kind)) != 0)
    refuse(fmt::format("{} with fields {:#x}, allowed {:#x}", to_word(out.kind), out.fields,
                       fields_allowed(out.kind)));
  if (out.n_vertices > max_interface_vertices || out.n_triangles > 4 * max_interface_vertices)
    refuse(fmt::format("{} of {} vertices and {} triangles, at most {} vertices are accepted",
                       to_word(out.kind), out.n_vertices, out.n_triangles, max_interface_vertices));
  if (out.payload_bytes != payload_bytes_expected(out))
    refuse(fmt::format("{} announces {} bytes, its fields and counts make {}", to_word(out.kind),
                       out.payload_bytes, payload_bytes_expected(out)));
  return out;
}

std::uint64_t payload_bytes_expected(const Header& header) {
  const std::uint64_t n = header.n_vertices;
  std::uint64_t bytes = 0;
  for (const auto vector : {field::position, field::velocity, field::acceleration, field::force})
    if ((header.fields & vector) != 0) bytes += 3 * sizeof(double) * n;
  if ((header.fields & field::overpressure) != 0) bytes += sizeof(double) * n;
  if ((header.fields & field::balance) != 0) bytes += 4 * sizeof(double) * header.n_interfaces;
  if ((header.fields & field::mesh) != 0)
    bytes += 3 * sizeof(double) * n + 3 * sizeof(std::int32_t) * header.n_triangles;
  return bytes;
}

std::string contract_text() {
  return proto::Header::descriptor()->file()->DebugString();
}

std::string_view to_word(Kind kind) {
  switch (kind) {
    case Kind::hello:
      return "HELLO";
    case Kind::welcome:
      return "WELCOME";
    case Kind::mesh:
      return "MESH";
    case Kind::ready:
      return "READY";
    case Kind::step:
      return "STEP";
    case Kind::result:
      return "RESULT";
    case Kind::checkpoint:
      return "CHECKPOINT";
    case Kind::done:
      return "DONE";
    case Kind::finish:
      return "FINISH";
    case Kind::bye:
      return "BYE";
    case Kind::abort:
      return "ABORT";
    case Kind::wait:
      return "WAIT";
  }
  return "?";
}

std::string_view to_word(Role role) {
  return role == Role::flow ? "flow" : "solid";
}

}  // namespace ocublast::link
