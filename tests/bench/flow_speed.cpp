// Cell updates per second of the whole step (four stages, diffusivity, filter) in a cube.
// Usage: flow_speed [n ...] [-t threads]; without -t one and two threads. Inviscid, everything on.

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string_view>
#include <vector>

#include "tests/verification/flow_run.hpp"

namespace {

struct Rate {
  double wall = 0.0;  ///< cells per second of wall time
  double cpu = 0.0;   ///< cells per second of processor time: what a thread does on a loaded machine
};

Rate rate(int n, int threads, const char* isa, int steps) {
  using namespace ocublast::flow;
  FlowOptions o = unit_options();
  o.threads = threads;
  o.instruction_set = isa;
  Flow flow(uniform_grid({n, n, n}, {0, 0, 0}, {1, 1, 1}), all_faces(BoundaryKind::symmetry), o);
  flow.set_state([](double x, double y, double z) {
    return State{.rho = 1.0, .p = x * x + y * y + z * z < 0.09 ? 8.0 : 1.0};
  });
  for (int s = 0; s < 2; ++s) flow.advance(0.0, flow.stable_step());
  const std::clock_t cpu_begin = std::clock();
  const auto begin = std::chrono::steady_clock::now();
  for (int s = 0; s < steps; ++s) flow.advance(0.0, flow.stable_step());
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  const double cpu = static_cast<double>(std::clock() - cpu_begin) / CLOCKS_PER_SEC;
  const double cells = static_cast<double>(n) * n * n * steps;
  return {cells / seconds, cells / cpu};
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<int> sizes;
  std::vector<int> thread_counts{1, 2};
  for (int a = 1; a < argc; ++a) {
    if (std::string_view(argv[a]) == "-t" && a + 1 < argc) thread_counts = {std::atoi(argv[++a])};
    else sizes.push_back(std::atoi(argv[a]));
  }
  if (sizes.empty()) sizes = {64, 128};
  for (int n : sizes) {
    const int steps = n >= 128 ? 5 : 20;
    for (int threads : thread_counts) {
      const Rate r = rate(n, threads, "", steps);
      std::printf("flow_speed %d^3, %d thread%s: %.2f million cells/s, %.2f per processor second\n", n, threads,
                  threads > 1 ? "s" : "", 1e-6 * r.wall, 1e-6 * r.cpu);
    }
  }
  return 0;
}
