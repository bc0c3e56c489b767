#include "coupler/link/payload.hpp"

#include <malloc.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstring>

#define XXH_INLINE_ALL
#include <fmt/format.h>
#include <xxhash.h>

#include "coupler/base/errors.hpp"
#include "coupler/base/wide_clones.hpp"
#include "coupler/link/checksum_wide.hpp"

namespace ocublast::link {

static_assert(std::endian::native == std::endian::little, "payloads are little-endian");
static_assert(sizeof(double) == 8);

/// Shorter ones do not fill wide registers often enough to matter, bytes.
constexpr std::size_t wide_from = 4096;

std::uint64_t checksum(std::span<const std::byte> bytes) noexcept {
  if (bytes.size() >= wide_from && __builtin_cpu_supports("avx512f"))
    return checksum_avx512(bytes.data(), bytes.size());
  if (bytes.size() >= wide_from && __builtin_cpu_supports("avx2"))
    return checksum_avx2(bytes.data(), bytes.size());
  return bytes.empty() ? 0 : XXH3_64bits(bytes.data(), bytes.size());
}

OCU_WIDE_CLONES bool all_finite(std::span<const double> values) noexcept {
  // 0 x is 0 for a finite x and not a number else. Eight sums, so that the loop vectorises without
  // reordering any of them.
  constexpr std::size_t lanes = 8;
  std::array<double, lanes> sums{};
  std::size_t i = 0;
  for (; i + lanes <= values.size(); i += lanes)
    for (std::size_t k = 0; k < lanes; ++k) sums[k] += 0.0 * values[i + k];
  for (; i < values.size(); ++i) sums[0] += 0.0 * values[i];
  double sum = 0.0;
  for (const double s : sums) sum += s;
  return sum == 0.0;
}

std::size_t first_not_finite(std::span<const double> values) noexcept {
  std::size_t i = 0;
  while (i < values.size() && std::isfinite(values[i])) ++i;
  return i;
}

PayloadView view_payload(const Header& header, std::span<const std::byte> bytes) {
  PayloadView view;
  const auto* at = reinterpret_cast<const double*>(bytes.data());
  const auto take = [&](std::uint32_t bit, std::size_t n) -> std::span<const double> {
    if ((header.fields & bit) == 0) return {};
    const std::span<const double> part(at, n);
    at += n;
    return part;
  };
  const std::size_t n = header.n_vertices;
  view.position = take(field::position, 3 * n);
  view.velocity = take(field::velocity, 3 * n);
  view.acceleration = take(field::acceleration, 3 * n);
  view.overpressure = take(field::overpressure, n);
  view.force = take(field::force, 3 * n);
  view.balance = take(field::balance, 4 * std::size_t{header.n_interfaces});
  return view;
}

namespace {

[[noreturn]] void refuse_not_finite(const Header& header, const PayloadView& view) {
  struct Named {
    const char* name;
    std::span<const double> values;
    std::size_t components;
  };
  const std::array<Named, 6> parts{{{"position", view.position, 3},
                                    {"velocity", view.velocity, 3},
                                    {"acceleration", view.acceleration, 3},
                                    {"overpressure", view.overpressure, 1},
                                    {"force", view.force, 3},
                                    {"balance", view.balance, 4}}};
  for (const auto& part : parts) {
    const std::size_t at = first_not_finite(part.values);
    if (at == part.values.size()) continue;
    throw LinkError(fmt::format("{} of window {}: {} of vertex {} is {}, must be finite",
                                to_word(header.kind), header.window, part.name,
                                at / part.components, part.values[at]));
  }
  throw LinkError(
      fmt::format("{} of window {}: a value is not finite", to_word(header.kind), header.window));
}

}  // namespace

void check_payload(const Header& header, std::span<const std::byte> bytes) {
  if (bytes.size() != header.payload_bytes)
    throw LinkError(fmt::format("{} of window {}: {} payload bytes came, {} were announced",
                                to_word(header.kind), header.window, bytes.size(),
                                header.payload_bytes));
  // Memory of this machine is no transport that could damage them.
  const bool transported = header.memory.pid == 0;
  const std::uint64_t found = transported ? checksum(bytes) : 0;
  if (found != header.payload_checksum)
    throw LinkError(fmt::format("{} of window {}: payload checksum {:016x}, announced {:016x}",
                                to_word(header.kind), header.window, found,
                                header.payload_checksum));
  if ((header.fields & field::mesh) != 0 || bytes.empty()) return;
  const std::span<const double> values(reinterpret_cast<const double*>(bytes.data()),
                                       bytes.size() / sizeof(double));
  if (!all_finite(values)) refuse_not_finite(header, view_payload(header, bytes));
}

std::string mesh_payload(const InterfaceMesh& mesh) {
  const std::size_t points = mesh.vertices.size() * sizeof(double);
  const std::size_t corners = mesh.triangles.size() * sizeof(std::int32_t);
  std::string bytes(points + corners, '\0');
  if (points > 0) std::memcpy(bytes.data(), mesh.vertices.data(), points);
  if (corners > 0) std::memcpy(bytes.data() + points, mesh.triangles.data(), corners);
  return bytes;
}

InterfaceMesh mesh_from_payload(const Header& header, std::span<const std::byte> bytes) {
  InterfaceMesh mesh;
  mesh.name = header.mesh_name;
  mesh.takes_force = header.takes_force;
  mesh.n_quads = header.n_quads;
  mesh.vertices.resize(3 * header.n_vertices);
  mesh.triangles.resize(3 * header.n_triangles);
  const std::size_t points = mesh.vertices.size() * sizeof(double);
  if (bytes.size() != points + mesh.triangles.size() * sizeof(std::int32_t))
    throw LinkError("MESH: payload length does not fit the counts");
  if (points > 0) std::memcpy(mesh.vertices.data(), bytes.data(), points);
  if (!mesh.triangles.empty())
    std::memcpy(mesh.triangles.data(), bytes.data() + points, bytes.size() - points);
  const std::size_t bad = first_not_finite(mesh.vertices);
  if (bad != mesh.vertices.size())
    throw LinkError(fmt::format("MESH '{}': vertex {} is not finite", mesh.name, bad / 3));
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    if (mesh.triangles[i] < 0 || static_cast<std::size_t>(mesh.triangles[i]) >= mesh.n_vertices())
      throw LinkError(fmt::format("MESH '{}': triangle {} names vertex {}, there are {}", mesh.name,
                                  i / 3, mesh.triangles[i], mesh.n_vertices()));
  for (std::size_t q = 0; q < mesh.n_quads; ++q) {
    const std::int32_t* t = &mesh.triangles[6 * q];
    if (t[0] != t[3] || t[2] != t[4])
      throw LinkError(fmt::format(
          "MESH '{}': triangles {} and {} are not the halves (a, b, c), (a, c, d) of a quad",
          mesh.name, 2 * q, 2 * q + 1));
  }
  return mesh;
}

void keep_freed_memory() noexcept {
  constexpr int megabyte = 1 << 20;
  mallopt(M_MMAP_THRESHOLD, 256 * megabyte);
  mallopt(M_TRIM_THRESHOLD, 1024 * megabyte - 1);
  mallopt(M_TOP_PAD, 16 * megabyte);
}

}  // namespace ocublast::link
