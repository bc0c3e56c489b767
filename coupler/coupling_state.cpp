#include "coupler/coupling_state.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <fstream>
#include <iterator>

#include "coupler/base/errors.hpp"
#include "coupler/link/checkpoint_place.hpp"
#include "coupler/link/payload.hpp"

namespace ocublast::coupler {

SharedValues SharedValues::from(std::vector<double> values) {
  auto owner = std::make_shared<std::vector<double>>(std::move(values));
  return {owner, *owner};
}

std::span<double> SharedValues::own() {
  if (owner.use_count() > 1) *this = from({values.begin(), values.end()});
  return {const_cast<double*>(values.data()),
          values.size()};  // no constants: `from` made them of a vector
}

namespace {

constexpr std::string_view magic = "OCUSTAT4";

/// The numbers of a state as they lie in the file.
struct Fixed {
  std::uint64_t case_hash, mesh_hash, window;
  double time, stable_flow, stable_solid, impedance, mass_per_area, theta_max, width_before;
  std::uint64_t solid_at_rest, wall_current, zero_loads;
  Balance balance;
  std::uint64_t has_ahead;
  TimeWindow ahead;
  std::uint64_t ahead_idle, ahead_steps;
  double ahead_work, ahead_impulse[3], ahead_impedance, ahead_stable_step;
  std::array<std::uint64_t, 9> lengths;  ///< of the arrays that follow, in the order of arrays_of
};
static_assert(std::is_trivially_copyable_v<Fixed>);

/// The arrays of a state in the order of the file; the last two only where the flow is ahead.
std::array<SharedValues*, 9> arrays_of(CouplingState& s, FlowAhead& ahead) {
  return {&s.position, &s.velocity, &s.velocity_before, &s.acceleration, &s.load,
          &s.wall,     &s.path_end, &ahead.load,        &ahead.balance};
}

Fixed to_fixed(const CouplingState& s, std::uint64_t case_hash, std::uint64_t mesh_hash) {
  Fixed f{};
  f.case_hash = case_hash;
  f.mesh_hash = mesh_hash;
  f.window = s.window;
  f.time = s.time;
  f.stable_flow = s.stable_flow;
  f.stable_solid = s.stable_solid;
  f.impedance = s.impedance;
  f.mass_per_area = s.mass_per_area;
  f.theta_max = s.theta_max;
  f.width_before = s.width_before;
  f.solid_at_rest = s.solid_at_rest;
  f.wall_current = s.wall_current;
  f.zero_loads = s.zero_loads;
  f.balance = s.balance;
  if (!s.ahead) return f;
  f.has_ahead = 1;
  f.ahead = s.ahead->window;
  f.ahead_idle = s.ahead->idle;
  f.ahead_steps = s.ahead->steps;
  f.ahead_work = s.ahead->work;
  std::copy(s.ahead->impulse.begin(), s.ahead->impulse.end(), f.ahead_impulse);
  f.ahead_impedance = s.ahead->impedance;
  f.ahead_stable_step = s.ahead->stable_step;
  return f;
}

CouplingState from_fixed(const Fixed& f) {
  CouplingState s;
  s.window = f.window;
  s.time = f.time;
  s.stable_flow = f.stable_flow;
  s.stable_solid = f.stable_solid;
  s.impedance = f.impedance;
  s.mass_per_area = f.mass_per_area;
  s.theta_max = f.theta_max;
  s.width_before = f.width_before;
  s.solid_at_rest = f.solid_at_rest != 0;
  s.wall_current = f.wall_current != 0;
  s.zero_loads = f.zero_loads;
  s.balance = f.balance;
  if (f.has_ahead == 0) return s;
  s.ahead = FlowAhead{.window = f.ahead,
                      .idle = f.ahead_idle != 0,
                      .steps = static_cast<std::uint32_t>(f.ahead_steps),
                      .work = f.ahead_work,
                      .impulse = {f.ahead_impulse[0], f.ahead_impulse[1], f.ahead_impulse[2]},
                      .impedance = f.ahead_impedance,
                      .stable_step = f.ahead_stable_step,
                      .load = {},
                      .balance = {}};
  return s;
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

std::uint64_t hash_of(std::string_view bytes) {
  return link::checksum(std::as_bytes(std::span(bytes)));
}

}  // namespace

void write_state(const std::filesystem::path& directory, const CouplingState& state,
                 std::uint64_t case_hash, std::uint64_t mesh_hash) {
  Fixed fixed = to_fixed(state, case_hash, mesh_hash);
  CouplingState copy = state;
  FlowAhead ahead = state.ahead.value_or(FlowAhead{});
  const auto arrays = arrays_of(copy, ahead);
  for (std::size_t k = 0; k < arrays.size(); ++k) fixed.lengths[k] = arrays[k]->values.size();
  std::string bytes(magic);
  bytes.append(reinterpret_cast<const char*>(&fixed), sizeof fixed);
  for (const SharedValues* array : arrays) add_values(bytes, array->values);
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
    throw LinkError(
        fmt::format("{}: missing, or not a coupler's state of this version", file.string()));
  std::uint64_t hash = 0;
  std::memcpy(&hash, bytes.data() + bytes.size() - sizeof hash, sizeof hash);
  std::memcpy(&fixed, bytes.data() + magic.size(), sizeof fixed);
  std::uint64_t n_values = 0;
  for (const auto length : fixed.lengths) n_values += length;
  if (hash != hash_of(std::string_view(bytes).substr(0, bytes.size() - sizeof hash)) ||
      bytes.size() != overhead + n_values * sizeof(double))
    throw LinkError(fmt::format("{}: damaged; resume from another checkpoint", file.string()));
  StoredState stored{
      .state = from_fixed(fixed), .case_hash = fixed.case_hash, .mesh_hash = fixed.mesh_hash};
  FlowAhead ahead;
  const auto arrays = arrays_of(stored.state, ahead);
  std::size_t at = magic.size() + sizeof fixed;
  for (std::size_t k = 0; k < arrays.size(); ++k)
    if (fixed.lengths[k] > 0) *arrays[k] = take_values(bytes, at, fixed.lengths[k]);
  if (stored.state.ahead) {
    stored.state.ahead->load = ahead.load;
    stored.state.ahead->balance = ahead.balance;
  }
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
  for (const auto& entry : std::filesystem::recursive_directory_iterator(part)) sync(entry.path());
  std::filesystem::remove_all(directory);  // of a run that was resumed from before it
  std::filesystem::rename(part, directory);
  sync(directory.parent_path());
  std::vector<std::filesystem::path> complete;
  for (const auto& entry : std::filesystem::directory_iterator(directory.parent_path()))
    if (entry.is_directory() && entry.path().extension() != ".part")
      complete.push_back(entry.path());
  std::sort(complete.begin(), complete.end());
  for (std::size_t i = 0; i + static_cast<std::size_t>(keep) < complete.size(); ++i)
    std::filesystem::remove_all(complete[i]);
}

}  // namespace ocublast::coupler
