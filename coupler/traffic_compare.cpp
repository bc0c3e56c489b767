#include "coupler/traffic_compare.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "coupler/link/payload.hpp"

namespace ocublast::coupler {

using link::Header;
using link::to_word;

Header comparable(Header header) {
  header.run_id = 0;
  header.seq = 0;
  header.compute_seconds = 0.0;
  header.status.clear();
  header.directory.clear();
  header.program.clear();
  header.token.clear();
  header.memory = {};
  header.shares_memory = false;
  header.takes_packets = false;
  return header;
}

namespace {

bool agree(double a, double b, double allowed) {
  if (std::memcmp(&a, &b, sizeof a) == 0) return true;
  return allowed > 0.0 && std::abs(a - b) <= allowed;
}

std::optional<std::string> differ(const Header& h, const char* name, double expected, double found,
                                  double tolerance) {
  if (agree(expected, found, tolerance * std::max(std::abs(expected), std::abs(found)))) return {};
  return fmt::format("window {}: {} of {}: recorded {}, found {}", h.window, name, to_word(h.kind),
                     expected, found);
}

std::optional<std::string> differ_in_counts(const Header& a, const Header& b) {
  if (a.kind != b.kind)
    return fmt::format("window {}: recorded {}, found {}", a.window, to_word(a.kind),
                       to_word(b.kind));
  const std::array<std::pair<const char*, std::pair<std::uint64_t, std::uint64_t>>, 9> counts{
      {{"window", {a.window, b.window}},
       {"fields", {a.fields, b.fields}},
       {"number of vertices", {a.n_vertices, b.n_vertices}},
       {"number of triangles", {a.n_triangles, b.n_triangles}},
       {"mesh hash", {a.mesh_hash, b.mesh_hash}},
       {"steps", {a.steps, b.steps}},
       {"iteration", {a.iteration, b.iteration}},
       {"idle", {a.idle ? 1U : 0U, b.idle ? 1U : 0U}},
       {"payload bytes", {a.payload_bytes, b.payload_bytes}}}};
  for (const auto& [name, values] : counts)
    if (values.first != values.second)
      return fmt::format("window {}: {} of {}: recorded {}, found {}", a.window, name,
                         to_word(a.kind), values.first, values.second);
  return {};
}

std::optional<std::string> differ_in_field(const Header& h, const char* name,
                                           std::size_t components, std::span<const double> a,
                                           std::span<const double> b, double tolerance) {
  double scale = 0.0;
  for (const double v : a) scale = std::max(scale, std::abs(v));
  for (std::size_t i = 0; i < a.size(); ++i)
    if (!agree(a[i], b[i], tolerance * scale))
      return fmt::format("window {} (t = {} s): {}{} of vertex {}: recorded {}, found {}", h.window,
                         h.t_end, name, components == 3 ? std::string(1, '.') + "xyz"[i % 3] : "",
                         i / components, a[i], b[i]);
  return {};
}

}  // namespace

std::optional<std::string> first_difference(const Header& a, std::span<const std::byte> a_payload,
                                            const Header& b, std::span<const std::byte> b_payload,
                                            double tolerance) {
  if (auto d = differ_in_counts(a, b)) return d;
  if ((a.fields & link::field::mesh) != 0) {
    if (std::equal(a_payload.begin(), a_payload.end(), b_payload.begin(), b_payload.end()))
      return {};
    return std::string("the interface meshes differ");
  }
  const auto va = link::view_payload(a, a_payload);
  const auto vb = link::view_payload(b, b_payload);
  const auto in_field = [&](const char* name, std::size_t components, std::span<const double> x,
                            std::span<const double> y) {
    return differ_in_field(a, name, components, x, y, tolerance);
  };
  // Values at vertices first: they say most.
  if (auto d = in_field("position", 3, va.position, vb.position)) return d;
  if (auto d = in_field("velocity", 3, va.velocity, vb.velocity)) return d;
  if (auto d = in_field("acceleration", 3, va.acceleration, vb.acceleration)) return d;
  if (auto d = in_field("overpressure", 1, va.overpressure, vb.overpressure)) return d;
  const std::array<std::pair<const char*, std::pair<double, double>>, 10> numbers{
      {{"t_begin", {a.t_begin, b.t_begin}},
       {"t_end", {a.t_end, b.t_end}},
       {"stable step", {a.stable_step, b.stable_step}},
       {"work", {a.work, b.work}},
       {"impulse.x", {a.impulse[0], b.impulse[0]}},
       {"impulse.y", {a.impulse[1], b.impulse[1]}},
       {"impulse.z", {a.impulse[2], b.impulse[2]}},
       {"impedance", {a.impedance, b.impedance}},
       {"mass per area", {a.mass_per_area, b.mass_per_area}},
       {"time", {a.time, b.time}}}};
  for (const auto& [name, values] : numbers)
    if (auto d = differ(a, name, values.first, values.second, tolerance)) return d;
  return {};
}

}  // namespace ocublast::coupler
