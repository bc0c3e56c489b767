// The state of the flow: set, summed, kept and restored.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "coupler/base/errors.hpp"
#include "flow_solver/flow_core.hpp"

namespace ocublast::flow::inline OCU_PRECISION {

void Flow::Core::store_state(int i, int j, int k, const State& s) {
  const Gas& gas = options.gas;
  const double value[5] = {s.rho, s.u, s.v, s.w, s.p / (s.rho * gas.gas_constant)};
  const double conserved[5] = {
      s.rho, s.rho * s.u, s.rho * s.v, s.rho * s.w,
      s.p / (gas.heat_capacity_ratio - 1.0) + 0.5 * s.rho * (s.u * s.u + s.v * s.v + s.w * s.w)};
  for (int f = 0; f < n_primitive; ++f) {
    ctx.W.data[f * ctx.W.sf + i + j * ctx.W.sj + k * ctx.W.sk] = static_cast<Real>(value[f]);
    // Both buffers: outside the active box they are never exchanged for new values.
    ctx.Q.data[f * ctx.Q.sf + i + j * ctx.Q.sj + k * ctx.Q.sk] = static_cast<Real>(conserved[f]);
    ctx.A.data[f * ctx.A.sf + i + j * ctx.A.sj + k * ctx.A.sk] = static_cast<Real>(conserved[f]);
  }
}

/// Lanes behind the last node compute with copies of it and are never used.
void Flow::Core::fill_padding() {
  const int n = ctx.n[0], end = ctx.tiles * tile_width;
  for (int k = 0; k < ctx.n[2]; ++k) {
    for (int j = 0; j < ctx.n[1]; ++j) {
      for (int f = 0; f < n_primitive; ++f) {
        Real* q = ctx.Q.data + f * ctx.Q.sf + j * ctx.Q.sj + k * ctx.Q.sk;
        Real* w = ctx.W.data + f * ctx.W.sf + j * ctx.W.sj + k * ctx.W.sk;
        for (int i = n; i < end; ++i) {
          q[i] = q[n - 1];
          w[i] = w[n - 1];
        }
      }
    }
  }
}

void Flow::set_state(const std::function<State(double, double, double)>& state) {
  const Grid& g = grid();
  set_state_by_index(
      [&](int i, int j, int k) { return state(g.axis[0].x(i), g.axis[1].x(j), g.axis[2].x(k)); });
}

void Flow::set_state_by_index(const std::function<State(int, int, int)>& state) {
  Core& c = *core_;
  const NodeBox own = owned();
  const auto set_all = [&] {
    for (int k = 0; k < c.ctx.n[2]; ++k) {
      for (int j = 0; j < c.ctx.n[1]; ++j) {
        for (int i = 0; i < c.ctx.n[0]; ++i) {
          const State s = state(i + own.lo[0], j + own.lo[1], k + own.lo[2]);
          if (!(s.rho > 0.0) || !(s.p > 0.0)) {
            throw CaseError(fmt::format(
                "initial state: density {} kg/m^3, pressure {} Pa at ({}, {}, {}) m; "
                "both must be above 0",
                s.rho, s.p, c.grid.axis[0].x(i), c.grid.axis[1].x(j), c.grid.axis[2].x(k)));
          }
          c.store_state(i, j, k, s);
        }
      }
    }
  };
  if (c.ranks)
    c.ranks->ranks().together(set_all);
  else
    set_all();
  c.fill_padding();
  c.prepared = false;
  c.set_box({0, 0, 0}, {c.ctx.n[0], c.ctx.n[1], c.ctx.n[2]});
  c.fill_ghosts();
  c.find_box();
}

void Flow::set_incoming(const std::shared_ptr<const IncomingGas>& gas) {
  if (core_->options.active_box) {
    throw CaseError("flow.numerics.skip_quiescent: must be false where waves come in from outside");
  }
  for (Boundary& b : core_->boundaries) {
    if (b.kind == BoundaryKind::outflow) b.incoming = gas;
  }
  core_->prepared = core_->ghosts_filled = false;
}

void Flow::fill_domain_ghosts() {
  core_->fill_ghosts();
}

Totals Flow::totals() const {
  const Core& c = *core_;
  const Context& x = c.ctx;
  std::vector<double> width(static_cast<std::size_t>(x.tiles) * tile_width, 0.0);
  for (int i = 0; i < x.n[0]; ++i)
    width[static_cast<std::size_t>(i)] = c.grid.axis[0].h(i) * c.grid.radial_weight(i);
  std::vector<std::array<double, 6>> plane(static_cast<std::size_t>(x.n[2]),
                                           std::array<double, 6>{});
#pragma omp parallel for schedule(static) num_threads(c.options.threads)
  for (int k = 0; k < x.n[2]; ++k) {
    for (int j = 0; j < x.n[1]; ++j) {
      double lane[6][tile_width] = {};  // sums by lane: vectors without a change of order
      for (int t = 0; t < x.tiles; ++t) {
        const unsigned bits = c.fluid[static_cast<std::size_t>((k * x.n[1] + j) * x.tiles + t)];
        if (bits == 0) continue;
        double w[tile_width];
        for (int l = 0; l < tile_width; ++l) {
          w[l] =
              ((bits >> l) & 1u) != 0 ? width[static_cast<std::size_t>(t * tile_width + l)] : 0.0;
        }
        const Real* q = x.Q.data + t * tile_width + j * x.Q.sj + k * x.Q.sk;
        for (int f = 0; f < 5; ++f) {
          for (int l = 0; l < tile_width; ++l) lane[f][l] += w[l] * q[f * x.Q.sf + l];
        }
        for (int l = 0; l < tile_width; ++l) lane[5][l] += w[l];
      }
      const double area = c.grid.axis[1].h(j) * c.grid.axis[2].h(k);
      for (std::size_t f = 0; f < 6; ++f) {
        double row = 0.0;
        for (const double part : lane[f]) row += part;
        plane[static_cast<std::size_t>(k)][f] += area * row;
      }
    }
  }
  std::array<double, 6> sum{};
  for (const auto& p : plane) {
    for (std::size_t f = 0; f < 6; ++f) sum[f] += p[f];
  }
  if (c.ranks) c.ranks->ranks().sum_of_all(sum);
  return {.volume = sum[5], .mass = sum[0], .momentum = {sum[1], sum[2], sum[3]}, .energy = sum[4]};
}

std::vector<CheckpointPart> Flow::checkpoint() {
  Core& c = *core_;
  c.mark_copy.assign(c.mark.begin(), c.mark.end());
  c.box_copy = {static_cast<Real>(c.lo[0]), static_cast<Real>(c.lo[1]), static_cast<Real>(c.lo[2]),
                static_cast<Real>(c.hi[0]), static_cast<Real>(c.hi[1]), static_cast<Real>(c.hi[2])};
  return {{"primitives", c.W.all()},
          {"conserved", c.Q.all()},
          {"marks", c.mark_copy},
          {"active_box", c.box_copy}};
}

std::uint8_t Flow::mark(int i, int j, int k) const {
  const NodeBox own = owned();
  return core_->mark[core_->mark_index(i - own.lo[0], j - own.lo[1], k - own.lo[2])];
}

void Flow::set_mark(int i, int j, int k, std::uint8_t mark) {
  const NodeBox own = owned();
  core_->mark[core_->mark_index(i - own.lo[0], j - own.lo[1], k - own.lo[2])] = mark;
}

std::array<int, 6> Flow::active_box() const {
  const Core& c = *core_;
  if (c.ranks) {
    const auto& axis = c.ranks->part.whole.axis;
    return {0, 0, 0, axis[0].n, axis[1].n, axis[2].n};
  }
  return {c.lo[0], c.lo[1], c.lo[2], c.hi[0], c.hi[1], c.hi[2]};
}

void Flow::restored_nodes(const std::array<int, 6>& active_box) {
  Core& c = *core_;
  c.fill_padding();
  c.mark_copy.assign(c.mark.begin(), c.mark.end());
  const bool part = c.options.active_box;
  c.box_copy.clear();
  for (std::size_t a = 0; a < 6; ++a) {
    const int whole = a < 3 ? 0 : c.ctx.n[a - 3];
    c.box_copy.push_back(static_cast<Real>(part ? active_box[a] : whole));
  }
  restored();
}

void Flow::restored() {
  Core& c = *core_;
  for (std::size_t i = 0; i < c.mark.size(); ++i)
    c.mark[i] = static_cast<std::uint8_t>(c.mark_copy[i]);
  c.prepared = c.ghosts_filled = false;
  c.ctx.any_mark = true;
  c.set_line_marks();
  // The other buffer must hold the same gas outside the active box.
  const Block &q = c.ctx.Q, &a = c.ctx.A;
  for (int k = 0; k < c.ctx.n[2]; ++k) {
    for (int j = 0; j < c.ctx.n[1]; ++j) {
      std::copy_n(q.data + j * q.sj + k * q.sk, q.sj - tile_width, a.data + j * a.sj + k * a.sk);
    }
  }
  if (c.bodies) c.take_topology(false);
  const auto at = [&](std::size_t m) { return static_cast<int>(c.box_copy[m]); };
  c.set_box({at(0), at(1), at(2)}, {at(3), at(4), at(5)});
}

std::span<const double> Flow::pass_seconds() const {
  return core_->clock.seconds;
}

std::span<const std::uint8_t> Flow::marks() const {
  return core_->mark;
}

}  // namespace ocublast::flow
