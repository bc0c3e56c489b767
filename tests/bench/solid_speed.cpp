// Element updates per core-second on the block of 40^3 cells (cube of 0.1 m, neo-Hookean, nu =
// 0.49): one force computation each. Prints one JSON record per figure.
//
// On a machine shared with others the processor's speed wanders; a chain of dependent additions
// (one per cycle) before and after each block of work tells the clock the work had, and cycles per
// element follow, which do not wander. Both are medians over alternating blocks.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <fstream>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "solid_solver/elements/assembly.hpp"
#include "tests/support/solid_runs.hpp"

namespace {

using namespace ocublast::solid;

double seconds(clockid_t clock) {
  timespec t{};
  clock_gettime(clock, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// Cycles per CPU second, from 20 million dependent additions.
double effective_clock() {
  const double begin = seconds(CLOCK_THREAD_CPUTIME_ID);
  long sum = 0;
  for (long i = 0; i < 20000000; ++i) asm volatile("add $1, %0" : "+r"(sum));
  return 2e7 / (seconds(CLOCK_THREAD_CPUTIME_ID) - begin);
}

void record(const std::string& quantity, double value, const char* unit, const char* target,
            const char* better) {
  std::printf(
      "{\"bench\": \"solid_speed\", \"case\": \"block_40\", \"quantity\": \"%s\", \"value\": %.6g, "
      "\"unit\": \"%s\", \"target\": %s, \"better\": \"%s\"}\n",
      quantity.c_str(), value, unit, target, better);
  std::fflush(stdout);
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

struct Subject {
  std::string name;
  std::shared_ptr<const SolidMesh> mesh;
  std::unique_ptr<Assembly> assembly;
  const char* target = "null";
  std::vector<double> d;
  std::vector<double> f;
  std::vector<double> rates;   ///< elements per CPU s
  std::vector<double> cycles;  ///< per element
  std::vector<double> walls;   ///< elements per wall s
};

Subject make_subject(const std::string& name, const std::string& element,
                     std::shared_ptr<const SolidMesh> mesh, int threads, InstructionSet isa,
                     const Material& material = test::make_neo_hookean(1e6, 0.49, 1000.0)) {
  Subject s{.name = name, .mesh = std::move(mesh)};
  s.assembly = std::make_unique<Assembly>(
      *s.mesh, std::vector{material}, std::vector<std::int32_t>{0},
      AssemblyOptions{.threads = threads, .instruction_set = isa, .element_of_tissue = {element}});
  s.d.resize(4 * s.mesh->n_nodes());
  s.f.resize(s.d.size());
  for (std::size_t n = 0; n < s.mesh->n_nodes(); ++n)
    for (std::size_t i = 0; i < 3; ++i)
      s.d[4 * n + i] = 1e-4 * std::sin(300.0 * s.mesh->nodes[3 * n + i] + static_cast<double>(i));
  s.assembly->compute_force(s.d, s.f, 1e6);
  return s;
}

void measure(Subject& s) {
  constexpr int steps = 4;
  const double before = effective_clock();
  const double c0 = seconds(CLOCK_PROCESS_CPUTIME_ID);
  const double w0 = seconds(CLOCK_MONOTONIC);
  for (int n = 0; n < steps; ++n) s.assembly->compute_force(s.d, s.f, 1e6);
  const double cpu = seconds(CLOCK_PROCESS_CPUTIME_ID) - c0;
  const double wall = seconds(CLOCK_MONOTONIC) - w0;
  const double clock = 0.5 * (before + effective_clock());
  const double updates = steps * static_cast<double>(s.mesh->n_cells());
  s.rates.push_back(updates / cpu);
  s.walls.push_back(updates / wall);
  s.cycles.push_back(clock * cpu / updates);
}

/// Nodal rows that chunks copy, per element.
double rows_per_element(Assembly& assembly) {
  double rows = 0.0;
  double elements = 0.0;
  for (const auto& block : assembly.blocks()) {
    for (const auto& chunk : block.chunks()) rows += static_cast<double>(chunk.n_rows);
    elements += static_cast<double>(block.n_elements());
  }
  return rows / elements;
}

/// Bytes by a line of /proc/self/status.
double memory_of(const std::string& key) {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.starts_with(key + ":")) return 1024.0 * std::atof(line.c_str() + key.size() + 1);
  return 0.0;
}

/// A run as a case makes it: memory per element, all of it, and the rate of whole steps.
void measure_run(int cells) {
  const double before = memory_of("VmRSS");
  auto setup =
      test::make_setup(test::make_block({.cells = {cells, cells, cells}, .size = {0.1, 0.1, 0.1}}),
                       test::make_neo_hookean(1e6, 0.49, 1000.0), "hex8_q1p0");
  setup.assembly.viscosity = {};
  setup.fixed.push_back(test::fixed_set(*setup.mesh, "z0", {true, true, true}));
  setup.pressures.push_back({setup.mesh->face_sets.at("z1"), {{0.0, 5e-4, 1e-3}, {0.0, 5e4, 0.0}}});
  const auto n = static_cast<double>(setup.mesh->n_cells());
  SolidRun solid(std::move(setup));
  const double dt = 0.5 * solid.stable_step();
  constexpr int steps = 10;
  const auto advance = [&] {
    const double t = solid.state().time;
    solid.advance({.t_begin = t, .t_end = t + steps * dt, .steps = steps});
  };
  advance();
  const double begin = seconds(CLOCK_PROCESS_CPUTIME_ID);
  advance();
  const double cpu = seconds(CLOCK_PROCESS_CPUTIME_ID) - begin;
  record("hex8_q1p0_whole_step", steps * n / cpu, "elements/core_s", "null", "higher");
  record("hex8_q1p0_run_memory", (memory_of("VmRSS") - before) / n, "B/element", "1200", "lower");
  record("hex8_q1p0_peak_memory", (memory_of("VmHWM") - before) / n, "B/element", "1200", "lower");
}

}  // namespace

/// solid_speed [--all] [--repeats N] [--only ELEMENT] [--cells N]: --all times the narrower
/// instruction sets too.
int main(int argc, char** argv) {
  bool all = false;
  int repeats = 15;
  std::string only;
  int cells = 40;
  for (int i = 1; i < argc; ++i) {
    if (std::strcmp(argv[i], "--all") == 0) all = true;
    if (std::strcmp(argv[i], "--only") == 0 && i + 1 < argc) only = argv[++i];
    if (std::strcmp(argv[i], "--cells") == 0 && i + 1 < argc) cells = std::atoi(argv[++i]);
    if (std::strcmp(argv[i], "--repeats") == 0 && i + 1 < argc) repeats = std::atoi(argv[++i]);
  }
  if (only.empty() || only == "hex8_q1p0") measure_run(cells);
  const test::BlockSize size{.cells = {cells, cells, cells}, .size = {0.1, 0.1, 0.1}};
  std::map<Shape, std::shared_ptr<const SolidMesh>> meshes;
  for (const auto shape : {Shape::hex8, Shape::tet4, Shape::wedge6})
    meshes[shape] = std::make_shared<const SolidMesh>(test::make_block_of(shape, size));
  meshes[Shape::tet10] = std::make_shared<const SolidMesh>(
      test::make_block_of(Shape::tet10, {.cells = {16, 16, 16}, .size = {0.1, 0.1, 0.1}}));
  const InstructionSet best = best_instruction_set();
  const char* names[] = {"baseline", "avx2", "avx512"};
  const std::map<std::string, const char*> targets{
      {"hex8_q1p0", "6e6"}, {"hex8_one_point", "10e6"}, {"tet4_anp", "25e6"}};
  std::vector<Subject> subjects;
  for (const auto& element : make_elements()) {
    if (element.planar || (!only.empty() && element.name != only)) continue;
    for (const auto isa :
         {InstructionSet::baseline, InstructionSet::avx2, InstructionSet::avx512}) {
      if (!has_instruction_set(isa) || (isa != best && !all)) continue;
      subjects.push_back(make_subject(element.name + "_" + names[static_cast<std::size_t>(isa)],
                                      element.name, meshes[element.shape], 1, isa));
      const auto target = targets.find(element.name);
      if (isa == best && target != targets.end()) subjects.back().target = target->second;
    }
  }
  if (only.empty())
    for (const auto& law : make_laws())
      if (law.name == "liquid")
        subjects.push_back(make_subject("hex8_q1p0_of_liquid", "hex8_q1p0", meshes[Shape::hex8], 1,
                                        best, test::make_example(law, 1000.0)));
  if (only.empty() || only == "hex8_q1p0")
    subjects.push_back(make_subject("two_threads", "hex8_q1p0", meshes[Shape::hex8], 2, best));
  std::vector<double> speed_ups;
  for (int repeat = 0; repeat < repeats; ++repeat) {
    for (auto& s : subjects) measure(s);
    if (subjects.back().name != "two_threads") continue;
    // Wall times of one and two threads right after one another.
    const auto one = std::find_if(subjects.begin(), subjects.end(), [&](const Subject& s) {
      return s.name == std::string("hex8_q1p0_") + names[static_cast<std::size_t>(best)];
    });
    measure(*one);
    measure(subjects.back());
    speed_ups.push_back(subjects.back().walls.back() / one->walls.back());
  }
  std::vector<double> clocks;
  for (const auto& s : subjects)
    for (std::size_t k = 0; k < s.rates.size(); ++k) clocks.push_back(s.rates[k] * s.cycles[k]);
  const double best_clock = *std::max_element(clocks.begin(), clocks.end());
  for (const auto& s : subjects) {
    if (s.name == "two_threads") continue;
    const double cycles = median(s.cycles);
    record(s.name, median(s.rates), "elements/core_s", s.target, "higher");
    record(s.name + "_cycles", cycles, "cycles/element", "null", "lower");
    record(s.name + "_at_full_clock", best_clock / cycles, "elements/core_s", s.target, "higher");
    record(s.name + "_rows", rows_per_element(*s.assembly), "rows/element", "null", "lower");
    record(s.name + "_memory",
           static_cast<double>(s.assembly->bytes()) / static_cast<double>(s.mesh->n_cells()),
           "B/element", s.name.starts_with("hex8") ? "1200" : "null", "lower");
  }
  if (!speed_ups.empty())
    record("hex8_q1p0_two_threads", median(speed_ups), "speed-up", "1.85", "higher");
  record("clock_median", median(clocks), "Hz", "null", "higher");
  record("clock_best", best_clock, "Hz", "null", "higher");
  return EXIT_SUCCESS;
}
