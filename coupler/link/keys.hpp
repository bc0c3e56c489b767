#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "coupler/link/participant.hpp"

namespace ocublast::link {

/// A CURVE key pair, each key as 40 characters of Z85 text (ZeroMQ RFC 32).
struct CurvePair {
  std::string public_key;
  std::string secret_key;
};

/// What a participant needs to reach its coupler over tcp.
struct ParticipantKeys {
  std::string coupler_public;
  CurvePair own;
  std::string token;
};

/// What the coupler needs: its own pair and the only two keys it admits.
struct CouplerKeys {
  CurvePair own;
  std::vector<std::string> admitted;  ///< public keys, the flow's first
};

/// Makes the keys of one run and writes DIRECTORY/FILE.key for every participant (flow and solid;
/// with several solids flow and their names), readable by the owner alone; the coupler's own secret
/// is not written. Old files are replaced, each at once.
[[nodiscard]] CouplerKeys make_keys(const std::filesystem::path& directory,
                                    const std::string& token,
                                    const std::vector<std::string>& files);

/// Makes keys for many runs: also DIRECTORY/coupler.key with the coupler's secret, the token, and
/// the keys it admits. Throws LinkError where there is a coupler.key already.
void write_key_set(const std::filesystem::path& directory, const std::string& token,
                   const std::vector<std::string>& files);

struct KeySet {
  CouplerKeys keys;
  std::string token;
};
/// What write_key_set wrote; nothing where there is no coupler.key. Throws LinkError when it is
/// malformed, or open to others.
[[nodiscard]] std::optional<KeySet> read_key_set(const std::filesystem::path& directory);

/// Reads a participant's key file. Throws LinkError when it is missing, malformed, or open to
/// others. `file`: without its ending, as in make_keys.
[[nodiscard]] ParticipantKeys read_keys(const std::filesystem::path& directory,
                                        const std::string& file);

/// 128 random bits from the kernel as 32 hexadecimal digits.
[[nodiscard]] std::string make_token();
/// 64 random bits from the kernel, never 0.
[[nodiscard]] std::uint64_t make_run_id();

}  // namespace ocublast::link
