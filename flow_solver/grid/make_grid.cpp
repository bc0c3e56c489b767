#include "flow_solver/grid/make_grid.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "coupler/base/errors.hpp"

namespace ocublast::flow {
namespace {

// Rows of the compact face solve forget an end by 0.382 per cell: 40 cells reach round-off.
constexpr int face_solve_margin = 40;
// Steps of the trapezoidal rule per expected cell when the spacing is integrated.
constexpr int samples_per_cell = 64;
// Below 8 nodes a line is shorter than the filter's stencil.
constexpr int fewest_nodes = 8;
// A map whose spacing doubles from cell to cell has no smooth metric for sixth-order differences.
constexpr double most_growth = 2.0;

/// Spacing wanted at x: that of the zone, growing linearly with the distance from it. Linear in x
/// is geometric from cell to cell.
double wanted_spacing(const AxisSpec& spec, double x) {
  if (!spec.refined) return spec.spacing;
  const double distance = std::max({spec.zone_min - x, x - spec.zone_max, 0.0});
  return std::min(spec.spacing, spec.zone_spacing + std::log(spec.growth) * distance);
}

/// Nodes inside [min, max]: x(i + 1/2) of the map whose slope follows the wanted spacing.
std::vector<double> inner_nodes(const AxisSpec& spec) {
  if (!spec.nodes.empty()) return spec.nodes;
  const double length = spec.max - spec.min;
  const double finest = spec.refined ? std::min(spec.spacing, spec.zone_spacing) : spec.spacing;
  if (!spec.refined) {
    const int n = std::max(1, static_cast<int>(std::lround(length / spec.spacing)));
    std::vector<double> nodes(static_cast<std::size_t>(n));
    for (int i = 0; i < n; ++i)
      nodes[static_cast<std::size_t>(i)] = spec.min + (i + 0.5) * length / n;
    return nodes;
  }
  const auto samples = static_cast<std::size_t>(std::ceil(length / finest)) * samples_per_cell;
  const double dx = length / static_cast<double>(samples);
  std::vector<double> index(samples + 1, 0.0);  // cells from min to the sample
  for (std::size_t s = 0; s < samples; ++s) {
    const double x = spec.min + static_cast<double>(s) * dx;
    index[s + 1] =
        index[s] + 0.5 * dx * (1.0 / wanted_spacing(spec, x) + 1.0 / wanted_spacing(spec, x + dx));
  }
  const int n = std::max(1, static_cast<int>(std::ceil(index.back() - 1e-9)));
  const double scale = index.back() / n;
  std::vector<double> nodes(static_cast<std::size_t>(n));
  std::size_t s = 0;
  for (int i = 0; i < n; ++i) {
    const double target = (i + 0.5) * scale;
    while (index[s + 1] < target) ++s;
    const double part = (target - index[s]) / (index[s + 1] - index[s]);
    nodes[static_cast<std::size_t>(i)] = spec.min + (static_cast<double>(s) + part) * dx;
  }
  return nodes;
}

/// Centre of cell k of a layer whose cells grow from h: a continuous geometric map at k + 1/2.
double layer_offset(double h, double ratio, double index) {
  if (ratio <= 1.0 + 1e-12) return h * index;
  return h * (std::pow(ratio, index) - 1.0) / std::log(ratio);
}

void check(const AxisSpec& spec) {
  const auto refuse = [](const std::string& text) { throw CaseError("grid: " + text); };
  if (!(spec.max > spec.min))
    refuse(fmt::format("max {} m is not above min {} m", spec.max, spec.min));
  if (!(spec.spacing > 0.0)) refuse(fmt::format("spacing is {} m, accepted above 0", spec.spacing));
  if (spec.refined &&
      !(spec.zone_spacing > 0.0 && spec.zone_max >= spec.zone_min && spec.growth > 1.0)) {
    refuse(
        fmt::format("fine zone [{}, {}] m with spacing {} m and growth {}: accepted are a "
                    "non-negative length, a positive spacing and a growth above 1",
                    spec.zone_min, spec.zone_max, spec.zone_spacing, spec.growth));
  }
  if (spec.periodic && (spec.low.cells > 0 || spec.high.cells > 0)) {
    refuse("a periodic direction takes no stretched layers");
  }
  if (spec.low.cells < 0 || spec.high.cells < 0 || spec.low.ratio < 1.0 || spec.high.ratio < 1.0) {
    refuse("a stretched layer needs cells >= 0 and a ratio >= 1");
  }
}

/// Position of node i of a line extended beyond its ends (mirrored, or repeated if periodic).
double extended_node(std::span<const double> nodes, double min, double max, int i, bool periodic) {
  const int n = static_cast<int>(nodes.size());
  double shift = 0.0;
  double sign = 1.0;
  for (;;) {
    if (i >= 0 && i < n) return shift + sign * nodes[static_cast<std::size_t>(i)];
    const bool low = i < 0;
    if (periodic) {
      shift += low ? min - max : max - min;
      i += low ? n : -n;
    } else {
      shift += sign * 2.0 * (low ? min : max);
      sign = -sign;
      i = low ? -1 - i : 2 * n - 1 - i;
    }
  }
}

}  // namespace

std::string fault_of_nodes(double min, double max, std::span<const double> nodes) {
  const std::size_t n = nodes.size();
  if (n < static_cast<std::size_t>(fewest_nodes)) {
    return fmt::format("holds {} cell centres, accepted at least {}", n, fewest_nodes);
  }
  for (std::size_t i = 0; i < n; ++i) {
    if (!(nodes[i] > min && nodes[i] < max)) {
      return fmt::format("cell centre {} is {} m, accepted ({}, {}) m", i + 1, nodes[i], min, max);
    }
    if (i > 0 && !(nodes[i] > nodes[i - 1])) {
      return fmt::format("cell centre {} is {} m and follows {} m: they must rise", i + 1, nodes[i],
                         nodes[i - 1]);
    }
  }
  // Distances between centres, twice the distance to an end face.
  double before = 2.0 * (nodes[0] - min);
  for (std::size_t i = 1; i <= n; ++i) {
    const double here = i < n ? nodes[i] - nodes[i - 1] : 2.0 * (max - nodes[n - 1]);
    if (here > most_growth * before || before > most_growth * here) {
      return fmt::format(
          "the spacing changes from {:.6g} m to {:.6g} m at cell {}, accepted a factor of {} at "
          "most",
          before, here, i, most_growth);
    }
    before = here;
  }
  return {};
}

Axis make_axis_from_nodes(double min, double max, std::span<const double> nodes, bool periodic) {
  const int n = static_cast<int>(nodes.size());
  if (n < fewest_nodes) {
    throw CaseError(
        fmt::format("grid: {} cells between {} m and {} m, accepted at least {} in a "
                    "present direction; refine, or leave the direction out",
                    n, min, max, fewest_nodes));
  }
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (!(nodes[i] > min && nodes[i] < max) || (i > 0 && !(nodes[i] > nodes[i - 1]))) {
      throw CaseError("grid: " + fault_of_nodes(min, max, nodes));
    }
  }
  // Faces -margin .. n + margin; the outermost two rows are closed at second order, far away.
  const int m = face_solve_margin;
  const auto x = [&](int i) { return extended_node(nodes, min, max, i, periodic); };
  const int rows = n + 2 * m + 1;
  std::vector<double> face(static_cast<std::size_t>(rows));
  std::vector<double> upper(static_cast<std::size_t>(rows), 0.0);
  constexpr double alpha = 1.0 / 3.0;
  for (int r = 0; r < rows; ++r) {
    const int j = r - m;
    const auto s = static_cast<std::size_t>(r);
    if (r == 0 || r == rows - 1) {
      face[s] = 0.5 * (x(j - 1) + x(j));
      continue;
    }
    const double rhs = 29.0 / 36.0 * (x(j - 1) + x(j)) + 1.0 / 36.0 * (x(j - 2) + x(j + 1));
    const double pivot = 1.0 / (1.0 - alpha * upper[s - 1]);
    upper[s] = alpha * pivot;
    face[s] = pivot * (rhs - alpha * face[s - 1]);
  }
  for (int r = rows - 2; r > 0; --r) {
    face[static_cast<std::size_t>(r)] -=
        upper[static_cast<std::size_t>(r)] * face[static_cast<std::size_t>(r + 1)];
  }
  Axis axis;
  axis.n = n;
  axis.present = true;
  axis.min = min;
  axis.max = max;
  for (int i = -n_ghost; i < n + n_ghost; ++i) {
    axis.node.push_back(x(i));
    const auto s = static_cast<std::size_t>(i + m);
    axis.jacobian.push_back(face[s + 1] - face[s]);
    axis.inverse.push_back(1.0 / axis.jacobian.back());
  }
  return axis;
}

