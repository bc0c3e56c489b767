// Cell updates per second of the whole step (four stages, diffusivity, filter) in a cube, and where
// the time goes. Usage: flow_speed [n ...] [-t threads] [-v] [-p] [-i isa] [-s steps]; without -t
// one and two threads; -v with viscosity, -m with marked nodes in every pencil of the front, -p
// prints the passes; -b a blast and -q a quiet gas with and without the active box; -B a ball of
// 8,192 facets at rest and moving against none, -c at so many cells a step only; -l the limits of
// the machine. With -j every run is one line of JSON as well. Under mpirun: the same cube on all
// ranks with one thread each, in blocks -x nx ny nz; -w gives every rank a cube of its own; -l
// measures an exchange.
//
// Processor time, and the fastest of the steps: what the machine does for others then matters
// least.

#include <omp.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "coupler/base/rank_exchange.hpp"
#include "flow_solver/immersed/immersed_boundary.hpp"
#include "flow_solver/pass_clock.hpp"
#include "tests/unit/immersed_shapes.hpp"
#include "tests/verification/flow_run.hpp"

namespace {

using namespace ocublast;
using namespace ocublast::flow;

struct Request {
  std::vector<int> sizes;
  std::vector<int> threads{1, 2};
  bool viscous = false, passes = false, marked = false, json = false;
  const char* isa = "";
  int steps = 0;
  double speed = -1.0;  ///< of the ball alone; below 0: all of them
  std::array<int, 3> blocks{};
  bool weak = false;
};

struct Rate {
  double wall = 0.0;  ///< cells per second of wall time, mean
  double cpu = 0.0;   ///< cells per second of processor time (all threads), mean
  double best = 0.0;  ///< cells per second and thread of the first thread, fastest step
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
  if (r.marked) o.premark_ratio = 1.5;
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
      out.pass[p] =
          std::min(out.pass[p], 1e9 * (flow.pass_seconds()[p] - before[p]) * threads / cells);
    }
  }
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  out.cpu = cells * steps / (static_cast<double>(std::clock() - cpu_begin) / CLOCKS_PER_SEC);
  out.wall = cells * steps / seconds;
  out.best = cells / threads / fastest;
  return out;
}

