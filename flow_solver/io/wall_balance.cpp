#include "flow_solver/io/wall_balance.hpp"

#include <algorithm>
#include <cmath>

#include "coupler/base/errors.hpp"
#include "flow_solver/ranks/gather.hpp"

namespace ocublast::flow::inline OCU_PRECISION {
namespace {

bool is_open(BoundaryKind kind) {
  return kind != BoundaryKind::symmetry && kind != BoundaryKind::wall &&
         kind != BoundaryKind::periodic;
}

}  // namespace

WallBalance::WallBalance(const Ranks& ranks, const Flow& flow, const ImmersedBoundary& bodies)
    : ranks_(ranks),
      flow_(flow),
      bodies_(bodies),
      impulse_(bodies.n_bodies()),
      force_(bodies.n_bodies()) {
  for (std::size_t b = 0; b < bodies.n_bodies(); ++b) {
    const auto& x = bodies.body(b).surface.vertices;
    double depth = 1.0;
    for (std::size_t a = 0; a < 3; ++a) {
      if (flow.grid().axis[a].present) continue;
      double low = x[a], high = x[a];
      for (std::size_t v = a; v < x.size(); v += 3) {
        low = std::min(low, x[v]);
        high = std::max(high, x[v]);
      }
      depth *= high - low;
    }
    depth_.push_back(depth);
  }
}

double WallBalance::volume_rate(std::span<const BodyLoad> loads) const {
  double rate = 0.0;
  for (std::size_t b = 0; b < loads.size(); ++b) rate += loads[b].volume_rate / depth_[b];
  return rate;
}

/// Mass through one line of an open face across axis a per second, positive inward; b varies along
/// it.
double WallBalance::inflow_through(std::size_t a, int side, std::size_t b,
                                   std::array<int, 3> at) const {
  const Grid& grid = flow_.grid();
  const FieldsView<const Real> W = flow_.primitives();
  const NodeBox own = flow_.owned();
  const int last = side == 0 ? 0 : grid.axis[a].n - 1, out = side == 0 ? -1 : 1;
  double sum = 0.0;
  for (at[b] = own.lo[b]; at[b] < own.hi[b]; ++at[b]) {
    at[a] = last;
    if (bodies_.tags()[place_of(grid, at[0], at[1], at[2])] != tag_fluid) continue;
    const auto flux = [&](int i) {
      at[a] = i;
      return W(prim_rho, at[0], at[1], at[2]) *
             W(static_cast<int>(prim_u + a), at[0], at[1], at[2]);
    };
    const double face =
        (7.0 * (flux(last) + flux(last + out)) - flux(last - out) - flux(last + 2 * out)) / 12.0;
    sum -= out * face * grid.axis[b].h(at[b]);
  }
  return sum;
}

/// Mass through open faces per second, positive inward: rho u_n at the face to 4th order.
double WallBalance::inflow() const {
  const Grid& grid = flow_.grid();
  const NodeBox own = flow_.owned();
  double sum = 0.0;
  for (std::size_t a = 0; a < 3; ++a) {
    if (!grid.axis[a].present) continue;
    const std::size_t b = a == 0 ? 1 : 0, c = a == 2 ? 1 : 2;
    for (int side = 0; side < 2; ++side) {
      if (!is_open(flow_.boundaries()[2 * a + static_cast<std::size_t>(side)].kind)) continue;
      if (side == 0 ? own.lo[a] > 0 : own.hi[a] < grid.axis[a].n) continue;  // another rank's face
      std::vector<double> line(static_cast<std::size_t>(own.hi[c] - own.lo[c]));
#pragma omp parallel for schedule(static)
      for (int m = own.lo[c]; m < own.hi[c]; ++m) {
        std::array<int, 3> at{};
        at[c] = m;
        line[static_cast<std::size_t>(m - own.lo[c])] =
            grid.axis[c].h(m) * inflow_through(a, side, b, at);
      }
      for (const double part : line) sum += part;  // in order: the same with any number of threads
    }
  }
  return ranks_.sum_of_all(sum);
}

void WallBalance::measure(const Totals& totals) {
  const WallCells cells = bodies_.wall_cells(flow_.primitives());
  const double counted = totals.volume + cells.volume;
  if (volume_ == 0.0) volume_ = counted;
  mass_ = (totals.mass + cells.mass) / counted * volume_;
}

void WallBalance::start(const Totals& totals, std::span<const BodyLoad> loads) {
  measure(totals);
  first_mass_ = mass_;
  inflow_ = inflow();
  volume_rate_ = volume_rate(loads);
  for (std::size_t b = 0; b < loads.size(); ++b) force_[b] = loads[b].force;
}

void WallBalance::add(double dt, const Totals& totals, std::span<const BodyLoad> loads) {
  const double rate = volume_rate(loads);
  volume_ -= 0.5 * dt * (volume_rate_ + rate);
  volume_rate_ = rate;
  measure(totals);
  const double now = inflow();
  brought_ += 0.5 * dt * (inflow_ + now);
  inflow_ = now;
  largest_leak_ = std::max(largest_leak_, std::abs(leaked_mass()));
  for (std::size_t b = 0; b < loads.size(); ++b) {
    for (std::size_t a = 0; a < 3; ++a)
      impulse_[b][a] += 0.5 * dt * (force_[b][a] + loads[b].force[a]);
    force_[b] = loads[b].force;
  }
}

double WallBalance::leaked_mass() const {
  return mass_ - first_mass_ - brought_;
}

std::vector<double> WallBalance::save() const {
  std::vector<double> saved = {volume_, volume_rate_, mass_,        first_mass_,
                               inflow_, brought_,     largest_leak_};
  for (std::size_t b = 0; b < impulse_.size(); ++b) {
    saved.insert(saved.end(), impulse_[b].begin(), impulse_[b].end());
    saved.insert(saved.end(), force_[b].begin(), force_[b].end());
  }
  return saved;
}

void WallBalance::restore(std::span<const double>& saved) {
  const std::size_t size = 7 + 6 * impulse_.size();
  if (saved.size() < size) throw CaseError("checkpoint: the bodies do not fit this case");
  std::size_t i = 0;
  for (double* x :
       {&volume_, &volume_rate_, &mass_, &first_mass_, &inflow_, &brought_, &largest_leak_})
    *x = saved[i++];
  for (std::size_t b = 0; b < impulse_.size(); ++b) {
    for (double& x : impulse_[b]) x = saved[i++];
    for (double& x : force_[b]) x = saved[i++];
  }
  saved = saved.subspan(size);
}

}  // namespace ocublast::flow
