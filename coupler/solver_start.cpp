#include "coupler/solver_start.hpp"

#include <sys/stat.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>

#include <fmt/format.h>

#include "coupler/base/errors.hpp"
#include "coupler/link/message.hpp"

namespace ocublast::coupler {

using link::Role;
using link::to_word;

namespace {

std::filesystem::path key_directory(const RunOptions& options) {
  if (!options.keys.empty()) return options.keys;
  const char* from_environment = std::getenv("OCUBLAST_KEYS");
  return from_environment != nullptr && *from_environment != '\0'
             ? std::filesystem::path(from_environment) : options.out / "keys";
}

/// Where a solver on this machine connects: 0.0.0.0 is an address to listen on only.
std::string endpoint_for_children(std::string endpoint) {
  const std::string any = "tcp://0.0.0.0:";
  if (endpoint.starts_with(any)) endpoint.replace(0, any.size(), "tcp://127.0.0.1:");
  return endpoint;
}

std::filesystem::path beside_ourselves(const std::string& program) {
  std::error_code error;
  const auto self = std::filesystem::read_symlink("/proc/self/exe", error);
  return error ? std::filesystem::path(program) : self.parent_path() / program;
}

}  // namespace

std::vector<std::string> solver_command(Role role, const RunOptions& options) {
  const bool flow = role == Role::flow;
  const std::string& given = flow ? options.flow_command : options.solid_command;
  std::vector<std::string> command =
      given.empty() ? std::vector{beside_ourselves(flow ? "flow_solver" : "solid_solver").string()}
                    : split_command(given);
  if (command.empty()) throw CaseError(fmt::format("--{}: no command given", to_word(role)));
  command.push_back(options.source.case_file.string());
  for (const auto& text : options.source.overrides) command.insert(command.end(), {"--set", text});
  if (!options.source.mesh_directory.empty())
    command.insert(command.end(), {"--mesh-dir", options.source.mesh_directory.string()});
  if (!options.out.empty()) command.insert(command.end(), {"--out", options.out.string()});
  if (!options.resume.empty()) command.insert(command.end(), {"--resume", options.resume.string()});
  const int threads = flow ? options.threads_flow : options.threads_solid;
  if (threads > 0) command.insert(command.end(), {"--threads", std::to_string(threads)});
  return command;
}

SolverStart::SolverStart(const RunOptions& options, bool encrypted, std::uint64_t case_hash)
    : options_(options), case_hash_(case_hash), token_(link::make_token()) {
  // Solvers that somebody else starts over ipc may share a token chosen by that somebody.
  const char* shared = std::getenv("OCUBLAST_TOKEN");
  if (options.await && shared != nullptr && *shared != '\0') token_ = shared;
  if (!encrypted) return;
  keys_ = std::filesystem::absolute(key_directory(options));
  if (const auto made = link::read_key_set(keys_)) {
    coupler_keys_ = made->keys;
    token_ = made->token;
    return;
  }
  coupler_keys_ = link::make_keys(keys_, token_);
}

Child::Start SolverStart::child(Role role, const std::string& endpoint, double silence_limit) const {
  Child::Start start;
  start.role = role;
  start.command = solver_command(role, options_);
  start.environment = {{"OCUBLAST_ENDPOINT", endpoint_for_children(endpoint)},
                       {"OCUBLAST_TOKEN", token_},
                       {"OCUBLAST_KEYS", keys_.string()},
                       // For solvers that do not read the case themselves and cannot compute it.
                       {"OCUBLAST_CASE_HASH", fmt::format("{:016x}", case_hash_)},
                       {"OCUBLAST_SILENCE_LIMIT_S", fmt::format("{}", silence_limit)}};
  // Both solvers have all cores but compute in turn: threads that spin on after a parallel region
  // would take the other side's time. About 50 us of spinning is kept for the regions themselves.
  if (std::getenv("OMP_WAIT_POLICY") == nullptr && std::getenv("GOMP_SPINCOUNT") == nullptr)
    start.environment.emplace_back("GOMP_SPINCOUNT", "20000");
  start.log = options_.out / "log" / fmt::format("{}.log", to_word(role));
  if (options_.resume.empty()) std::filesystem::remove(start.log);
  return start;
}

void SolverStart::announce(const std::string& endpoint, double silence_limit) const {
  const auto file = options_.out / "connection.env";
  const mode_t before = ::umask(077);
  std::ofstream out(file, std::ios::trunc);
  ::umask(before);
  out << "export OCUBLAST_ENDPOINT=" << endpoint << '\n'
      << (keys_.empty() ? "export OCUBLAST_TOKEN=" + token_ : "export OCUBLAST_KEYS=" + keys_.string())
      << '\n'
      << fmt::format("export OCUBLAST_CASE_HASH={:016x}\n", case_hash_)
      << "export OCUBLAST_SILENCE_LIMIT_S=" << silence_limit << '\n';
  out.close();
  if (!out) throw LinkError(fmt::format("{}: cannot be written", file.string()));
  std::printf("coupler: waiting at %s for a flow and a solid solver; their environment: %s\n",
              endpoint.c_str(), file.c_str());
  std::fflush(stdout);
}

}  // namespace ocublast::coupler