/// Under mpirun: seconds of wall time of a step on all ranks together (fastest and median), and
/// what this rank's neighbours get. Every rank has one thread.
void rank_rate(const Ranks& ranks, int n, const Request& r) {
  FlowOptions o = unit_options();
  o.rank_blocks = r.blocks;
  o.time_passes = true;  // tells the waiting
  const std::array<int, 3> nodes =
      r.weak ? std::array{n, n, n * ranks.size()} : std::array{n, n, n};
  Flow flow(uniform_grid(nodes, {0, 0, 0}, {1, 1, r.weak ? 1.0 * ranks.size() : 1.0}),
            all_faces(BoundaryKind::symmetry), o, &ranks);
  flow.set_state([](double x, double y, double z) {
    return State{.rho = 1.0, .p = x * x + y * y + z * z < 0.09 ? 8.0 : 1.0};
  });
  for (int s = 0; s < 2; ++s) flow.advance(0.0, flow.stable_step());
  std::vector<double> seconds;
  double cpu = 1e300;  // of the busiest rank without its waiting
  std::array<double, n_passes> pass{};
  pass.fill(1e300);
  std::vector<double> before(n_passes, 0.0);
  for (int s = 0; s < (r.steps > 0 ? r.steps : 10); ++s) {
    ranks.wait_for_all();
    const auto now = flow.pass_seconds();
    std::copy(now.begin(), now.end(), before.begin());
    const auto begin = std::chrono::steady_clock::now();
    const double busy = PassClock::now();
    flow.advance(0.0, flow.stable_step());
    constexpr auto waiting = static_cast<std::size_t>(Pass::waiting);
    const double work = PassClock::now() - busy - (flow.pass_seconds()[waiting] - before[waiting]);
    cpu = std::min(cpu, ranks.max_of_all(work));
    ranks.wait_for_all();
    seconds.push_back(ranks.max_of_all(
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count()));
    for (std::size_t p = 0; p < n_passes; ++p)
      pass[p] = std::min(pass[p], flow.pass_seconds()[p] - before[p]);
  }
  std::sort(seconds.begin(), seconds.end());
  if (!ranks.root()) return;
  const auto blocks = flow.rank_blocks();
  const auto traffic = flow.rank_traffic();
  const double cells = static_cast<double>(flow.grid().n_cells());
  std::printf(
      "flow_speed %d x %d x %d on %d ranks (%d x %d x %d): fastest step %.2f ms, median %.2f ms, "
      "processor %.2f ms, %.2f million "
      "cells/s; a rank sends %.0f messages, %.2f MB\n",
      nodes[0], nodes[1], nodes[2], ranks.size(), blocks[0], blocks[1], blocks[2],
      1e3 * seconds.front(), 1e3 * seconds[seconds.size() / 2], 1e3 * cpu,
      1e-6 * cells / seconds.front(), traffic[0], 1e-6 * traffic[1]);
  if (r.passes) {
    std::printf("  ms per step of rank 0:");
    for (std::size_t p = 0; p < n_passes; ++p)
      std::printf(" %s %.2f,", pass_names[p], 1e3 * pass[p]);
    std::printf("\n");
  }
  if (r.json) {
    std::printf(
        "{\"kind\": \"ranks\", \"n\": %d, \"ranks\": %d, \"weak\": %s, \"best\": %g, \"median\": "
        "%g, \"cpu\": %g, \"messages\": "
        "%g, \"bytes\": %g}\n",
        n, ranks.size(), r.weak ? "true" : "false", seconds.front(), seconds[seconds.size() / 2],
        cpu, traffic[0], traffic[1]);
  }
}

