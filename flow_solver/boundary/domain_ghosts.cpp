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

}  // namespace

NodeState characteristic_state(const Gas& gas, const NodeState& s, const NodeState& far, int axis,
                               double sign) {
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

void fill_primitive_ghosts(const Grid& grid, const Boundaries& boundaries, const Gas& gas, const Block& W,
                           int threads) {
  const auto end_of = [&](int axis, bool low) {
    const Boundary& b = boundaries[static_cast<std::size_t>(2 * axis + (low ? 0 : 1))];
    return EndOfLines{&b, &gas, far_state(gas, b.state), axis, low, grid.axis[static_cast<std::size_t>(axis)].n};
  };
  const int n0 = grid.axis[0].n, n1 = grid.axis[1].n, n2 = grid.axis[2].n;
  const int width = n0 + 2 * n_ghost;
  const EndOfLines xl = end_of(0, true), xh = end_of(0, false), yl = end_of(1, true), yh = end_of(1, false);
#pragma omp parallel for schedule(static) num_threads(threads)
  for (int k = 0; k < n2; ++k) {
    for (int j = 0; j < n1; ++j) {
      double* node0 = W.data + j * W.sj + k * W.sk;
      fill_end(xl, node0, W.sf, 1, 1);
      fill_end(xh, node0, W.sf, 1, 1);
    }
    if (!grid.axis[1].present) continue;
    double* row0 = W.data - n_ghost + k * W.sk;
    fill_end(yl, row0, W.sf, W.sj, width);
    fill_end(yh, row0, W.sf, W.sj, width);
  }
  if (!grid.axis[2].present) return;
  const EndOfLines zl = end_of(2, true), zh = end_of(2, false);
  const int g1 = grid.axis[1].ghosts();
#pragma omp parallel for schedule(static) num_threads(threads)
  for (int j = -g1; j < n1 + g1; ++j) {
    double* row0 = W.data - n_ghost + j * W.sj;
    fill_end(zl, row0, W.sf, W.sk, width);
    fill_end(zh, row0, W.sf, W.sk, width);
  }
}

void fill_scalar_ghosts(const Grid& grid, const Boundaries& boundaries, const Block& block, int field,
                        int threads) {
  const int n0 = grid.axis[0].n, n1 = grid.axis[1].n, n2 = grid.axis[2].n;
  const auto fill = [&](int axis, double* node0, std::ptrdiff_t stride, int count) {
    const int n = grid.axis[static_cast<std::size_t>(axis)].n;
    for (int side = 0; side < 2; ++side) {
      const BoundaryKind kind = boundaries[static_cast<std::size_t>(2 * axis + side)].kind;
      for (int layer = 0; layer < n_ghost; ++layer) {
        const double* from = node0 + source_of(kind, side == 0, layer, n) * stride;
        double* to = node0 + (side == 0 ? -1 - layer : n + layer) * stride;
        for (int i = 0; i < count; ++i) to[i] = from[i];
      }
    }
  };
  double* data = block.data + field * block.sf;
  const int width = n0 + 2 * n_ghost;
#pragma omp parallel for schedule(static) num_threads(threads)
  for (int k = 0; k < n2; ++k) {
    for (int j = 0; j < n1; ++j) fill(0, data + j * block.sj + k * block.sk, 1, 1);
    if (grid.axis[1].present) fill(1, data - n_ghost + k * block.sk, block.sj, width);
  }
  if (!grid.axis[2].present) return;
  const int g1 = grid.axis[1].ghosts();
#pragma omp parallel for schedule(static) num_threads(threads)
  for (int j = -g1; j < n1 + g1; ++j) fill(2, data - n_ghost + j * block.sj, block.sk, width);
}

}  // namespace ocublast::flow
