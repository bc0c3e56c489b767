#include "flow_solver/boundary/domain_ghosts.hpp"

#include <cmath>

#include "flow_solver/grid/fields.hpp"

namespace ocublast::flow {
namespace {

NodeState far_state(const Gas& gas, const State& s) {
  return {.rho = s.rho, .u = {s.u, s.v, s.w}, .T = s.p / (s.rho * gas.gas_constant)};
}

/// Node that a ghost layer copies: mirrored, periodic, or the last one.
int source_of(BoundaryKind kind, bool low, int layer, int n) {
  switch (kind) {
    case BoundaryKind::symmetry:
    case BoundaryKind::no_slip_wall: return low ? layer : n - 1 - layer;
    case BoundaryKind::periodic: return low ? n - 1 - layer : layer;
    case BoundaryKind::outflow:
    case BoundaryKind::fixed_state: break;
  }
  return low ? 0 : n - 1;
}

double sign_of(BoundaryKind kind, int field, int axis) {
  if (field < prim_u || field > prim_w) return 1.0;
  if (kind == BoundaryKind::no_slip_wall) return -1.0;
  return kind == BoundaryKind::symmetry && field == prim_u + axis ? -1.0 : 1.0;
}

/// One end of one line (stride along the axis), for `count` neighbouring lines (unit stride).
struct EndOfLines {
  const Boundary* boundary;
  const Gas* gas;
  NodeState far;
  int axis;
  bool low;
  int n;
};

void fill_end(const EndOfLines& end, double* node0, std::ptrdiff_t sf, std::ptrdiff_t stride, int count) {
  const BoundaryKind kind = end.boundary->kind;
  const auto ghost = [&](int layer) { return (end.low ? -1 - layer : end.n + layer) * stride; };
  if (kind == BoundaryKind::outflow || kind == BoundaryKind::fixed_state) {
    const std::ptrdiff_t last = (end.low ? 0 : end.n - 1) * stride;
    for (int i = 0; i < count; ++i) {
      NodeState s = end.far;
      if (kind == BoundaryKind::outflow) {
        const double* at = node0 + last + i;
        s = characteristic_state(*end.gas, {at[0], {at[sf], at[2 * sf], at[3 * sf]}, at[4 * sf]}, end.far,
                                 end.axis, end.low ? -1.0 : 1.0);
      }
      const double value[5] = {s.rho, s.u[0], s.u[1], s.u[2], s.T};
      for (int layer = 0; layer < n_ghost; ++layer) {
        for (int f = 0; f < n_primitive; ++f) node0[f * sf + ghost(layer) + i] = value[f];
      }
    }
    return;
  }
  for (int f = 0; f < n_primitive; ++f) {
    const double sign = sign_of(kind, f, end.axis);
    for (int layer = 0; layer < n_ghost; ++layer) {
      const double* from = node0 + f * sf + source_of(kind, end.low, layer, end.n) * stride;
      double* to = node0 + f * sf + ghost(layer);
      for (int i = 0; i < count; ++i) to[i] = sign * from[i];
    }
  }
}

/// Calls fill(axis, node 0 of the first line, stride, number of neighbouring lines) for all lines
/// beside the box: x-lines, then rows with their x ghosts, then planes with both.
template <class Fill>
void fill_all_ends(const Grid& grid, const NodeBox& box, double* data, const Block& b, int threads,
                   const Fill& fill) {
  const int first = box.lo[0] - n_ghost;
  const int width = box.hi[0] - box.lo[0] + 2 * n_ghost;
#pragma omp parallel for schedule(static) num_threads(threads)
  for (int k = box.lo[2]; k < box.hi[2]; ++k) {
    for (int j = box.lo[1]; j < box.hi[1]; ++j) fill(0, data + j * b.sj + k * b.sk, 1, 1);
    if (grid.axis[1].present) fill(1, data + first + k * b.sk, b.sj, width);
  }
  if (!grid.axis[2].present) return;
  const int g1 = grid.axis[1].ghosts();
#pragma omp parallel for schedule(static) num_threads(threads)
  for (int j = box.lo[1] - g1; j < box.hi[1] + g1; ++j) fill(2, data + first + j * b.sj, b.sk, width);
}

}  // namespace

NodeState characteristic_state(const Gas& gas, const NodeState& s, const NodeState& far, int axis,
                               double sign) {
  if (s.T == far.T && s.rho == far.rho && s.u[0] == far.u[0] && s.u[1] == far.u[1] &&
      s.u[2] == far.u[2])
    return far;  // undisturbed
  const double gamma = gas.heat_capacity_ratio;
  const double c = sound_speed(gas, s.T), c_far = sound_speed(gas, far.T);
  const double un = sign * s.u[axis], un_far = sign * far.u[axis];
  if (un >= c) return s;
  if (un <= -c) return far;
  const double outgoing = un + 2.0 * c / (gamma - 1.0);
  const double incoming = un_far - 2.0 * c_far / (gamma - 1.0);
  const double un_b = 0.5 * (outgoing + incoming);
  const double c_b = 0.25 * (gamma - 1.0) * (outgoing - incoming);
  if (!(c_b > 0.0)) return s;
  const NodeState& donor = un_b > 0.0 ? s : far;
  NodeState b = donor;
  b.u[axis] = sign * un_b;
  b.T = c_b * c_b / (gamma * gas.gas_constant);
  const double ratio = b.T / donor.T;
  // Isentropic: rho ~ T^(1/(gamma-1)); for gamma = 1.4 the power is 5/2, without a call to pow.
  const bool diatomic = std::abs(gamma - 1.4) < 1e-12;
  b.rho = donor.rho * (diatomic ? ratio * ratio * std::sqrt(ratio) : std::pow(ratio, 1.0 / (gamma - 1.0)));
  return b;
}

void fill_primitive_ghosts(const Grid& grid, const Boundaries& boundaries, const Gas& gas,
                           const NodeBox& box, const Block& W, int threads) {
  const auto fill = [&](int axis, double* node0, std::ptrdiff_t stride, int count) {
    const int n = grid.axis[static_cast<std::size_t>(axis)].n;
    for (int side = 0; side < 2; ++side) {
      if (side == 0 ? box.lo[axis] > 0 : box.hi[axis] < n) continue;
      const Boundary& b = boundaries[static_cast<std::size_t>(2 * axis + side)];
      fill_end({&b, &gas, far_state(gas, b.state), axis, side == 0, n}, node0, W.sf, stride, count);
    }
  };
  fill_all_ends(grid, box, W.data, W, threads, fill);
}

void fill_scalar_ghosts(const Grid& grid, const Boundaries& boundaries, const NodeBox& box,
                        const Block& block, int field, int threads) {
  const auto fill = [&](int axis, double* node0, std::ptrdiff_t stride, int count) {
    const int n = grid.axis[static_cast<std::size_t>(axis)].n;
    for (int side = 0; side < 2; ++side) {
      if (side == 0 ? box.lo[axis] > 0 : box.hi[axis] < n) continue;
      const BoundaryKind kind = boundaries[static_cast<std::size_t>(2 * axis + side)].kind;
      for (int layer = 0; layer < n_ghost; ++layer) {
        const double* from = node0 + source_of(kind, side == 0, layer, n) * stride;
        double* to = node0 + (side == 0 ? -1 - layer : n + layer) * stride;
        for (int i = 0; i < count; ++i) to[i] = from[i];
      }
    }
  };
  fill_all_ends(grid, box, block.data + field * block.sf, block, threads, fill);
}

}  // namespace ocublast::flow
