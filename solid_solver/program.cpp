#include "solid_solver/program.hpp"

#include <fmt/format.h>
#include <omp.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "coupler/base/command_line.hpp"
#include "coupler/base/errors.hpp"
#include "coupler/base/hdf5_file.hpp"
#include "coupler/base/log.hpp"
#include "coupler/base/version.hpp"
#include "coupler/link/checkpoint_place.hpp"
#include "solid_solver/coupled_run.hpp"
#include "solid_solver/io/case_keys.hpp"
#include "solid_solver/io/session.hpp"
#include "solid_solver/parallel/distribute.hpp"

namespace ocublast::solid {
namespace {

constexpr const char* about =
    "Explicit finite elements for soft tissue, alone or coupled to a flow";
// A window of a run alone holds at most this many steps, so that the shrinking mesh is looked at.
constexpr double steps_per_window = 200.0;
constexpr double progress_interval = 2.0;  ///< s of wall time between progress lines

void print_progress(const Session& session, const SolidRun& run, double elapsed) {
  const double t = run.state().time;
  const double end = session.solid_case().common.end_time;
  std::printf("t = %.4e s, %5.1f %%, %.0f steps, step %.3e s, remaining %.0f s\n", t,
              100.0 * t / end, run.sums().steps, run.stable_step(),
              t > 0.0 ? elapsed * (end - t) / t : 0.0);
  std::fflush(stdout);
}

/// One window towards the next due time, in equal parts of at most steps_per_window steps.
void advance_alone(Session& session, double due) {
  auto& run = session.run();
  const double begin = run.state().time;
  const double parts =
      std::max(1.0, std::ceil((due - begin) / (steps_per_window * run.stable_step())));
  for (double k = 1.0; k <= parts; k += 1.0)
    session.advance({.t_begin = run.state().time,
                     .t_end = k == parts ? due : begin + (due - begin) * k / parts});
}

/// Written beside and renamed, so that a directory of this name is complete.
void write_checkpoint_alone(Session& session, const std::filesystem::path& directory) {
  auto aside = directory;
  aside += ".part";
  const auto& team = session.run().team();
  team.together([&] {
    if (team.root()) std::filesystem::create_directories(aside);
  });
  session.write_checkpoint_to(aside);
  team.together([&] {
    if (!team.root()) return;
    std::filesystem::remove_all(directory);
    std::filesystem::rename(aside, directory);
  });
}

/// `last`: the checkpoint it goes on from, if any.
void run_alone(Session& session, const std::filesystem::path& out, bool quiet,
               std::filesystem::path last) {
  const auto& c = session.solid_case();
  const double end = c.common.end_time;
  double wall = 0.0;
  const Stopwatch watch(wall);
  double next_line = progress_interval;
  if (session.run().state().time == 0.0) session.write_due(false);
  while (session.run().state().time < end) {
    auto& progress = session.progress();
    double due = std::min({end, progress.next_history, progress.next_field});
    const bool checkpoints = c.output.checkpoint_every > 0.0;
    if (checkpoints) due = std::min(due, progress.next_checkpoint);
    if (is_due(due, end)) due = end;  // no last window of rounding size
    try {
      advance_alone(session, due);
      session.write_due(due >= end);
    } catch (const NumericsError& error) {
      throw NumericsError(fmt::format(
          "{}; last good checkpoint: {}", error.what(),
          last.empty() ? "none (give solid.output.checkpoint_every_s)" : last.string()));
    }
    if (checkpoints && is_due(session.run().state().time, progress.next_checkpoint)) {
      progress.next_checkpoint = next_due(session.run().state().time, c.output.checkpoint_every);
      last = link::checkpoint_directory(out, progress.window);
      write_checkpoint_alone(session, last);
    }
    if (!quiet && session.root() && watch.elapsed() > next_line) {
      print_progress(session, session.run(), watch.elapsed());
      next_line = watch.elapsed() + progress_interval;
    }
  }
  session.write_due(true);
  session.write_summary();
}

/// Fewer threads for a small mesh: below some thousand elements each, waiting for each other in
/// every step costs more than it brings. Results do not depend on it. Ranks share a host's
/// processors.
int useful_threads(int asked, const Ranks& ranks, const SolidMesh& mesh) {
  constexpr std::size_t elements_per_thread = 2000;
  const int wanted = asked > 0 ? asked : std::max(1, omp_get_num_procs() / ranks.on_this_host());
  return std::clamp(static_cast<int>(mesh.n_cells() / elements_per_thread), 1, wanted);
}

int list_keys() {
  auto listing = CaseReader::make_listing();
  static_cast<void>(read_solid_case(listing));
  std::fputs(listing.key_list().c_str(), stdout);
  return static_cast<int>(ExitCode::done);
}

int run_case(const CommandLine& line, const Ranks& ranks) {
  CaseReader reader(line.source);
  auto from = read_solid_case(reader);
  reader.finish();
  if (line.effective_only) {
    if (ranks.root()) std::fputs(reader.effective().c_str(), stdout);
    return static_cast<int>(ExitCode::done);
  }
  from.imbalance = distribute(from.setup, ranks);
  if (!ranks.root()) from.whole_mesh = nullptr;
  from.setup.assembly.threads = useful_threads(line.threads, ranks, *from.setup.mesh);
  from.setup.assembly.instruction_set = best_instruction_set();
  const bool coupled = from.coupled;
  const auto out =
      line.out.empty() ? std::filesystem::path("results") / from.common.name : line.out;
  auto log = make_logger("solid_solver",
                         line.check_only || !ranks.root() ? "" : out / "log" / "solid_solver.log");
  Session session(std::move(from),
                  {.out = out,
                   .case_hash = reader.hash(),
                   .equilibrium = !line.check_only && line.resume.empty()},
                  log);
  const auto text = session.describe();
  log->info("{} {}\n{}", "solid_solver", version_text, text);
  if (line.check_only || (!line.quiet && !coupled)) std::fputs(text.c_str(), stdout);
  if (line.check_only) return static_cast<int>(ExitCode::done);
  if (!line.resume.empty())
    session.resume_from(ranks.root() ? link::require_checkpoint(line.resume).directory : "");
  if (coupled)
    run_coupled(session);
  else
    run_alone(session, out, line.quiet, line.resume);
  return static_cast<int>(ExitCode::done);
}

}  // namespace

int run_program(int argc, char** argv, const Ranks& ranks) {
  const auto line = parse_command_line(argc, argv, "solid_solver", about);
  if (!line) return static_cast<int>(ExitCode::done);
  return line->list_keys ? list_keys() : run_case(*line, ranks);
}

}  // namespace ocublast::solid
