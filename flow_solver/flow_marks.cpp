// Nodes with first-order fluxes: premarked where the pressure jumps from node to node, marked where
// the positivity test failed.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "coupler/base/errors.hpp"
#include "flow_solver/flow_core.hpp"

namespace ocublast::flow::inline OCU_PRECISION {
namespace {

// Steps that a mark lives: one for a premark, three after a failure (shorter ones fail again).
constexpr std::uint8_t premark_life = 1;
constexpr std::uint8_t failure_life = 3;
// Value of `failed` at a node that marks its neighbours too.
constexpr std::uint8_t spreads = 2;

}  // namespace

void Flow::Core::age_marks() {
  if (!ctx.any_mark) return;
  for (std::uint8_t& m : mark) m = m > 0 ? static_cast<std::uint8_t>(m - 1) : m;
}

/// Gas that strikes a wall as fast as this part of its sound speed within one node is an unresolved
/// impact. The ghost of a wall just behind that node is almost at rest, and a shock standing in
/// front of it with the stream vanishing in the wall solves the central fluxes too; the first-order
/// flux from the node's mirrored state lets nothing through.
constexpr double impact_mach = 0.7;

void Flow::Core::premark_impacts() {
  if (!bodies) return;
  for (int k = lo[2]; k < hi[2]; ++k) {
    for (const WallNode& node : wall_nodes[static_cast<std::size_t>(k)]) {
      if (node.i < lo[0] || node.i >= hi[0] || node.j < lo[1] || node.j >= hi[1]) continue;
      const Real* w = ctx.W.data + node.i + node.j * ctx.W.sj + k * ctx.W.sk;
      const Real* wall = ctx.wall_motion[node.axis] + 6 * node.wall;
      double normal[3] = {wall[0], wall[1], wall[2]};
      // A wall without slip gives no normal: its line's direction serves.
      if (normal[0] == 0.0 && normal[1] == 0.0 && normal[2] == 0.0) normal[node.axis] = -node.side;
      double away = 0.0;
      for (int a = 0; a < 3; ++a) away += normal[a] * (w[(prim_u + a) * ctx.W.sf] - wall[3 + a]);
      const double c = sound_speed(options.gas, w[prim_T * ctx.W.sf]);
      if (-away < impact_mach * c) continue;
      std::uint8_t& m = mark[mark_index(node.i, node.j, k)];
      m = std::max(m, premark_life);
      ctx.any_mark = true;
    }
  }
}

/// Does the pressure jump from this node to a neighbour that no wall hides? The stricter ratio of a
/// fresh charge holds at the charge's own jump only, where the lower side is below p_max by the
/// ratio that makes it fresh: a strong shock reflected elsewhere must not flip between the two
/// schemes.
bool Flow::Core::jumps(int i, int j, int k) const {
  const Block& block = ctx.W;
  const double gas_constant = options.gas.gas_constant;
  const Real* w = block.data + i + j * block.sj + k * block.sk;
  const double p = w[0] * gas_constant * w[prim_T * block.sf];
  const unsigned walls = wall_sides.empty() ? 0u : wall_sides[mark_index(i, j, k)];
  const std::ptrdiff_t stride[3] = {1, block.sj, block.sk};
  for (int a = 0; a < 3; ++a) {
    if (!ctx.present[a]) continue;
    for (int side = -1; side <= 1; side += 2) {
      if ((walls >> (2 * a + (side > 0 ? 1 : 0)) & 1u) != 0) continue;
      const Real* at = w + side * stride[a];
      const double other = at[0] * gas_constant * at[prim_T * block.sf];
      const double low = std::min(p, other), high = std::max(p, other);
      if (high > options.premark_ratio * low) return true;
      if (high > options.premark_ratio_fresh * low && p_max > fresh_ratio * low) return true;
    }
  }
  return false;
}

void Flow::Core::premark(StepReport&) {
  const double ratio = fresh_charge() ? options.premark_ratio_fresh : options.premark_ratio;
  premark_impacts();
  long count = 0;
  if (p_max > ratio * p_min) {
#pragma omp parallel for schedule(static) num_threads(options.threads) reduction(+ : count)
    for (int k = 0; k < box.n[2]; ++k) count += kernels->premark_plane(box, k, ratio);
  }
  if (count > 0) {
    const int row = ctx.tiles * tile_width;
    for (std::size_t i = 0; i < mark.size(); ++i) {
      if (failed[i] == 0) continue;
      failed[i] = 0;
      const int at = static_cast<int>(i % static_cast<std::size_t>(row));
      const int line = static_cast<int>(i / static_cast<std::size_t>(row));
      if (jumps(at, line % ctx.n[1], line / ctx.n[1])) mark[i] = std::max(mark[i], premark_life);
    }
    ctx.any_mark = true;
  }
  if (ranks ? any_rank_has(ctx.any_mark ? 1 : 0) : ctx.any_mark) set_line_marks();
}

void Flow::Core::mark_failures(bool with_neighbours) {
  const int n0 = ctx.n[0], n1 = ctx.n[1], n2 = ctx.n[2];
  const std::ptrdiff_t row = static_cast<std::ptrdiff_t>(ctx.tiles) * tile_width;
  const auto at = [&](int i, int j, int k) {
    return static_cast<std::size_t>((k * n1 + j) * row + i);
  };
  // A node that fails although marked suffers from its neighbours' fluxes. Which nodes spread is
  // settled before any mark is set: it must not depend on the order of nodes or blocks.
  for (std::size_t m = 0; m < failed.size(); ++m) {
    if (failed[m] != 0 && (with_neighbours || mark[m] != 0)) failed[m] = spreads;
  }
  for (int k = 0; k < n2; ++k) {
    for (int j = 0; j < n1; ++j) {
      for (int i = 0; i < n0; ++i) {
        if (failed[at(i, j, k)] == 0) continue;
        mark[at(i, j, k)] = failure_life;
        if (failed[at(i, j, k)] != spreads) continue;
        for (int axis = 0; axis < 3; ++axis) {
          for (int side = -1; side <= 1; side += 2) {
            const int x[3] = {i + (axis == 0 ? side : 0), j + (axis == 1 ? side : 0),
                              k + (axis == 2 ? side : 0)};
            if (x[0] < 0 || x[1] < 0 || x[2] < 0 || x[0] >= n0 || x[1] >= n1 || x[2] >= n2)
              continue;
            mark[at(x[0], x[1], x[2])] = failure_life;
          }
        }
      }
    }
  }
  if (ranks) mark_beyond_borders();
  std::fill(failed.begin(), failed.end(), std::uint8_t{0});
  ctx.any_mark = true;
  set_line_marks();
}

/// Border nodes whose neighbours on other ranks failed and spread.
void Flow::Core::mark_beyond_borders() {
  const RankFlow::EndBits& bits = ranks->exchange_bits(
      [&](int i, int j, int k) { return failed[mark_index(i, j, k)] == spreads; });
  for (int axis = 0; axis < 3; ++axis) {
    const int b_axis = axis == 0 ? 1 : 0, c_axis = axis == 2 ? 1 : 2;
    const int groups = (ctx.n[b_axis] + tile_width - 1) / tile_width;
    for (int side = 0; side < 2; ++side) {
      const auto& of_end = bits[static_cast<std::size_t>(axis)][static_cast<std::size_t>(side)];
      int at[3] = {};
      at[axis] = side == 0 ? 0 : ctx.n[axis] - 1;
      for (std::size_t g = 0; g < of_end.size(); ++g) {
        for (int l = 0; l < tile_width; ++l) {
          if (((of_end[g] >> l) & 1u) == 0) continue;
          at[b_axis] = static_cast<int>(g) % groups * tile_width + l;
          at[c_axis] = static_cast<int>(g) / groups;
          mark[mark_index(at[0], at[1], at[2])] = failure_life;
        }
      }
    }
  }
}

void Flow::Core::set_line_marks() {
  for (auto& flags : line_marked) std::fill(flags.begin(), flags.end(), LaneBits{0});
  ctx.any_mark = false;
  const int n0 = ctx.n[0], n1 = ctx.n[1], n2 = ctx.n[2];
  const std::uint8_t* m = mark.data();
  for (int k = 0; k < n2; ++k) {
    for (int j = 0; j < n1; ++j, m += ctx.tiles * tile_width) {
      if (std::none_of(m, m + n0, [](std::uint8_t b) { return b != 0; })) continue;
      ctx.any_mark = true;
      line_marked[0][static_cast<std::size_t>(k * ctx.row_groups + j / tile_width)] |=
          static_cast<LaneBits>(1 << (j % tile_width));
      for (int i = 0; i < n0; ++i) {
        if (m[i] == 0) continue;
        const auto bit = static_cast<LaneBits>(1 << (i % tile_width));
        line_marked[1][static_cast<std::size_t>(k * ctx.tiles + i / tile_width)] |= bit;
        line_marked[2][static_cast<std::size_t>(j * ctx.tiles + i / tile_width)] |= bit;
      }
    }
  }
  if (ranks) share_marks();
}

std::size_t Flow::Core::count_marks() const {
  if (!ctx.any_mark) return 0;
  return static_cast<std::size_t>(
      std::count_if(mark.begin(), mark.end(), [](std::uint8_t m) { return m != 0; }));
}

void Flow::Core::restore() {
#pragma omp parallel for schedule(static) num_threads(options.threads)
  for (int k = 0; k < box.n[2]; ++k) kernels->restore_plane(box, k);
}

/// Last resort with floors: a failed node keeps its state of the step's start, lifted to the
/// floors.
std::size_t Flow::Core::repair_failures(bool final_state) {
  std::size_t count = 0;
  const double gamma = options.gas.heat_capacity_ratio;
  for (int k = 0; k < ctx.n[2]; ++k) {
    for (int j = 0; j < ctx.n[1]; ++j) {
      for (int i = 0; i < ctx.n[0]; ++i) {
        std::uint8_t& f =
            failed[static_cast<std::size_t>((k * ctx.n[1] + j) * ctx.tiles * tile_width + i)];
        if (f == 0) continue;
        f = 0;
        ++count;
        double q[5];
        for (int v = 0; v < 5; ++v)
          q[v] = ctx.Q.data[v * ctx.Q.sf + i + j * ctx.Q.sj + k * ctx.Q.sk];
        const double rho = std::max(q[0], options.floor_density);
        const double u[3] = {q[1] / q[0], q[2] / q[0], q[3] / q[0]};
        const double kinetic = 0.5 * (u[0] * u[0] + u[1] * u[1] + u[2] * u[2]);
        const double p = std::max((gamma - 1.0) * (q[4] - q[0] * kinetic), options.floor_pressure);
        const double w[5] = {rho, u[0], u[1], u[2], p / (rho * options.gas.gas_constant)};
        const double lifted[5] = {rho, rho * u[0], rho * u[1], rho * u[2],
                                  p / (gamma - 1.0) + rho * kinetic};
        for (int v = 0; v < 5; ++v) {
          ctx.W.data[v * ctx.W.sf + i + j * ctx.W.sj + k * ctx.W.sk] = static_cast<Real>(w[v]);
          if (final_state)
            ctx.A.data[v * ctx.A.sf + i + j * ctx.A.sj + k * ctx.A.sk] =
                static_cast<Real>(lifted[v]);
        }
      }
    }
  }
  return count;
}

void Flow::Core::throw_failure(double t, double dt) const {
  if (ranks) {
    ranks->ranks().together(
        [&] { throw_own_failure(t, dt); });  // throws: some rank has failed nodes
  }
  throw_own_failure(t, dt);
  throw NumericsError("flow: a step fails without a failed node");
}

void Flow::Core::throw_own_failure(double t, double dt) const {
  const auto bad =
      std::find_if(failed.begin(), failed.end(), [](std::uint8_t f) { return f != 0; });
  if (bad == failed.end()) return;
  const auto at = static_cast<std::ptrdiff_t>(bad - failed.begin());
  const std::ptrdiff_t row = static_cast<std::ptrdiff_t>(ctx.tiles) * tile_width;
  const int i = static_cast<int>(at % row), j = static_cast<int>(at / row % ctx.n[1]),
            k = static_cast<int>(at / row / ctx.n[1]);
  double q[5];
  for (int v = 0; v < 5; ++v) q[v] = ctx.Q.data[v * ctx.Q.sf + i + j * ctx.Q.sj + k * ctx.Q.sk];
  const double p = (options.gas.heat_capacity_ratio - 1.0) *
                   (q[4] - 0.5 * (q[1] * q[1] + q[2] * q[2] + q[3] * q[3]) / q[0]);
  const std::array<int, 3> first = ranks ? ranks->part.begin : std::array<int, 3>{};
  throw NumericsError(fmt::format(
      "flow: the step from t = {:.9e} s by {:.3e} s fails at cell ({}, {}, {}), position ({:.6g}, "
      "{:.6g}, {:.6g}) m, "
      "also with first-order fluxes there; state before: density {:.6g} kg/m^3, velocity ({:.6g}, "
      "{:.6g}, "
      "{:.6g}) m/s, pressure {:.6g} Pa. Try a smaller flow.cfl, a finer grid at the charge, or "
      "floors",
      t, dt, i + first[0], j + first[1], k + first[2], grid.axis[0].x(i), grid.axis[1].x(j),
      grid.axis[2].x(k), q[0], q[1] / q[0], q[2] / q[0], q[3] / q[0], p));
}

}  // namespace ocublast::flow
