#include "coupler/coupling_state.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <iterator>

#include <fmt/format.h>

#include "coupler/base/errors.hpp"
#include "coupler/link/checkpoint_place.hpp"
#include "coupler/link/payload.hpp"

namespace ocublast::coupler {

SharedValues SharedValues::from(std::vector<double> values) {
  auto owner = std::make_shared<const std::vector<double>>(std::move(values));
  return {owner, *owner};
}

namespace {

constexpr std::string_view magic = "OCUSTAT1";

/// The numbers of a state as they lie in the file.
struct Fixed {
  std::uint64_t case_hash, mesh_hash, window, n_values;
  double time, stable_flow, stable_solid, impedance, mass_per_area, theta_max, width_before;
  std::uint64_t solid_at_rest, wall_current, load_zero, has_before;
  Balance balance;
};
static_assert(std::is_trivially_copyable_v<Fixed>);

Fixed to_fixed(const CouplingState& s, std::uint64_t case_hash, std::uint64_t mesh_hash) {
  return {case_hash, mesh_hash, s.window, s.position.values.size(),
          s.time, s.stable_flow, s.stable_solid, s.impedance, s.mass_per_area, s.theta_max,
          s.width_before, s.solid_at_rest, s.wall_current, s.load_zero,
          s.velocity_before.values.empty() ? 0U : 1U, s.balance};
}

void add_values(std::string& out, std::span<const double> values) {
  out.append(reinterpret_cast<const char*>(values.data()), values.size_bytes());
}

SharedValues take_values(const std::string& bytes, std::size_t& at, std::size_t n) {
  std::vector<double> values(n);
  if (n > 0) std::memcpy(values.data(), bytes.data() + at, n * sizeof(double));
  at += n * sizeof(double);
  return SharedValues::from(std::move(values));
}

std::uint64_t hash_of(std::string_view bytes) { return link::checksum(std::as_bytes(std::span(bytes))); }

}  // namespace

void write_state(const std::filesystem::path& directory, const CouplingState& state,
                 std::uint64_t case_hash, std::uint64_t mesh_hash) {
  const Fixed fixed = to_fixed(state, case_hash, mesh_hash);
  std::string bytes(magic);
  bytes.append(reinterpret_cast<const char*>(&fixed), sizeof fixed);
  add_values(bytes, state.position.values);
  add_values(bytes, state.velocity.values);
  add_values(bytes, state.velocity_before.values);
  const std::uint64_t hash = hash_of(bytes);
  bytes.append(reinterpret_cast<const char*>(&hash), sizeof hash);
  const auto file = directory / "coupler.state";
  std::ofstream out(file, std::ios::binary | std::ios::trunc);
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  out.close();
  if (!out) throw LinkError(fmt::format("{}: cannot be written; is the disk full?", file.string()));
}

StoredState read_state(const std::filesystem::path& directory) {
  const auto file = directory / "coupler.state";
  std::ifstream in(file, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  Fixed fixed{};
  constexpr std::size_t overhead = magic.size() + sizeof(Fixed) + sizeof(std::uint64_t);
  if (bytes.size() < overhead || !bytes.starts_with(magic))
    throw LinkError(fmt::format("{}: missing or not a coupler's state", file.string()));
  std::uint64_t hash = 0;
  std::memcpy(&hash, bytes.data() + bytes.size() - sizeof hash, sizeof hash);
  std::memcpy(&fixed, bytes.data() + magic.size(), sizeof fixed);
  const std::size_t n = fixed.n_values;
  if (hash != hash_of(std::string_view(bytes).substr(0, bytes.size() - sizeof hash)) ||
      bytes.size() != overhead + (2 + fixed.has_before) * n * sizeof(double))
    throw LinkError(fmt::format("{}: damaged; resume from another checkpoint", file.string()));
  StoredState stored{.case_hash = fixed.case_hash, .mesh_hash = fixed.mesh_hash};
  CouplingState& s = stored.state;
  s.window = fixed.window;
  s.time = fixed.time;
  s.stable_flow = fixed.stable_flow;
  s.stable_solid = fixed.stable_solid;
  s.impedance = fixed.impedance;
  s.mass_per_area = fixed.mass_per_area;
  s.theta_max = fixed.theta_max;
  s.width_before = fixed.width_before;
  s.solid_at_rest = fixed.solid_at_rest != 0;
  s.wall_current = fixed.wall_current != 0;
  s.load_zero = fixed.load_zero != 0;
  s.balance = fixed.balance;
  std::size_t at = magic.size() + sizeof fixed;
  s.position = take_values(bytes, at, n);
  s.velocity = take_values(bytes, at, n);
  if (fixed.has_before != 0) s.velocity_before = take_values(bytes, at, n);
  return stored;
}

namespace {

std::filesystem::path part_of(const std::filesystem::path& run, std::uint64_t window) {
  auto directory = link::checkpoint_directory(run, window);
  directory += ".part";
  return directory;
}

/// What a file or directory holds reaches the disk before its name changes.
void sync(const std::filesystem::path& path) {
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) return;
  ::fsync(fd);
  ::close(fd);
}

}  // namespace

std::filesystem::path begin_checkpoint(const std::filesystem::path& run, std::uint64_t window) {
  const auto directory = part_of(run, window);
  std::filesystem::remove_all(directory);
  std::filesystem::create_directories(directory);
  return std::filesystem::absolute(directory);
}

void complete_checkpoint(const std::filesystem::path& run, std::uint64_t window, int keep) {
  const auto directory = link::checkpoint_directory(run, window);
  const auto part = part_of(run, window);
  for (const auto& entry : std::filesystem::directory_iterator(part)) sync(entry.path());
  std::filesystem::remove_all(directory);  // of a run that was resumed from before it
  std::filesystem::rename(part, directory);
  sync(directory.parent_path());
  std::vector<std::filesystem::path> complete;
  for (const auto& entry : std::filesystem::directory_iterator(directory.parent_path()))
    if (entry.is_directory() && entry.path().extension() != ".part") complete.push_back(entry.path());
  std::sort(complete.begin(), complete.end());
  for (std::size_t i = 0; i + static_cast<std::size_t>(keep) < complete.size(); ++i)
    std::filesystem::remove_all(complete[i]);
}

}  // namespace ocublast::coupler
