#include "coupler/link/keys.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <fstream>
#include <zmq.hpp>

#include "coupler/base/errors.hpp"
#include "coupler/link/message.hpp"

namespace ocublast::link {
namespace {

constexpr std::size_t key_characters = 40;

CurvePair make_pair_of_keys() {
  std::array<char, key_characters + 1> public_key{};
  std::array<char, key_characters + 1> secret_key{};
  if (zmq_curve_keypair(public_key.data(), secret_key.data()) != 0)
    throw LinkError("this ZeroMQ library has no CURVE encryption; tcp endpoints need it");
  return {public_key.data(), secret_key.data()};
}

std::filesystem::path key_file(const std::filesystem::path& directory, const std::string& name) {
  return directory / (name + ".key");
}

/// Writes aside with mode 0600 from the first byte on, then renames.
void write_private(const std::filesystem::path& file, const std::string& text) {
  auto aside = file;
  aside += ".part";
  ::unlink(aside.c_str());
  const int fd = ::open(aside.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  if (fd < 0) throw LinkError(fmt::format("{}: cannot be created", aside.string()));
  const bool written = ::write(fd, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  if (::close(fd) != 0 || !written)
    throw LinkError(fmt::format("{}: cannot be written; is the disk full?", aside.string()));
  std::filesystem::rename(aside, file);
}

}  // namespace

CouplerKeys make_keys(const std::filesystem::path& directory, const std::string& token,
                      const std::vector<std::string>& files) {
  std::filesystem::create_directories(directory);
  CouplerKeys keys;
  keys.own = make_pair_of_keys();
  for (const std::string& name : files) {
    const CurvePair pair = make_pair_of_keys();
    keys.admitted.push_back(pair.public_key);
    write_private(key_file(directory, name), fmt::format("{}\n{}\n{}\n{}\n", keys.own.public_key,
                                                         pair.public_key, pair.secret_key, token));
  }
  return keys;
}

namespace {

std::filesystem::path own_key_file(const std::filesystem::path& directory) {
  return directory / "coupler.key";
}

void require_private(const std::filesystem::path& file, const struct stat& status) {
  if ((status.st_mode & 077) != 0)
    throw LinkError(fmt::format("{}: mode is {:o}, others must not read it (600)", file.string(),
                                status.st_mode & 0777));
}

}  // namespace

void write_key_set(const std::filesystem::path& directory, const std::string& token,
                   const std::vector<std::string>& files) {
  const auto file = own_key_file(directory);
  if (std::filesystem::exists(file))
    throw LinkError(
        fmt::format("{}: is there already; remove it if its runs are over", file.string()));
  const CouplerKeys keys = make_keys(directory, token, files);
  write_private(file, fmt::format("{}\n{}\n{}\n{}\n", keys.own.public_key, keys.own.secret_key,
                                  token, fmt::join(keys.admitted, "\n")));
}

std::optional<KeySet> read_key_set(const std::filesystem::path& directory) {
  const auto file = own_key_file(directory);
  struct stat status {};
  if (::stat(file.c_str(), &status) != 0) return {};
  require_private(file, status);
  std::ifstream in(file);
  KeySet set;
  in >> set.keys.own.public_key >> set.keys.own.secret_key >> set.token;
  bool whole = static_cast<bool>(in);
  for (std::string key; in >> key;) set.keys.admitted.push_back(key);
  whole = whole && set.keys.admitted.size() >= 2 &&
          set.keys.own.public_key.size() == key_characters &&
          set.keys.own.secret_key.size() == key_characters;
  for (const auto& key : set.keys.admitted) whole = whole && key.size() == key_characters;
  if (!whole)
    throw LinkError(fmt::format("{}: not a key file; make one with coupler keygen", file.string()));
  return set;
}

ParticipantKeys read_keys(const std::filesystem::path& directory, const std::string& name) {
  const auto file = key_file(directory, name);
  struct stat status {};
  if (::stat(file.c_str(), &status) != 0)
    throw LinkError(
        fmt::format("{}: no such key file; the coupler writes it when it starts with a "
                    "tcp endpoint",
                    file.string()));
  require_private(file, status);
  std::ifstream in(file);
  ParticipantKeys keys;
  in >> keys.coupler_public >> keys.own.public_key >> keys.own.secret_key >> keys.token;
  if (!in || keys.coupler_public.size() != key_characters ||
      keys.own.public_key.size() != key_characters || keys.own.secret_key.size() != key_characters)
    throw LinkError(fmt::format("{}: not a key file", file.string()));
  return keys;
}

namespace {

template <class T>
T random_bits() {
  T value{};
  if (::getrandom(&value, sizeof value, 0) != static_cast<ssize_t>(sizeof value))
    throw LinkError("the kernel gives no random numbers");
  return value;
}

}  // namespace

std::string make_token() {
  return fmt::format("{:016x}{:016x}", random_bits<std::uint64_t>(), random_bits<std::uint64_t>());
}

std::uint64_t make_run_id() {
  std::uint64_t id = 0;
  while (id == 0) id = random_bits<std::uint64_t>();
  return id;
}

}  // namespace ocublast::link
