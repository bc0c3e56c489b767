#include "flow_solver/io/precision_case.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <exception>
#include <filesystem>
#include <string_view>

#include "coupler/base/command_line.hpp"
#include "coupler/base/errors.hpp"

namespace ocublast::flow::inline OCU_PRECISION {
namespace {

std::filesystem::path other_program() {
  return std::filesystem::read_symlink("/proc/self/exe").parent_path() /
         (is_single ? "flow_solver" : "flow_solver_single");
}

}  // namespace

void read_precision(Section& numerics, Precision& precision) {
  static constexpr std::pair<std::string_view, Precision> words[] = {
      {"double", Precision::double_precision}, {"single", Precision::single_precision}};
  numerics.choice("precision", precision, words,
                  {.help = "single: fields and kernels in 32 bits, for blast loads; tolerances are "
                           "raised to 1e-6"});
}

void become_asked_precision(int argc, char** argv) noexcept try {
  // Words that make the command line answer at once would be answered twice.
  const auto asks = [](std::string_view word) {
    return word == "-h" || word == "--help" || word == "--version";
  };
  if (std::any_of(argv + 1, argv + argc, asks)) return;
  const auto line = parse_command_line(argc, argv, "flow_solver", "");
  if (!line || line->list_keys) return;
  CaseReader reader(line->source);
  Precision asked = Precision::double_precision;
  auto numerics = reader.section("flow").table("numerics");
  read_precision(numerics, asked);
  if (asked == own_precision) return;
  execv(other_program().c_str(), argv);
} catch (const std::exception&) {
  return;
}

void require_own_precision(Precision asked) {
  if (asked == own_precision) return;
  throw CaseError(
      fmt::format("flow.numerics.precision: the program {} cannot be started; build it, or take "
                  "precision = \"{}\"",
                  other_program().string(), precision_name));
}

}  // namespace ocublast::flow
