// Runs one of the problems below on one rank or, under mpirun, on several, and writes the state of the
// whole grid at its end to a file, as doubles [field, k, j, i] behind the totals.
// Usage: flow_ranks_run PROBLEM BLOCKS_X BLOCKS_Y BLOCKS_Z STEPS FILE [save|resume FOLDER]

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "coupler/base/errors.hpp"
#include "flow_solver/grid/make_grid.hpp"
#include "flow_solver/io/checkpoint.hpp"
#include "flow_solver/ranks/gather.hpp"
#include "flow_solver/step.hpp"

namespace {

using namespace ocublast;
using namespace ocublast::flow;

struct Problem {
  Grid grid;
  Boundaries boundaries;
  FlowOptions options;
  std::function<State(double, double, double)> start;
  double step_factor = 1.0;  ///< on the stable step
};

constexpr double pi = std::numbers::pi;

Boundaries all_of(const Boundary& b) { return {b, b, b, b, b, b}; }

/// Sod's tube along one axis of a bar (of a line where only x is present).
Problem sod(std::size_t axis, bool line) {
  Problem p;
  for (std::size_t a = 0; a < 3; ++a) {
    const int n = a == axis ? 72 : 12;
    p.grid.axis[a] = line && a > 0 ? make_absent_axis() : make_uniform_axis(0.0, n / 72.0, n);
  }
  p.boundaries = all_of({.kind = BoundaryKind::symmetry});
  p.start = [axis](double x, double y, double z) {
    const double at = axis == 0 ? x : (axis == 1 ? y : z);
    const double part = 0.5 * (1.0 + std::tanh((at - 0.5) * 72.0 / 0.6));
    return State{.rho = 1.0 - 0.875 * part, .p = 1.0 - 0.9 * part};
  };
  return p;
}

/// A burst off the centre between a wall, planes of symmetry and open faces; the pressure ratio sets how
/// many nodes are marked and steps redone.
Problem blast(double pressure, bool stretched) {
  Problem p;
  for (std::size_t a = 0; a < 3; ++a) {
    p.grid.axis[a] = stretched ? make_axis({.min = -1.0, .max = 1.0, .spacing = 0.1, .refined = true, .zone_min = -0.3,
                                            .zone_max = 0.3, .zone_spacing = 0.04, .growth = 1.15})
                               : make_uniform_axis(-1.0, 1.0, 36);
  }
  p.boundaries = all_of({.kind = BoundaryKind::outflow, .state = {}});
  p.boundaries[0].kind = BoundaryKind::symmetry;
  p.boundaries[3].kind = BoundaryKind::wall;
  p.boundaries[3].wall = {.slip = true};
  p.boundaries[4].kind = BoundaryKind::symmetry;
  p.start = [pressure](double x, double y, double z) {
    const double r = std::sqrt((x - 0.1) * (x - 0.1) + (y + 0.05) * (y + 0.05) + (z - 0.02) * (z - 0.02));
    const double part = 0.5 * (1.0 - std::tanh((r - 0.3) / 0.03));
    return State{.rho = 1.0, .u = 0.01, .p = 1.0 + (pressure - 1.0) * part};
  };
  return p;
}

/// Viscous Taylor-Green vortex at Mach 0.3, Reynolds number 100, periodic or between no-slip walls in y.
Problem taylor_green(bool walls) {
  Problem p;
  for (std::size_t a = 0; a < 3; ++a) p.grid.axis[a] = make_uniform_axis(0.0, 2.0 * pi, 32, !(walls && a == 1));
  p.boundaries = all_of({.kind = BoundaryKind::periodic});
  if (walls) p.boundaries[2] = p.boundaries[3] = {.kind = BoundaryKind::wall, .wall = {.temperature = 1.0}};
  p.options.viscosity = Viscosity::constant;
  p.options.dynamic_viscosity = 0.01;
  const double p0 = 1.0 / (1.4 * 0.09);
  p.options.gas.gas_constant = p0;
  p.start = [p0](double x, double y, double z) {
    const double over = (std::cos(2.0 * x) + std::cos(2.0 * y)) * (std::cos(2.0 * z) + 2.0) / 16.0;
    return State{.rho = 1.0, .u = std::sin(x) * std::cos(y) * std::cos(z), .v = -std::cos(x) * std::sin(y) * std::cos(z),
                 .p = p0 + over};
  };
  return p;
}

/// A line that is too short to be divided as often as a test asks.
Problem short_line() {
  Problem p = sod(0, true);
  p.grid.axis[0] = make_uniform_axis(0.0, 1.0, 20);
  return p;
}

Problem make_problem(std::string name) {
  const auto has = [&](const std::string& part) {
    const auto at = name.find(part);
    if (at == std::string::npos) return false;
    name.erase(at, part.size());
    return true;
  };
  const bool eighth = has("_c8"), paper = has("_paper"), plain = has("_nofilter");
  Problem p;
  if (name == "line") p = sod(0, true);
  else if (name == "sod_x") p = sod(0, false);
  else if (name == "sod_y") p = sod(1, false);
  else if (name == "sod_z") p = sod(2, false);
  else if (name == "blast") p = blast(20.0, false);
  else if (name == "strong_blast") p = blast(2000.0, false);
  else if (name == "stretched_blast") p = blast(20.0, true);
  else if (name == "taylor_green") p = taylor_green(false);
  else if (name == "channel") p = taylor_green(true);
  else if (name == "short_line") p = short_line();
  else if (name == "hopeless") {  // a step that no first-order flux can save
    p = sod(2, false);
    p.step_factor = 30.0;
  } else if (name == "vacuum") {  // in the last block only
    p = sod(2, false);
    p.start = [](double, double, double z) { return State{.rho = z > 0.9 ? 0.0 : 1.0}; };
  }
  else throw CaseError("unknown problem " + name);
  if (eighth) p.options.scheme = Scheme::compact8;
  if (paper) p.options.diffusivity_form = DiffusivityForm::paper;
  if (plain) p.options.filter = false;
  return p;
}

int run(const Ranks& ranks, int argc, char** argv) {
  Problem p = make_problem(argv[1]);
  if (!ranks.alone()) p.options.rank_blocks = {std::atoi(argv[2]), std::atoi(argv[3]), std::atoi(argv[4])};
  Flow flow(p.grid, p.boundaries, p.options, &ranks);
  flow.set_state(p.start);
  double t = 0.0;
  Probes probes(flow.grid(), p.options.gas, {}, 0.0);
  const std::string task = argc > 7 ? argv[7] : "";
  if (task == "resume") t = read_checkpoint(argv[8], flow, nullptr, probes).time;
  int redone = 0;
  std::size_t marked = 0;
  for (int step = 0; step < std::atoi(argv[5]); ++step) {
    const double dt = p.step_factor * flow.stable_step();
    const StepReport report = flow.advance(t, dt);
    redone += report.redone;
    marked += report.marked_nodes;
    t += dt;
  }
  if (task == "save") {
    RunClock clock;
    clock.time = t;
    write_checkpoint(ranks, argv[8], flow, nullptr, probes, clock);
  }
  const Totals totals = flow.totals();
  const auto W = std::as_const(flow).primitives();
  std::vector<double> out{t, static_cast<double>(redone), static_cast<double>(marked), totals.mass, totals.energy};
  for (int f = 0; f < n_primitive; ++f) {
    const auto field = gather_nodes<double>(ranks, flow.grid(), flow.owned(),
                                            [&](int i, int j, int k) { return W(f, i, j, k); });
    out.insert(out.end(), field.begin(), field.end());
  }
  if (!ranks.root()) return 0;
  std::ofstream file(argv[6], std::ios::binary);
  file.write(reinterpret_cast<const char*>(out.data()), static_cast<std::streamsize>(out.size() * sizeof(double)));
  return file ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 7 && argc != 9) return 1;
  return run_on_ranks("flow_ranks_run", [&](const Ranks& ranks) {
    try {
      return run(ranks, argc, argv);
    } catch (const NumericsError&) {  // thrown by all ranks together
      if (ranks.root()) throw;
      ranks.wait_for_all();
      return 4;
    }
  });
}
