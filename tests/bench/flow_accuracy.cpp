// Error against cells and time of the gas schemes on problems with known answers, one run per call:
//   flow_accuracy run PROBLEM SCHEME N FILE  prints error, processor seconds, steps; FILE holds the
//   reference flow_accuracy initial PROBLEM N         prints "rho u v w p" of every cell
//   flow_accuracy reference PROBLEM N       prints "value weight" of every cell: error = sum of
//   weight
//                                           |computed - value|
// Problems: sod, shu_osher (in the waves behind the shock), vortex (N x N), burst (octant of N^3 /
// 8 cells).

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include "tests/verification/flow_exact.hpp"
#include "tests/verification/flow_run.hpp"

namespace ocublast::flow {
namespace {

constexpr double pi = std::numbers::pi;

struct Problem {
  Grid grid;
  Boundaries faces;
  double end = 0.0;
  bool pressure = false;  ///< compared is the pressure, else the density
  std::function<State(double, double, double)> state;
};

double blend(double left, double right, double x, double h) {
  return 0.5 * (left + right) - 0.5 * (left - right) * std::tanh(x / (0.5 * h));
}

const State sod_left{.rho = 1.0, .p = 1.0}, sod_right{.rho = 0.125, .p = 0.1};
const State shu_left{.rho = 3.857143, .u = 2.629369, .p = 10.33333};
constexpr double burst_radius = 0.2, burst_pressure = 100.0, burst_end = 0.08;

Problem sod(int n) {
  const double h = 1.0 / n;
  return {uniform_grid({n, 1, 1}, {-0.5, 0, 0}, {0.5, 1, 1}), all_faces(BoundaryKind::symmetry),
          0.2, false, [h](double x, double, double) {
            return State{.rho = blend(sod_left.rho, sod_right.rho, x, h),
                         .p = blend(sod_left.p, sod_right.p, x, h)};
          }};
}

Problem shu_osher(int n) {
  Boundaries faces = all_faces(BoundaryKind::fixed_state, shu_left);
  faces[1] = {.kind = BoundaryKind::outflow, .state = {.rho = 1.0, .p = 1.0}};
  const double h = 2.0 / n;
  return {uniform_grid({n, 1, 1}, {-1, 0, 0}, {1, 1, 1}), faces, 0.47, false,
          [h](double x, double, double) {
            const double rho = 1.0 + 0.2 * std::sin(5.0 * pi * x);
            return State{.rho = blend(shu_left.rho, rho, x + 0.8, h),
                         .u = blend(shu_left.u, 0.0, x + 0.8, h),
                         .p = blend(shu_left.p, 1.0, x + 0.8, h)};
          }};
}

/// Isentropic vortex (Shu 1998) carried once through a periodic box of 10 x 10.
State vortex_state(double x, double y) {
  constexpr double strength = 5.0, g = 1.4;
  const double r2 = x * x + y * y, e = std::exp(0.5 * (1.0 - r2));
  const double T = 1.0 - (g - 1.0) * strength * strength / (8.0 * g * pi * pi) * e * e;
  const double rho = std::pow(T, 1.0 / (g - 1.0));
  return {.rho = rho,
          .u = 1.0 - strength / (2.0 * pi) * e * y,
          .v = 1.0 + strength / (2.0 * pi) * e * x,
          .p = rho * T};
}

Problem vortex(int n) {
  return {uniform_grid({n, n, 1}, {-5, -5, 0}, {5, 5, 1}, true), all_faces(BoundaryKind::periodic),
          10.0, false, [](double x, double y, double) { return vortex_state(x, y); }};
}

Problem burst(int n) {
  const double h = 2.0 / n;
  Boundaries faces = all_faces(BoundaryKind::outflow, {.rho = 1.0, .p = 1.0});
  faces[0].kind = faces[2].kind = faces[4].kind = BoundaryKind::symmetry;
  const int m = n / 2;
  return {uniform_grid({m, m, m}, {0, 0, 0}, {1, 1, 1}), faces, burst_end, true,
          [h](double x, double y, double z) {
            const double r = std::sqrt(x * x + y * y + z * z);
            return State{.rho = 1.0, .p = blend(burst_pressure, 1.0, r - burst_radius, h)};
          }};
}

Problem problem_of(const std::string& name, int n) {
  if (name == "sod") return sod(n);
  if (name == "shu_osher") return shu_osher(n);
  if (name == "vortex") return vortex(n);
  if (name == "burst") return burst(n);
  std::fprintf(stderr, "flow_accuracy: no problem '%s'\n", name.c_str());
  std::exit(2);
}

FlowOptions options_of(const std::string& scheme) {
  FlowOptions o = unit_options();
  o.scheme = scheme == "muscl" ? Scheme::muscl
                               : (scheme == "compact8" ? Scheme::compact8 : Scheme::compact6);
  return o;
}

struct Reference {
  double value = 0.0, weight = 0.0;
};

std::vector<double> line_values(Flow& flow, bool pressure) {
  std::vector<double> out;
  const auto W = flow.primitives();
  for (int i = 0; i < flow.grid().axis[0].n; ++i)
    out.push_back(W(0, i, 0, 0) * (pressure ? W(4, i, 0, 0) : 1.0));
  return out;
}

/// Means over the cells of n of a compact6 run on 3200 cells (4800 for N above 400): its own error
/// in the waves is a tenth of that of 400 cells.
std::vector<Reference> shu_osher_reference(int n) {
  const int fine = n > 400 ? 8 * n : 3200 / n * n;
  const Problem p = shu_osher(fine);
  Flow flow(p.grid, p.faces, options_of("compact6"));
  flow.set_state(p.state);
  run_to(flow, p.end);
  const std::vector<double> rho = line_values(flow, false);
  const int part = fine / n;
  std::vector<Reference> out;
  int inside = 0;
  for (int i = 0; i < n; ++i) {
    double mean = 0.0;
    for (int m = 0; m < part; ++m) mean += rho[static_cast<std::size_t>(i * part + m)] / part;
    const double x = -1.0 + (i + 0.5) * 2.0 / n;
    const bool waves = x > 0.45 && x < 0.85;
    inside += waves ? 1 : 0;
    out.push_back({mean, waves ? 1.0 : 0.0});
  }
  for (Reference& r : out) r.weight /= inside;
  return out;
}

/// Pressure by distance from a spherical run on 2000 cells.
std::vector<Reference> burst_reference(const Grid& grid) {
  Grid line = uniform_grid({2000, 1, 1}, {0, 0, 0}, {2, 1, 1});
  line.geometry = Geometry::spherical;
  Boundaries faces = all_faces(BoundaryKind::outflow, {.rho = 1.0, .p = 1.0});
  faces[0].kind = BoundaryKind::symmetry;
  Flow flow(line, faces, options_of("muscl"));
  flow.set_state([](double r, double, double) {
    return State{.rho = 1.0, .p = r < burst_radius ? burst_pressure : 1.0};
  });
  run_to(flow, burst_end);
  const std::vector<double> p = line_values(flow, true);
  std::vector<Reference> out;
  double count = 0.0;
  for (int k = 0; k < grid.axis[2].n; ++k)
    for (int j = 0; j < grid.axis[1].n; ++j)
      for (int i = 0; i < grid.axis[0].n; ++i) {
        const double x = grid.axis[0].x(i), y = grid.axis[1].x(j), z = grid.axis[2].x(k);
        const double r = std::sqrt(x * x + y * y + z * z);
        const double s = std::max(0.0, r / 1e-3 - 0.5);
        const auto c = std::min<std::size_t>(static_cast<std::size_t>(s), p.size() - 2);
        const double f = s - static_cast<double>(c);
        out.push_back({(1.0 - f) * p[c] + f * p[c + 1], r < 1.0 ? 1.0 : 0.0});
        count += out.back().weight;
      }
  for (Reference& r : out) r.weight /= count;
  return out;
}

std::vector<Reference> reference_of(const std::string& name, int n, const Grid& grid) {
  if (name == "shu_osher") return shu_osher_reference(n);
  if (name == "burst") return burst_reference(grid);
  std::vector<Reference> out;
  if (name == "sod") {
    const ExactRiemann exact(sod_left, sod_right, 1.4);
    for (int i = 0; i < n; ++i) {
      const double a = -0.5 + static_cast<double>(i) / n;
      out.push_back({exact.mean_density(a, a + 1.0 / n, 0.2), 1.0 / n});
    }
    return out;
  }
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i)
      out.push_back({vortex_state(grid.axis[0].x(i), grid.axis[1].x(j)).rho,
                     1.0 / (static_cast<double>(n) * n)});
  return out;
}

/// What `reference` printed; empty where the file does not hold a cell a line.
std::vector<Reference> read_reference(const std::string& path, std::size_t cells) {
  std::ifstream in(path);
  std::vector<Reference> out;
  for (Reference r; in >> r.value >> r.weight;) out.push_back(r);
  if (out.size() != cells) out.clear();
  return out;
}

int run(const std::string& name, const std::string& scheme, int n,
        const std::string& reference_file) {
  const Problem p = problem_of(name, n);
  Flow flow(p.grid, p.faces, options_of(scheme));
  flow.set_state(p.state);
  const std::clock_t start = std::clock();
  const RunSummary summary = run_to(flow, p.end);
  const double seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  const auto reference = read_reference(reference_file, p.grid.n_cells());
  if (reference.empty()) {
    std::fprintf(stderr, "flow_accuracy: '%s' is no reference for %s %d\n", reference_file.c_str(),
                 name.c_str(), n);
    return 2;
  }
  double error = 0.0;
  std::size_t cell = 0;
  const auto W = flow.primitives();
  for (int k = 0; k < p.grid.axis[2].n; ++k)
    for (int j = 0; j < p.grid.axis[1].n; ++j)
      for (int i = 0; i < p.grid.axis[0].n; ++i) {
        const Reference& r = reference[cell++];
        error += r.weight * std::abs(W(0, i, j, k) * (p.pressure ? W(4, i, j, k) : 1.0) - r.value);
      }
  std::printf("%.6e %.6e %d\n", error, seconds, summary.steps);
  return 0;
}

int print_cells(const std::string& what, const std::string& name, int n) {
  const Problem p = problem_of(name, n);
  if (what == "reference") {
    for (const Reference& r : reference_of(name, n, p.grid))
      std::printf("%.12e %.12e\n", r.value, r.weight);
    return 0;
  }
  for (int k = 0; k < p.grid.axis[2].n; ++k)
    for (int j = 0; j < p.grid.axis[1].n; ++j)
      for (int i = 0; i < p.grid.axis[0].n; ++i) {
        const State s = p.state(p.grid.axis[0].x(i), p.grid.axis[1].x(j), p.grid.axis[2].x(k));
        std::printf("%.12e %.12e %.12e %.12e %.12e\n", s.rho, s.u, s.v, s.w, s.p);
      }
  return 0;
}

}  // namespace
}  // namespace ocublast::flow

int main(int argc, char** argv) {
  const std::string what = argc > 1 ? argv[1] : "";
  if (what == "run" && argc == 6)
    return ocublast::flow::run(argv[2], argv[3], std::atoi(argv[4]), argv[5]);
  if ((what == "initial" || what == "reference") && argc == 4) {
    return ocublast::flow::print_cells(what, argv[2], std::atoi(argv[3]));
  }
  std::fprintf(
      stderr,
      "usage: flow_accuracy run PROBLEM SCHEME N FILE | initial PROBLEM N | reference PROBLEM N\n");
  return 2;
}
