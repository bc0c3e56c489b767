// Cell updates per second of the whole step (four stages, diffusivity, filter) in a cube, and where
// the time goes. Usage: flow_speed [n ...] [-t threads] [-v] [-p] [-i isa] [-s steps]; without -t one
// and two threads; -v with viscosity, -p prints the passes.
//
// Processor time, and the fastest of the steps: what the machine does for others then matters least.

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string_view>
#include <vector>

#include "flow_solver/pass_clock.hpp"
#include "tests/verification/flow_run.hpp"

namespace {

using namespace ocublast::flow;

struct Request {
  std::vector<int> sizes;
  std::vector<int> threads{1, 2};
  bool viscous = false, passes = false;
  const char* isa = "";
  int steps = 0;
};

struct Rate {
  double wall = 0.0;    ///< cells per second of wall time, mean
  double cpu = 0.0;     ///< cells per second of processor time (all threads), mean
  double best = 0.0;    ///< cells per second and thread of the first thread, fastest step
  std::array<double, n_passes> pass{};  ///< ns per cell of the first thread's share, fastest
};

Rate rate(int n, int threads, const Request& r) {
  FlowOptions o = unit_options();
  o.threads = threads;
  o.instruction_set = r.isa;
  o.time_passes = r.passes;
  if (r.viscous) {
    o.viscosity = Viscosity::constant;
    o.dynamic_viscosity = 1e-5;
  }
  Flow flow(uniform_grid({n, n, n}, {0, 0, 0}, {1, 1, 1}), all_faces(BoundaryKind::symmetry), o);
  flow.set_state([](double x, double y, double z) {
    return State{.rho = 1.0, .p = x * x + y * y + z * z < 0.09 ? 8.0 : 1.0};
  });
  for (int s = 0; s < 2; ++s) flow.advance(0.0, flow.stable_step());
  const int steps = r.steps > 0 ? r.steps : std::clamp(20'000'000 / (n * n * n), 5, 60);
  const double cells = static_cast<double>(n) * n * n;
  Rate out;
  out.pass.fill(1e300);
  double fastest = 1e300;
  std::vector<double> before(n_passes, 0.0);
  const std::clock_t cpu_begin = std::clock();
  const auto begin = std::chrono::steady_clock::now();
  for (int s = 0; s < steps; ++s) {
    const auto now = flow.pass_seconds();
    std::copy(now.begin(), now.end(), before.begin());
    const double t = PassClock::now();
    flow.advance(0.0, flow.stable_step());
    fastest = std::min(fastest, PassClock::now() - t);
    for (std::size_t p = 0; p < n_passes; ++p) {
      out.pass[p] = std::min(out.pass[p], 1e9 * (flow.pass_seconds()[p] - before[p]) * threads / cells);
    }
  }
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  out.cpu = cells * steps / (static_cast<double>(std::clock() - cpu_begin) / CLOCKS_PER_SEC);
  out.wall = cells * steps / seconds;
  out.best = cells / threads / fastest;
  return out;
}

}  // namespace

int main(int argc, char** argv) {
  Request r;
  for (int a = 1; a < argc; ++a) {
    const std::string_view arg(argv[a]);
    const bool more = a + 1 < argc;
    if (arg == "-t" && more) r.threads = {std::atoi(argv[++a])};
    else if (arg == "-i" && more) r.isa = argv[++a];
    else if (arg == "-s" && more) r.steps = std::atoi(argv[++a]);
    else if (arg == "-v") r.viscous = true;
    else if (arg == "-p") r.passes = true;
    else r.sizes.push_back(std::atoi(argv[a]));
  }
  if (r.sizes.empty()) r.sizes = {64, 128};
  for (int n : r.sizes) {
    for (int threads : r.threads) {
      const Rate x = rate(n, threads, r);
      std::printf("flow_speed %d^3, %d thread%s%s: %.2f million cells/s, %.2f per processor second, best step %.2f\n",
                  n, threads, threads > 1 ? "s" : "", r.viscous ? ", viscous" : "", 1e-6 * x.wall, 1e-6 * x.cpu,
                  1e-6 * x.best);
      if (!r.passes) continue;
      std::printf("  ns per cell and step:");
      for (std::size_t p = 0; p < n_passes; ++p) std::printf(" %s %.1f,", pass_names[p], x.pass[p]);
      std::printf(" all %.1f\n", 1e9 / x.best);
    }
  }
  return 0;
}