Axis make_uniform_axis(double min, double max, int n, bool periodic) {
  return make_axis({.min = min, .max = max, .spacing = (max - min) / n, .periodic = periodic});
}

Axis make_absent_axis() {
  return {.n = 1,
          .present = false,
          .min = 0.0,
          .max = 1.0,
          .node = {0.5},
          .jacobian = {1.0},
          .inverse = {1.0}};
}

Axis make_axis(const AxisSpec& spec) {
  if (!spec.present) return make_absent_axis();
  check(spec);
  const std::vector<double> inner = inner_nodes(spec);
  const double h_low = 2.0 * (inner.front() - spec.min);
  const double h_high = 2.0 * (spec.max - inner.back());
  std::vector<double> nodes;
  for (int k = spec.low.cells - 1; k >= 0; --k) {
    nodes.push_back(spec.min - layer_offset(h_low, spec.low.ratio, k + 0.5));
  }
  nodes.insert(nodes.end(), inner.begin(), inner.end());
  for (int k = 0; k < spec.high.cells; ++k) {
    nodes.push_back(spec.max + layer_offset(h_high, spec.high.ratio, k + 0.5));
  }
  const double min = spec.min - layer_offset(h_low, spec.low.ratio, spec.low.cells);
  const double max = spec.max + layer_offset(h_high, spec.high.ratio, spec.high.cells);
  return make_axis_from_nodes(min, max, nodes, spec.periodic);
}

Grid make_grid(const std::array<AxisSpec, 3>& specs, Geometry geometry) {
  return {.axis = {make_axis(specs[0]), make_axis(specs[1]), make_axis(specs[2])},
          .geometry = geometry};
}

double cell_volume(const Grid& grid, int i, int j, int k) {
  return grid.radial_weight(i) * grid.axis[0].h(i) * grid.axis[1].h(j) * grid.axis[2].h(k);
}

}  // namespace ocublast::flow
