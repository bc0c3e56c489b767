// Time of a step of the block of 40^3 Q1P0 hexes (cube of 0.1 m, neo-Hookean, nu = 0.49, half-sine
// pressure on top) on the ranks that mpirun starts, one thread each: prints one JSON object with
// the wall time per step and the largest CPU time of a rank per step (ranks that wait for others
// spin, so on a machine shared with others the wall time says more about those than about the
// program).
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>

#include "solid_solver/parallel/distribute.hpp"
#include "tests/support/solid_runs.hpp"

namespace {

using namespace ocublast;
using namespace ocublast::solid;

double cpu_seconds() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

double wall_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

int measure(const Ranks& ranks, int cells, int steps) {
  auto setup =
      test::make_setup(test::make_block({.cells = {cells, cells, cells}, .size = {0.1, 0.1, 0.1}}),
                       test::make_neo_hookean(1e6, 0.49, 1000.0), "hex8_q1p0");
  setup.assembly.viscosity = {};
  setup.fixed.push_back(test::fixed_set(*setup.mesh, "z0", {true, true, true}));
  setup.pressures.push_back({setup.mesh->face_sets.at("z1"), {{0.0, 5e-4, 1e-3}, {0.0, 5e4, 0.0}}});
  const double imbalance = distribute(setup, ranks);
  SolidRun solid(std::move(setup));
  const double dt = 0.5 * solid.stable_step();
  const auto advance = [&](int n) {
    solid.advance({.t_begin = solid.state().time,
                   .t_end = solid.state().time + n * dt,
                   .steps = static_cast<std::uint32_t>(n)});
  };
  advance(3);
  ranks.wait_for_all();
  const double wall = wall_seconds();
  const double cpu = cpu_seconds();
  advance(steps);
  ranks.wait_for_all();
  const double wall_step = (wall_seconds() - wall) / steps;
  const double cpu_step = ranks.max_of_all((cpu_seconds() - cpu) / steps);
  const double shared = solid.team().part() == nullptr
                            ? 0.0
                            : static_cast<double>(solid.team().part()->shared.size());
  if (ranks.root())
    std::printf(
        "{\"ranks\": %d, \"wall_step\": %.6g, \"cpu_step\": %.6g, \"imbalance\": %.4f, "
        "\"shared_nodes\": %.0f}\n",
        ranks.size(), wall_step, cpu_step, imbalance, shared);
  return EXIT_SUCCESS;
}

}  // namespace

/// solid_rank_speed [CELLS_PER_EDGE [STEPS]]
int main(int argc, char** argv) {
  return run_on_ranks("solid_rank_speed", [&](const Ranks& ranks) {
    return measure(ranks, argc > 1 ? std::atoi(argv[1]) : 40, argc > 2 ? std::atoi(argv[2]) : 30);
  });
}