/// Latency and bandwidth of an exchange between the first two ranks: fastest of many.
void rank_limits(const Ranks& ranks) {
  for (const std::size_t count : {std::size_t{1}, std::size_t{1} << 17}) {
    std::vector<double> out(count), in(count);
    std::vector<RankExchange::Message> sends, receives;
    if (ranks.rank() < 2) {
      sends.push_back({1 - ranks.rank(), out});
      receives.push_back({1 - ranks.rank(), in});
    }
    RankExchange exchange(ranks, 900, sends, receives);
    double best = 1e300, reduction = 1e300;
    for (int repeat = 0; repeat < 200; ++repeat) {
      ranks.wait_for_all();
      const auto begin = std::chrono::steady_clock::now();
      exchange.start();
      exchange.finish();
      best = std::min(
          best, std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
      const auto middle = std::chrono::steady_clock::now();
      static_cast<void>(ranks.any_of_all(false));
      reduction = std::min(
          reduction,
          std::chrono::duration<double>(std::chrono::steady_clock::now() - middle).count());
    }
    if (!ranks.root()) continue;
    std::printf("{\"kind\": \"exchange\", \"bytes\": %zu, \"seconds\": %g, \"reduction\": %g}\n",
                8 * count, best, reduction);
  }
}

double cpu_now() {
  return PassClock::now();
}

/// A ball of hot gas in the middle of a cube until its front reaches the faces, with and without
/// the active box: processor time of both, largest relative difference of the pressure.
void blast(int n, double tolerance, bool json) {
  const auto run = [&](bool box, std::vector<double>& p, double& share) {
    FlowOptions o = unit_options();
    o.active_box = box;
    o.active_tolerance = tolerance;
    o.quiescent = State{.rho = 1.0, .p = 1.0};
    Boundaries faces = all_faces(BoundaryKind::outflow, o.quiescent);
    Flow flow(uniform_grid({n, n, n}, {-1, -1, -1}, {1, 1, 1}), faces, o);
    const double h = 2.0 / n, radius = 4.0 * h;
    flow.set_state([&](double x, double y, double z) {
      return State{.rho = 1.0, .p = x * x + y * y + z * z < radius * radius ? 1000.0 : 1.0};
    });
    const double begin = cpu_now();
    double front = 0.0, t = 0.0;
    share = 0.0;
    int steps = 0;
    const auto W = flow.primitives();
    while (front < 1.0 - 2.0 * h) {
      const double dt = flow.stable_step();
      share += flow.advance(t, dt).active_share;
      t += dt;
      ++steps;
      for (int i = n / 2; i < n;
           ++i) {  // the outermost node where the pressure has risen by a tenth
        if (W(0, i, n / 2, n / 2) * W(4, i, n / 2, n / 2) > 1.1) front = (i + 0.5) * h - 1.0;
      }
    }
    const double seconds = cpu_now() - begin;
    share /= steps;
    for (int k = 0; k < n; ++k) {
      for (int j = 0; j < n; ++j) {
        for (int i = 0; i < n; ++i) p.push_back(W(0, i, j, k) * W(4, i, j, k));
      }
    }
    return seconds;
  };
  std::vector<double> whole, part;
  double share = 1.0, all = 1.0;
  const double t_whole = run(false, whole, all), t_part = run(true, part, share);
  double difference = 0.0;
  for (std::size_t i = 0; i < whole.size(); ++i)
    difference = std::max(difference, std::abs(part[i] / whole[i] - 1.0));
  std::printf(
      "blast in a cube %d^3, tolerance %.0e: %.2f times faster, mean share %.2f, largest "
      "difference %.1e\n",
      n, tolerance, t_whole / t_part, share, difference);
  if (json) {
    std::printf(
        "{\"kind\": \"blast\", \"n\": %d, \"tolerance\": %g, \"speedup\": %g, \"share\": %g, "
        "\"difference\": %g}\n",
        n, tolerance, t_whole / t_part, share, difference);
  }
}

/// Time of a step of gas at rest in an active box against that of all of it.
void quiet(int n, bool json) {
  double seconds[2] = {}, share = 1.0;
  for (const bool box : {false, true}) {
    FlowOptions o = unit_options();
    o.active_box = box;
    o.quiescent = State{.rho = 1.0, .p = 1.0};
    Flow flow(uniform_grid({n, n, n}, {-1, -1, -1}, {1, 1, 1}),
              all_faces(BoundaryKind::outflow, o.quiescent), o);
    flow.set_state([&](double, double, double) { return o.quiescent; });
    seconds[box ? 1 : 0] = 1e300;
    for (int s = 0; s < 4; ++s) {
      const double begin = cpu_now();
      share = flow.advance(0.0, flow.stable_step()).active_share;
      seconds[box ? 1 : 0] = std::min(seconds[box ? 1 : 0], cpu_now() - begin);
    }
  }
  std::printf("quiet %d^3: a step takes %.2f %% of the whole one, share %.3f\n", n,
              100.0 * seconds[1] / seconds[0], share);
  if (json)
    std::printf("{\"kind\": \"quiet\", \"n\": %d, \"part\": %g, \"share\": %g}\n", n,
                seconds[1] / seconds[0], share);
}

/// A cube of quiet gas with a ball in it that moves by `cells_per_step` cells a step (below 0: no
/// ball).
class BallRun {
 public:
  BallRun(int n, double cells_per_step, bool passes) : n_(n), cells_(cells_per_step) {
    FlowOptions o = unit_options();
    o.threads = 1;
    o.time_passes = passes;
    const Grid grid = uniform_grid({n, n, n}, {0, 0, 0}, {1, 1, 1});
    const State quiet{.rho = 1.0, .p = 1.0};
    flow_ = std::make_unique<Flow>(grid, all_faces(BoundaryKind::outflow, quiet), o);
    flow_->set_state([&](double, double, double) { return quiet; });
    if (cells_ < 0.0) return;
    std::vector<Body> body;
    body.push_back({.name = "ball",
                    .surface = testing::make_sphere({.45, .5, .5}, .25, 5),
                    .moves = cells_ > 0.0});
    facets_ = body[0].surface.triangles.size() / 3;
    bodies_ = std::make_unique<ImmersedBoundary>(grid, o.gas, body, ImmersedOptions{});
    bodies_->update_topology(flow_->primitives());
    flow_->immerse(bodies_.get());
  }
  /// Processor seconds of one step.
  double step() {
    const double dt = flow_->stable_step();
    if (cells_ > 0.0) {
      std::vector<double> x(bodies_->position(0).begin(), bodies_->position(0).end()),
          v(x.size(), 0.0);
      for (std::size_t a = 0; a < x.size(); a += 3) {
        x[a] += cells_ / n_;
        v[a] = cells_ / n_ / dt;
      }
      bodies_->set_path(0, t_, t_ + dt, x, v);
    }
    const double begin = cpu_now();
    flow_->advance(t_, dt);
    static_cast<void>(flow_->stable_step());  // kept for the next step
    const double seconds = cpu_now() - begin;
    t_ += dt;
    return seconds;
  }
  [[nodiscard]] double cells_per_step() const { return cells_; }
  [[nodiscard]] std::size_t facets() const { return facets_; }
  [[nodiscard]] std::span<const double> pass_seconds() const { return flow_->pass_seconds(); }

 private:
  int n_;
  double cells_, t_ = 0.0;
  std::size_t facets_ = 0;
  std::unique_ptr<Flow> flow_;
  std::unique_ptr<ImmersedBoundary> bodies_;
};

double median_of(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2),
                   values.end());
  return values[values.size() / 2];
}

