// Runs one of the problems below on one rank or, under mpirun, on several, and writes the state of
// the whole grid at its end to a file, as doubles [field, k, j, i] behind the totals and what the
// walls feel. Usage: flow_ranks_run PROBLEM BLOCKS_X BLOCKS_Y BLOCKS_Z STEPS FILE [save|resume
// FOLDER]

#include <algorithm>
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
#include "tests/verification/immersed_rig.hpp"

namespace {

using namespace ocublast;
using namespace ocublast::flow;

struct Problem {
  Grid grid;
  Boundaries boundaries;
  FlowOptions options;
  std::function<State(double, double, double)> start;
  double step_factor = 1.0;  ///< on the stable step
  std::vector<Body> bodies;
  std::function<double(double t)> shift;  ///< m, of moving bodies along x (and half as far along y)
};

constexpr double pi = std::numbers::pi;

Boundaries all_of(const Boundary& b) {
  return {b, b, b, b, b, b};
}

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

/// A burst off the centre between a wall, planes of symmetry and open faces; the pressure ratio
/// sets how many nodes are marked and steps redone.
Problem blast(double pressure, bool stretched) {
  Problem p;
  for (std::size_t a = 0; a < 3; ++a) {
    p.grid.axis[a] = stretched ? make_axis({.min = -1.0,
                                            .max = 1.0,
                                            .spacing = 0.1,
                                            .refined = true,
                                            .zone_min = -0.3,
                                            .zone_max = 0.3,
                                            .zone_spacing = 0.04,
                                            .growth = 1.15})
                               : make_uniform_axis(-1.0, 1.0, 36);
  }
  p.boundaries = all_of({.kind = BoundaryKind::outflow, .state = {}});
  p.boundaries[0].kind = BoundaryKind::symmetry;
  p.boundaries[3].kind = BoundaryKind::wall;
  p.boundaries[3].wall = {.slip = true};
  p.boundaries[4].kind = BoundaryKind::symmetry;
  p.start = [pressure](double x, double y, double z) {
    const double r =
        std::sqrt((x - 0.1) * (x - 0.1) + (y + 0.05) * (y + 0.05) + (z - 0.02) * (z - 0.02));
    const double part = 0.5 * (1.0 - std::tanh((r - 0.3) / 0.03));
    return State{.rho = 1.0, .u = 0.01, .p = 1.0 + (pressure - 1.0) * part};
  };
  return p;
}

/// Viscous Taylor-Green vortex at Mach 0.3, Reynolds number 100, periodic or between no-slip walls
/// in y.
Problem taylor_green(bool walls) {
  Problem p;
  for (std::size_t a = 0; a < 3; ++a)
    p.grid.axis[a] = make_uniform_axis(0.0, 2.0 * pi, 32, !(walls && a == 1));
  p.boundaries = all_of({.kind = BoundaryKind::periodic});
  if (walls)
    p.boundaries[2] = p.boundaries[3] = {.kind = BoundaryKind::wall, .wall = {.temperature = 1.0}};
  p.options.viscosity = Viscosity::constant;
  p.options.dynamic_viscosity = 0.01;
  const double p0 = 1.0 / (1.4 * 0.09);
  p.options.gas.gas_constant = p0;
  p.start = [p0](double x, double y, double z) {
    const double over = (std::cos(2.0 * x) + std::cos(2.0 * y)) * (std::cos(2.0 * z) + 2.0) / 16.0;
    return State{.rho = 1.0,
                 .u = std::sin(x) * std::cos(y) * std::cos(z),
                 .v = -std::cos(x) * std::sin(y) * std::cos(z),
                 .p = p0 + over};
  };
  return p;
}

/// A shock on bodies that lie across the borders, in two or three directions.
Problem shock_on(std::vector<Body> bodies, int n_x, int n_y, int n_z, double Ms = 1.6) {
  Problem p;
  p.grid = flow::testing::uniform_grid(n_x, n_y, n_z, static_cast<double>(n_x) / n_y);
  p.options = flow::testing::unit_gas_options();
  const State behind = flow::testing::behind_shock(Ms);
  p.boundaries = flow::testing::walls_all_round();
  p.boundaries[0] = {.kind = BoundaryKind::fixed_state, .state = behind};
  p.boundaries[1] = {.kind = BoundaryKind::outflow, .state = {.rho = 1.0, .p = 1.0}};
  const double h = 1.0 / n_y;
  p.start = [=](double x, double, double) {
    return flow::testing::shock_state(x - 0.3, h, behind);
  };
  p.bodies = std::move(bodies);
  return p;
}

Body body_of(BodySurface surface, bool moves = false) {
  return {.name = "body", .surface = std::move(surface), .moves = moves};
}

Problem bodies_problem(const std::string& name) {
  using namespace flow::testing;
  if (name == "cylinder")
    return shock_on({body_of(make_cylinder(0.66, 0.51, 0.17, 80))}, 64, 48, 1);
  if (name == "sphere")
    return shock_on({body_of(make_sphere({0.62, 0.51, 0.49}, 0.2, 4))}, 40, 32, 32);
  if (name == "plate")
    return shock_on({body_of(make_box({0.655, 0.2, -1.0}, {0.661, 0.8, 2.0}, 16))}, 64, 48, 1, 2.5);
  if (name == "overlap") {
    return shock_on({body_of(make_cylinder(0.62, 0.5, 0.12, 60)),
                     body_of(make_box({0.7, 0.4, -1}, {0.9, 0.9, 2}, 20))},
                    64, 48, 1);
  }
  if (name == "moving") {
    Problem p = shock_on({body_of(make_cylinder(0.55, 0.45, 0.14, 80), true)}, 64, 48, 1);
    p.shift = [](double t) { return 0.4 * t; };
    return p;
  }
  if (name == "moving_plate") {
    Problem p =
        shock_on({body_of(make_box({0.655, 0.2, -1.0}, {0.661, 0.8, 2.0}, 12), true)}, 64, 48, 1);
    p.shift = [](double t) { return 0.3 * t; };
    return p;
  }
  throw CaseError("unknown problem " + name);
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
  if (name == "line")
    p = sod(0, true);
  else if (name == "sod_x")
    p = sod(0, false);
  else if (name == "sod_y")
    p = sod(1, false);
  else if (name == "sod_z")
    p = sod(2, false);
  else if (name == "blast")
    p = blast(20.0, false);
  else if (name == "strong_blast")
    p = blast(2000.0, false);
  else if (name == "stretched_blast")
    p = blast(20.0, true);
  else if (name == "taylor_green")
    p = taylor_green(false);
  else if (name == "channel")
    p = taylor_green(true);
  else if (name == "short_line")
    p = short_line();
  else if (name == "hopeless") {  // a step that no first-order flux can save
    p = sod(2, false);
    p.step_factor = 30.0;
  } else if (name == "vacuum") {  // in the last block only
    p = sod(2, false);
    p.start = [](double, double, double z) { return State{.rho = z > 0.9 ? 0.0 : 1.0}; };
  } else
    p = bodies_problem(name);
  if (eighth) p.options.scheme = Scheme::compact8;
  if (paper) p.options.diffusivity_form = DiffusivityForm::paper;
  if (plain) p.options.filter = false;
  return p;
}

/// Wall paths over the next step.
void move_bodies(const Problem& p, ImmersedBoundary& walls, double t, double dt) {
  const double x = p.shift(t + dt), u = (p.shift(t + dt) - p.shift(t)) / dt;
  for (std::size_t b = 0; b < p.bodies.size(); ++b) {
    std::vector<double> position = p.bodies[b].surface.vertices, velocity(position.size(), 0.0);
    for (std::size_t v = 0; v < position.size(); v += 3) {
      position[v] += x;
      position[v + 1] += 0.5 * x;
      velocity[v] = u;
      velocity[v + 1] = 0.5 * u;
    }
    walls.set_path(b, t, t + dt, position, velocity);
  }
}

/// Force and moment on the first body, sum and maximum of the pressure at its vertices, gas beside
/// walls.
std::vector<double> what_walls_feel(const Flow& flow, const ImmersedBoundary* walls) {
  std::vector<double> felt(9, 0.0);
  if (walls == nullptr) return felt;
  const BodyLoad load = walls->load(flow.primitives(), 0, 1.0);
  std::copy(load.force.begin(), load.force.end(), felt.begin());
  std::copy(load.moment.begin(), load.moment.end(), felt.begin() + 3);
  std::vector<double> p(walls->position(0).size() / 3);
  walls->read_overpressure(flow.primitives(), 0, 1.0, p);
  for (const double v : p) {
    felt[6] += v;
    felt[7] = std::max(felt[7], v);
  }
  felt[8] = walls->wall_cells(flow.primitives()).mass;
  return felt;
}

int run(const Ranks& ranks, int argc, char** argv) {
  Problem p = make_problem(argv[1]);
  if (!ranks.alone())
    p.options.rank_blocks = {std::atoi(argv[2]), std::atoi(argv[3]), std::atoi(argv[4])};
  Flow flow(p.grid, p.boundaries, p.options, &ranks);
  flow.set_state(p.start);
  double t = 0.0;
  std::unique_ptr<ImmersedBoundary> walls;
  if (!p.bodies.empty()) {
    walls =
        std::make_unique<ImmersedBoundary>(flow.grid(), p.options.gas, p.bodies, ImmersedOptions{});
    walls->share(ranks, flow.owned_by_rank());
  }
  Probes probes(flow.grid(), p.options.gas, {}, 0.0);
  const std::string task = argc > 7 ? argv[7] : "";
  std::vector<std::uint8_t> history;
  if (task == "resume") {
    const RunClock clock = read_checkpoint(argv[8], flow, walls.get(), probes);
    t = clock.time;
    history = clock.walls;
  }
  if (walls) {
    walls->move_to(t);
    static_cast<void>(walls->update_topology(flow.primitives()));
    if (!history.empty()) walls->restore_history(history);
    flow.immerse(walls.get());
  }
  int redone = 0;
  std::size_t marked = 0;
  for (int step = 0; step < std::atoi(argv[5]); ++step) {
    const double dt = p.step_factor * flow.stable_step();
    if (p.shift) move_bodies(p, *walls, t, dt);
    const StepReport report = flow.advance(t, dt);
    redone += report.redone;
    marked += report.marked_nodes;
    t += dt;
  }
  if (task == "save") {
    RunClock clock;
    clock.time = t;
    write_checkpoint(ranks, argv[8], flow, walls.get(), probes, clock);
  }
  const Totals totals = flow.totals();
  const auto W = std::as_const(flow).primitives();
  std::vector<double> out{t, static_cast<double>(redone), static_cast<double>(marked), totals.mass,
                          totals.energy};
  const std::vector<double> felt = what_walls_feel(flow, walls.get());
  out.insert(out.end(), felt.begin(), felt.end());
  for (int f = 0; f < n_primitive; ++f) {
    const auto field = gather_nodes<double>(ranks, flow.grid(), flow.owned(),
                                            [&](int i, int j, int k) { return W(f, i, j, k); });
    out.insert(out.end(), field.begin(), field.end());
  }
  if (!ranks.root()) return 0;
  std::ofstream file(argv[6], std::ios::binary);
  file.write(reinterpret_cast<const char*>(out.data()),
             static_cast<std::streamsize>(out.size() * sizeof(double)));
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
