// Element updates per core-second on the block of 40^3 cells (cube of 0.1 m, neo-Hookean, nu =
// 0.49). Prints one JSON record per figure.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string>
#include <vector>

#include "solid_solver/elements/assembly.hpp"
#include "tests/support/solid_materials.hpp"
#include "tests/support/solid_meshes.hpp"

namespace {

using namespace ocublast::solid;

double cpu_seconds() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

void record(const std::string& quantity, double value, const char* unit, const char* target) {
  std::printf(
      "{\"bench\": \"solid_speed\", \"case\": \"block_40\", \"quantity\": \"%s\", \"value\": %.6g, "
      "\"unit\": \"%s\", \"target\": %s, \"better\": \"higher\"}\n",
      quantity.c_str(), value, unit, target);
}

struct Run {
  double cpu_rate = 0.0;
  double wall_rate = 0.0;
};

/// Median over blocks of 10 force computations, elements per second.
Run measure(const SolidMesh& mesh, InstructionSet isa, int threads) {
  Assembly assembly(mesh, {test::make_neo_hookean(1e6, 0.49, 1000.0)}, {0},
                    {.threads = threads, .instruction_set = isa});
  std::vector<double> d(4 * mesh.n_nodes());
  std::vector<double> f(d.size());
  for (std::size_t n = 0; n < mesh.n_nodes(); ++n)
    for (std::size_t i = 0; i < 3; ++i)
      d[4 * n + i] = 1e-4 * std::sin(300.0 * mesh.nodes[3 * n + i] + static_cast<double>(i));
  assembly.compute_force(d, f, 1e6);
  std::vector<double> cpu;
  std::vector<double> wall;
  for (int repeat = 0; repeat < 9; ++repeat) {
    const double c0 = cpu_seconds();
    const auto w0 = std::chrono::steady_clock::now();
    for (int n = 0; n < 10; ++n) assembly.compute_force(d, f, 1e6);
    cpu.push_back(cpu_seconds() - c0);
    wall.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - w0).count());
  }
  std::sort(cpu.begin(), cpu.end());
  std::sort(wall.begin(), wall.end());
  const double updates = 10.0 * static_cast<double>(mesh.n_cells());
  return {.cpu_rate = updates / cpu[cpu.size() / 2], .wall_rate = updates / wall[wall.size() / 2]};
}

}  // namespace

int main() {
  const auto hexes = test::make_block({.cells = {40, 40, 40}, .size = {0.1, 0.1, 0.1}});
  const auto tets = test::to_tets(hexes);
  const InstructionSet best = best_instruction_set();
  const char* names[] = {"baseline", "avx2", "avx512"};
  for (std::size_t isa = 0; isa <= static_cast<std::size_t>(best); ++isa) {
    const bool target = isa == static_cast<std::size_t>(best);
    const auto set = static_cast<InstructionSet>(isa);
    record(std::string("hex8_q1p0_") + names[isa], measure(hexes, set, 1).cpu_rate,
           "elements/core_s", target ? "6e6" : "null");
    record(std::string("tet4_anp_") + names[isa], measure(tets, set, 1).cpu_rate, "elements/core_s",
           target ? "25e6" : "null");
  }
  const double one = measure(hexes, best, 1).wall_rate;
  record("hex8_q1p0_two_threads", measure(hexes, best, 2).wall_rate / one, "speed-up", "1.85");
  return EXIT_SUCCESS;
}
