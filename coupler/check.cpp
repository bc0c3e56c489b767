#include <fmt/format.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>

#include "coupler/base/errors.hpp"
#include "coupler/child.hpp"
#include "coupler/commands.hpp"
#include "coupler/link/message.hpp"
#include "coupler/settings.hpp"

namespace ocublast::coupler {
namespace {

/// Reading a large mesh takes a solver some time; this is for one that hangs.
constexpr double check_limit = 600.0;

struct Checked {
  bool passed = false;
  std::string text;
};

Checked ask_solver(Party party, const Roster& roster, const RunOptions& options,
                   const std::filesystem::path& scratch) {
  RunOptions plain = options;
  plain.out.clear();
  plain.ranks_flow = plain.ranks_solid = 1;
  plain.resume.clear();
  const std::string word = roster.word(party);
  Child::Start start{.party = party,
                     .word = word,
                     .command = solver_command(party, roster, plain),
                     .environment = {},
                     .log = scratch / fmt::format("{}.log", roster.file_name(party))};
  start.command.emplace_back("--check");
  Child child(start);
  const auto end = child.wait(check_limit);
  std::ifstream in(start.log);
  std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  if (!end)
    text += fmt::format("{}: --check did not end within {} s\n", word, check_limit);
  else if (end->signal != 0)
    text += fmt::format("{}: --check was {}\n", word, end->text());
  return {end && end->signal == 0 && end->exit_code == 0, text};
}

}  // namespace

void check_case(const RunOptions& options) {
  if (options.source.case_file.empty())
    throw CaseError("command line: no case file; see coupler check --help");
  CaseReader reader(
      options.source);  // a file that cannot be parsed ends here: nobody could read it
  const Settings settings = read_settings(reader);
  std::string faults;
  try {
    reader.finish();
  } catch (const CaseError& error) {
    faults = std::string(error.what()) + "\n";
  }
  std::string name = (std::filesystem::temp_directory_path() / "ocublast-check-XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr) throw LinkError("no temporary directory for the check");
  const std::filesystem::path scratch = name;
  std::string plan;
  for (const Party party : settings.roster.all()) {
    if (!reader.has(party == Party::flow ? "flow" : "solid")) continue;
    const Checked checked = ask_solver(party, settings.roster, options, scratch);
    (checked.passed ? plan : faults) += checked.text;
  }
  std::filesystem::remove_all(scratch);
  if (!faults.empty()) {
    // Both solvers read the common sections: the same fault is shown once.
    std::string once;
    std::size_t begin = 0;
    while (begin < faults.size()) {
      const std::size_t end = std::min(faults.find('\n', begin), faults.size());
      const std::string fault = faults.substr(begin, end - begin);
      const bool heading = fault.ends_with("the case cannot run:");
      if (!fault.empty() && !heading &&
          ("\n" + once).find("\n" + fault + "\n") == std::string::npos)
        once += fault + "\n";
      begin = end + 1;
    }
    once.pop_back();
    throw CaseError(once);
  }
  std::printf("%s", plan.c_str());
  if (reader.has("flow") && reader.has("solid"))
    std::printf("coupler: %s until t = %g s, predictor order %d\n", settings.common.name.c_str(),
                settings.common.end_time, settings.predictor_order);
  std::printf("%s: the case can run\n", options.source.case_file.c_str());
}

}  // namespace ocublast::coupler