/// Processor time of a step in a cube with a ball: none, at rest, and moving so many cells a step
/// (or only r.speed of them). The cubes step in turn, so that the machine is the same for all:
/// medians of the time and of its ratio to the step without a ball beside it.
void ball(int n, const Request& r) {
  omp_set_num_threads(1);  // of the bodies
  std::vector<BallRun> runs;
  std::vector<double> speeds{-1.0, 0.0, 0.02, 0.1};
  if (r.speed >= 0.0) speeds = {-1.0, r.speed};
  for (const double cells : speeds) runs.emplace_back(n, cells, r.passes);
  std::vector<std::vector<double>> seconds(runs.size()), part(runs.size());
  for (BallRun& run : runs) run.step();
  std::vector<std::vector<double>> before;
  for (const BallRun& run : runs)
    before.emplace_back(run.pass_seconds().begin(), run.pass_seconds().end());
  const int steps = r.steps > 0 ? r.steps : 9;
  for (int s = 0; s < steps; ++s) {
    for (std::size_t i = 0; i < runs.size(); ++i) {
      seconds[i].push_back(runs[i].step());
      part[i].push_back(seconds[i].back() / seconds[0].back());
    }
  }
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const double time = median_of(seconds[i]), ratio = median_of(part[i]),
                 cells = runs[i].cells_per_step();
    std::printf("ball in %d^3, %zu facets, %g cells a step: %.1f ms a step, %.3f of one without\n",
                n, runs[i].facets(), std::max(0.0, cells), 1e3 * time, ratio);
    if (r.json && cells >= 0.0) {
      std::printf(
          "{\"kind\": \"ball\", \"n\": %d, \"facets\": %zu, \"cells_per_step\": %g, \"seconds\": "
          "%g, \"part\": %g}\n",
          n, runs[i].facets(), cells, time, ratio);
    }
    if (!r.passes) continue;
    std::printf("  ms per step:");
    for (std::size_t p = 0; p < n_passes; ++p) {
      std::printf(" %s %.1f,", pass_names[p],
                  1e3 * (runs[i].pass_seconds()[p] - before[i][p]) / steps);
    }
    std::printf("\n");
  }
}

