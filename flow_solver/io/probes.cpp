#include "flow_solver/io/probes.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "coupler/base/errors.hpp"
#include "flow_solver/io/csv_table.hpp"
#include "flow_solver/ranks/gather.hpp"

namespace ocublast::flow::inline OCU_PRECISION {
namespace {

/// Node below x and the weight of the node above it. Beyond the outermost nodes: that node alone.
std::pair<int, double> bracket(const Axis& axis, double x) {
  if (!axis.present || axis.n == 1) return {0, 0.0};
  const auto first = axis.node.begin() + axis.ghosts();
  const auto above = std::upper_bound(first, first + axis.n, x);
  const int i = std::clamp(static_cast<int>(above - first) - 1, 0, axis.n - 2);
  return {i, std::clamp((x - axis.x(i)) / (axis.x(i + 1) - axis.x(i)), 0.0, 1.0)};
}

}  // namespace

Probes::Probes(const Grid& grid, const Gas& gas, std::vector<Probe> probes, double ambient_pressure)
    : grid_(&grid), gas_(gas), probes_(std::move(probes)), ambient_pressure_(ambient_pressure) {
  for (const auto& probe : probes_) {
    std::array<std::pair<int, double>, 3> at;
    for (std::size_t a = 0; a < 3; ++a) {
      const Axis& axis = grid.axis[a];
      if (axis.present && (probe.position[a] < axis.min || probe.position[a] > axis.max))
        throw CaseError(
            fmt::format("flow.probe '{}': {} = {} m is outside the grid, accepted [{}, {}]",
                        probe.name, "xyz"[a], probe.position[a], axis.min, axis.max));
      at[a] = bracket(axis, probe.position[a]);
    }
    std::array<Corner, 8> corners;
    for (std::size_t c = 0; c < 8; ++c) {
      corners[c].weight = 1.0;
      for (std::size_t a = 0; a < 3; ++a) {
        const bool above = ((c >> a) & 1U) != 0U;
        corners[c].node[a] = std::min(at[a].first + (above ? 1 : 0), grid.axis[a].n - 1);
        corners[c].weight *= above ? at[a].second : 1.0 - at[a].second;
      }
    }
    corners_.push_back(corners);
  }
}

void Probes::open(const std::filesystem::path& csv, double resume_time) {
  std::string header = "time_s";
  for (const auto& probe : probes_)
    header += fmt::format(",{0}_overpressure_Pa,{0}_density_kg_m3,{0}_u_m_s,{0}_v_m_s,{0}_w_m_s",
                          probe.name);
  file_ = open_csv_table(csv, header, resume_time);
}

void Probes::sample(const Ranks& ranks, const NodeBox& own, FieldsView<const Real> W,
                    std::span<const std::uint8_t> tags, double t) {
  std::string line = fmt::format("{:.17g}", t);
  times_.push_back(t);
  // Per probe: the primitives, the pressure and the weight of the fluid corners.
  constexpr std::size_t n_sums = n_primitive + 2;
  std::vector<double> sums(n_sums * corners_.size(), 0.0);
  for (std::size_t b = 0; b < corners_.size(); ++b) {
    double* sum = sums.data() + n_sums * b;
    for (const auto& corner : corners_[b]) {
      const auto [i, j, k] = corner.node;
      if (corner.weight == 0.0 || !holds(own, i, j, k)) continue;
      if (!tags.empty() && tags[place_of(*grid_, i, j, k)] != 0U) continue;
      for (int f = 0; f < n_primitive; ++f) sum[f] += corner.weight * W(f, i, j, k);
      sum[n_primitive] += corner.weight * pressure(gas_, W(prim_rho, i, j, k), W(prim_T, i, j, k));
      sum[n_primitive + 1] += corner.weight;
    }
  }
  if (!corners_.empty()) ranks.sum_of_all(sums);
  for (std::size_t b = 0; b < corners_.size(); ++b) {
    const double* sum = sums.data() + n_sums * b;
    const double p = sum[n_primitive], weight = sum[n_primitive + 1];
    // A probe that a body has covered reads ambient: nothing is measured there.
    const double scale = weight > 0.0 ? 1.0 / weight : 0.0;
    const double over = weight > 0.0 ? p * scale - ambient_pressure_ : 0.0;
    history_.push_back(over);
    largest_ = std::max(largest_, over);
    line += fmt::format(",{:.9g},{:.9g},{:.9g},{:.9g},{:.9g}", over, sum[prim_rho] * scale,
                        sum[prim_u] * scale, sum[prim_v] * scale, sum[prim_w] * scale);
  }
  if (file_.is_open()) file_ << line << '\n';
}

void Probes::restore(std::vector<double> times, std::vector<double> history) {
  times_ = std::move(times);
  history_ = std::move(history);
  largest_ = 0.0;
  for (const double p : history_) largest_ = std::max(largest_, p);
}

ProbeResult condense_history(std::span<const double> times, std::span<const double> values,
                             std::size_t b, std::size_t n) {
  ProbeResult result;
  const auto at = [&](std::size_t s) { return values[s * n + b]; };
  for (std::size_t s = 0; s < times.size(); ++s)
    if (at(s) > result.peak) {
      result.peak = at(s);
      result.peak_time = times[s];
    }
  // The first wave: up to where the pressure has fallen below half of the maximum seen so far.
  double first_peak = 0.0;
  for (std::size_t s = 0; s < times.size(); ++s) {
    first_peak = std::max(first_peak, at(s));
    if (first_peak > 0.05 * result.peak && at(s) < 0.5 * first_peak) break;
  }
  for (std::size_t s = 1; s < times.size(); ++s)
    if (at(s) >= 0.5 * first_peak && first_peak > 0.0) {
      const double rise = at(s) - at(s - 1);
      const double part = rise > 0.0 ? (0.5 * first_peak - at(s - 1)) / rise : 1.0;
      result.arrival = times[s - 1] + std::clamp(part, 0.0, 1.0) * (times[s] - times[s - 1]);
      break;
    }
  if (result.arrival < 0.0) return result;
  for (std::size_t s = 1; s < times.size(); ++s) {
    const double mean = 0.5 * (at(s) + at(s - 1));
    if (times[s] > result.arrival && mean < 0.0) break;
    if (mean > 0.0) result.impulse += mean * (times[s] - times[s - 1]);
  }
  return result;
}

}  // namespace ocublast::flow
