#include "coupler/solver_start.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/stat.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>

#include "coupler/base/errors.hpp"
#include "coupler/link/message.hpp"

namespace ocublast::coupler {

namespace {

std::filesystem::path key_directory(const RunOptions& options) {
  if (!options.keys.empty()) return options.keys;
  const char* from_environment = std::getenv("OCUBLAST_KEYS");
  return from_environment != nullptr && *from_environment != '\0'
             ? std::filesystem::path(from_environment)
             : options.out / "keys";
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

/// --solid COMMAND is for every solid, --solid NAME=COMMAND for one of several.
std::string given_command(Party party, const Roster& roster, const RunOptions& options) {
  if (party == Party::flow) return options.flow_command;
  std::string command;
  for (const std::string& given : options.solid_commands) {
    const std::string prefix = roster.name(party) + "=";
    const auto equals = given.find('=');
    const auto& names = roster.solids();
    const bool for_one =
        roster.several() && equals != std::string::npos &&
        std::find(names.begin(), names.end(), given.substr(0, equals)) != names.end();
    if (!for_one)
      command = given;
    else if (given.starts_with(prefix))
      return given.substr(prefix.size());
  }
  return command;
}

/// Under mpirun where several ranks are wanted: its own choice of what runs where would bind every
/// rank of both solvers to the same first cores.
std::vector<std::string> with_ranks(std::vector<std::string> command, int ranks) {
  if (ranks <= 1) return command;
  std::vector<std::string> all{"mpirun", "-n", std::to_string(ranks), "--bind-to", "none"};
  all.insert(all.end(), command.begin(), command.end());
  return all;
}

/// Programs that start others, in process groups of their own, and may leave them behind.
bool is_launcher(const std::string& program) {
  const auto name = std::filesystem::path(program).filename().string();
  return name == "mpirun" || name == "mpiexec" || name == "orterun" || name == "prterun" ||
         name == "srun";
}

}  // namespace

std::vector<std::string> solver_command(Party party, const Roster& roster,
                                        const RunOptions& options) {
  const bool flow = party == Party::flow;
  const std::string given = given_command(party, roster, options);
  std::vector<std::string> command =
      given.empty() ? std::vector{beside_ourselves(flow ? "flow_solver" : "solid_solver").string()}
                    : split_command(given);
  if (command.empty())
    throw CaseError(fmt::format("--{}: no command given", flow ? "flow" : "solid"));
  command.push_back(options.source.case_file.string());
  const std::string name = roster.name(party);
  if (!name.empty()) command.insert(command.end(), {"--name", name});
  for (const auto& text : options.source.overrides) command.insert(command.end(), {"--set", text});
  if (!options.source.mesh_directory.empty())
    command.insert(command.end(), {"--mesh-dir", options.source.mesh_directory.string()});
  if (!options.out.empty()) command.insert(command.end(), {"--out", (options.out / name).string()});
  if (!options.resume.empty()) command.insert(command.end(), {"--resume", options.resume.string()});
  const int threads = flow ? options.threads_flow : options.threads_solid;
  if (threads > 0) command.insert(command.end(), {"--threads", std::to_string(threads)});
  return with_ranks(std::move(command), flow ? options.ranks_flow : options.ranks_solid);
}

SolverStart::SolverStart(const RunOptions& options, const Roster& roster, bool encrypted,
                         std::uint64_t case_hash)
    : options_(options), roster_(roster), case_hash_(case_hash), token_(link::make_token()) {
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
  std::vector<std::string> files;
  for (const Party party : roster.all()) files.push_back(roster.file_name(party));
  coupler_keys_ = link::make_keys(keys_, token_, files);
}

Child::Start SolverStart::child(Party party, const std::string& endpoint,
                                double silence_limit) const {
  Child::Start start;
  start.party = party;
  start.word = roster_.word(party);
  start.command = solver_command(party, roster_, options_);
  start.guarded = is_launcher(start.command.front());
  start.environment = {{"OCUBLAST_ENDPOINT", endpoint_for_children(endpoint)},
                       {"OCUBLAST_TOKEN", token_},
                       {"OCUBLAST_KEYS", keys_.string()},
                       // For solvers that do not read the case themselves and cannot compute it.
                       {"OCUBLAST_CASE_HASH", fmt::format("{:016x}", case_hash_)},
                       {"OCUBLAST_SILENCE_LIMIT_S", fmt::format("{}", silence_limit)}};
  const std::string name = roster_.name(party);
  if (!name.empty()) {
    start.environment.emplace_back("OCUBLAST_NAME", name);
    std::filesystem::create_directories(options_.out / name);
  }
  const int ranks = party == Party::flow ? options_.ranks_flow : options_.ranks_solid;
  if (ranks > 1)
    // Open MPI refuses root and more ranks than cores unless told; ranks that wait give their core
    // away.
    for (const char* key : {"OMPI_ALLOW_RUN_AS_ROOT", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM",
                            "OMPI_MCA_rmaps_base_oversubscribe", "OMPI_MCA_mpi_yield_when_idle"})
      if (std::getenv(key) == nullptr) start.environment.emplace_back(key, "1");
  // Both solvers have all cores but compute in turn: threads that spin on after a parallel region
  // would take the other side's time. About 50 us of spinning is kept for the regions themselves.
  if (std::getenv("OMP_WAIT_POLICY") == nullptr && std::getenv("GOMP_SPINCOUNT") == nullptr)
    start.environment.emplace_back("GOMP_SPINCOUNT", "20000");
  start.log = options_.out / "log" / fmt::format("{}.log", roster_.file_name(party));
  if (options_.resume.empty()) std::filesystem::remove(start.log);
  return start;
}

void SolverStart::announce(const std::vector<Party>& awaited, const std::string& endpoint,
                           double silence_limit) const {
  const auto file = options_.out / "connection.env";
  auto aside = file;  // who waits for it never sees a part
  aside += ".part";
  const mode_t before = ::umask(077);
  std::ofstream out(aside, std::ios::trunc);
  ::umask(before);
  out << "export OCUBLAST_ENDPOINT=" << endpoint << '\n'
      << (keys_.empty() ? "export OCUBLAST_TOKEN=" + token_
                        : "export OCUBLAST_KEYS=" + keys_.string())
      << '\n'
      << fmt::format("export OCUBLAST_CASE_HASH={:016x}\n", case_hash_)
      << "export OCUBLAST_SILENCE_LIMIT_S=" << silence_limit << '\n';
  if (roster_.several())
    out << fmt::format("# and for each solid its own OCUBLAST_NAME: {}\n",
                       fmt::join(roster_.solids(), ", "));
  out.close();
  if (!out) throw LinkError(fmt::format("{}: cannot be written", file.string()));
  std::filesystem::rename(aside, file);
  std::vector<std::string> words;
  for (const Party party : awaited) words.push_back(roster_.word(party));
  std::printf("coupler: waiting at %s for %s; their environment: %s\n", endpoint.c_str(),
              fmt::format("{}", fmt::join(words, ", ")).c_str(), file.c_str());
  std::fflush(stdout);
}

}  // namespace ocublast::coupler