/// What the memory gives one thread: bytes read per second in eight streams.
void limits(bool json) {
  constexpr std::size_t streams = 8, length = std::size_t{1} << 21;
  std::vector<double> data(streams * length, 1e-3);
  double read = 1e300, sum = 0.0;
  for (int repeat = 0; repeat < 7; ++repeat) {
    const double begin = cpu_now();
    std::array<double, 8> s{};
    for (std::size_t i = 0; i < length; i += 8) {
      for (std::size_t q = 0; q < streams; ++q) {
        for (std::size_t l = 0; l < 8; ++l) s[l] += data[q * length + i + l];
      }
    }
    read = std::min(read, cpu_now() - begin);
    for (double v : s) sum += v;
  }
  const double bandwidth = 8.0 * static_cast<double>(streams * length) / read;
  std::printf("limits: %.1f GB/s read by one thread (check %.3g)\n", 1e-9 * bandwidth, sum);
  if (json) std::printf("{\"kind\": \"limits\", \"read\": %g}\n", bandwidth);
}

int run(const Ranks& ranks, int argc, char** argv) {
  Request r;
  char scene = ' ';
  for (int a = 1; a < argc; ++a) {
    const std::string_view arg(argv[a]);
    const bool more = a + 1 < argc;
    if (arg == "-t" && more)
      r.threads = {std::atoi(argv[++a])};
    else if (arg == "-i" && more)
      r.isa = argv[++a];
    else if (arg == "-s" && more)
      r.steps = std::atoi(argv[++a]);
    else if (arg == "-c" && more)
      r.speed = std::atof(argv[++a]);
    else if (arg == "-v")
      r.viscous = true;
    else if (arg == "-m")
      r.marked = true;
    else if (arg == "-j")
      r.json = true;
    else if (arg == "-b" || arg == "-q" || arg == "-B" || arg == "-l")
      scene = arg[1];
    else if (arg == "-p")
      r.passes = true;
    else if (arg == "-w")
      r.weak = true;
    else if (arg == "-x" && a + 3 < argc) {
      for (int& blocks : r.blocks) blocks = std::atoi(argv[++a]);
    } else
      r.sizes.push_back(std::atoi(argv[a]));
  }
  if (!ranks.alone()) {
    if (scene == 'l') rank_limits(ranks);
    for (int n : r.sizes) rank_rate(ranks, n, r);
    return 0;
  }
  if (scene == 'l') return limits(r.json), 0;
  if (r.sizes.empty()) r.sizes = {64, 128};
  if (scene != ' ') {
    for (int n : r.sizes) {
      if (scene == 'q')
        quiet(n, r.json);
      else if (scene == 'B')
        ball(n, r);
      else
        for (const double tolerance : {1e-9, 1e-6}) blast(n, tolerance, r.json);
    }
    return 0;
  }
  for (int n : r.sizes) {
    for (int threads : r.threads) {
      const Rate x = rate(n, threads, r);
      std::printf(
          "flow_speed %d^3, %d thread%s%s: %.2f million cells/s, %.2f per processor second, best "
          "step %.2f\n",
          n, threads, threads > 1 ? "s" : "", r.viscous ? ", viscous" : "", 1e-6 * x.wall,
          1e-6 * x.cpu, 1e-6 * x.best);
      if (r.json) {
        std::printf(
            "{\"kind\": \"rate\", \"n\": %d, \"threads\": %d, \"viscous\": %s, \"marked\": %s, "
            "\"wall\": %g, "
            "\"cpu\": %g, \"best\": %g, \"passes\": [",
            n, threads, r.viscous ? "true" : "false", r.marked ? "true" : "false", x.wall, x.cpu,
            x.best);
        for (std::size_t p = 0; p < n_passes; ++p)
          std::printf("%s%g", p > 0 ? ", " : "", x.pass[p]);
        std::printf("]}\n");
      }
      if (!r.passes) continue;
      std::printf("  ns per cell and step:");
      for (std::size_t p = 0; p < n_passes; ++p) std::printf(" %s %.1f,", pass_names[p], x.pass[p]);
      std::printf(" all %.1f\n", 1e9 / x.best);
    }
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return run_on_ranks("flow_speed", [&](const Ranks& ranks) { return run(ranks, argc, argv); });
}
