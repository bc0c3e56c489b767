#include <fmt/format.h>

#include <charconv>
#include <cstdlib>
#include <string_view>

#include "coupler/link/message.hpp"
#include "coupler/link/participant.hpp"

namespace ocublast::link {
namespace {

std::string environment(const char* name) {
  const char* value = std::getenv(name);
  return value != nullptr ? value : "";
}

double silence_limit_from(const std::string& text, double fallback) {
  if (text.empty()) return fallback;
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !(value > 0.0) || value > 1e6)
    throw LinkError(fmt::format("OCUBLAST_SILENCE_LIMIT_S is '{}', accepted (0, 1e6] s", text));
  return value;
}

}  // namespace

bool started_by_coupler() {
  return !environment("OCUBLAST_ENDPOINT").empty();
}

Connection connection_from_environment(Role role, std::string program, std::uint64_t case_hash) {
  Connection connection;
  connection.role = role;
  connection.program = std::move(program);
  connection.case_hash = case_hash;
  if (role == Role::solid) connection.name = environment("OCUBLAST_NAME");
  connection.endpoint = environment("OCUBLAST_ENDPOINT");
  connection.token = environment("OCUBLAST_TOKEN");
  connection.keys = environment("OCUBLAST_KEYS");
  connection.silence_limit =
      silence_limit_from(environment("OCUBLAST_SILENCE_LIMIT_S"), connection.silence_limit);
  if (connection.endpoint.empty())
    throw LinkError(fmt::format(
        "this case couples flow and solid, but no coupler has started the {} side; run "
        "'coupler CASE.toml', or set OCUBLAST_ENDPOINT and OCUBLAST_TOKEN (or OCUBLAST_KEYS) to "
        "those of a waiting one",
        to_word(role)));
  const bool ipc = connection.endpoint.starts_with("ipc://");
  if (!ipc && !connection.endpoint.starts_with("tcp://"))
    throw LinkError(fmt::format("OCUBLAST_ENDPOINT is '{}', accepted: ipc://PATH, tcp://HOST:PORT",
                                connection.endpoint));
  if (!ipc && connection.keys.empty())
    throw LinkError(
        fmt::format("the endpoint {} needs keys: set OCUBLAST_KEYS to the directory the "
                    "coupler writes them to",
                    connection.endpoint));
  return connection;
}

}  // namespace ocublast::link
