#include "flow_solver/boundary/domain_ghosts.hpp"

#include <algorithm>
#include <cmath>

#include "flow_solver/boundary/open_ends.hpp"
#include "flow_solver/grid/fields.hpp"

namespace ocublast::flow::inline OCU_PRECISION {
namespace {

// Quadratic through the wall's value and the first two nodes, at ghost layers 0 to 3 (half an index
// beyond the wall, one more each): weights of the wall and of the two nodes.
constexpr double wall_quadratic[n_ghost][3] = {{8.0 / 3.0, -2.0, 1.0 / 3.0},
                                               {8.0, -9.0, 2.0},
                                               {16.0, -20.0, 5.0},
                                               {80.0 / 3.0, -35.0, 28.0 / 3.0}};
// The quadratic may differ from the odd continuation about the wall's value by this share of the
// mirrored node's own difference: all of it in a resolved layer, a bound where a shock meets the
// wall.
constexpr double most_bending = 1.0;
// Ghost temperatures stay above this share of the wall's and of the mirrored node's.
constexpr double least_temperature = 0.25;

/// Node that a ghost layer copies: mirrored, periodic, or the last one.
int source_of(BoundaryKind kind, bool low, int layer, int n) {
  switch (kind) {
    case BoundaryKind::symmetry:
    case BoundaryKind::wall:
      return low ? layer : n - 1 - layer;
    case BoundaryKind::periodic:
      return low ? n - 1 - layer : layer;
    case BoundaryKind::outflow:
    case BoundaryKind::fixed_state:
    case BoundaryKind::subsonic_inflow:
    case BoundaryKind::reservoir:
    case BoundaryKind::neighbour:
      break;
  }
  return low ? 0 : n - 1;
}

bool is_open(BoundaryKind kind) {
  switch (kind) {
    case BoundaryKind::outflow:
    case BoundaryKind::fixed_state:
    case BoundaryKind::subsonic_inflow:
    case BoundaryKind::reservoir:
      return true;
    case BoundaryKind::symmetry:
    case BoundaryKind::wall:
    case BoundaryKind::periodic:
    case BoundaryKind::neighbour:
      break;
  }
  return false;
}

/// One end of one line (along the axis), for `count` neighbouring lines along x.
struct EndOfLines {
  const Grid* grid;
  const Boundary* boundary;
  const Gas* gas;
  double t;
  int axis;
  bool low;
  int node[3];  ///< indices of node 0 of the first line
};

/// Place of ghost `layer` of line i.
State incoming_at(const EndOfLines& end, int i, int layer) {
  double x[3];
  for (std::size_t a = 0; a < 3; ++a) {
    int at = end.node[a] + (a == 0 ? i : 0);
    if (static_cast<int>(a) == end.axis) at = end.low ? -1 - layer : end.grid->axis[a].n + layer;
    x[a] = end.grid->axis[a].x(at);
  }
  return end.boundary->incoming->at(end.t, x[0], x[1], x[2]);
}

NodeState open_state(const EndOfLines& end, const NodeState& node, const NodeState& far) {
  const double sign = end.low ? -1.0 : 1.0;
  switch (end.boundary->kind) {
    case BoundaryKind::outflow:
      return characteristic_state(*end.gas, node, far, end.axis, sign);
    case BoundaryKind::subsonic_inflow:
      return inflow_state(*end.gas, node, far, end.axis, sign);
    case BoundaryKind::reservoir:
      return reservoir_state(*end.gas, node, far, end.axis, sign);
    default:
      return far;
  }
}

void fill_open_end(const EndOfLines& end, Real* node0, std::ptrdiff_t sf, std::ptrdiff_t stride,
                   int count) {
  const int n = end.grid->axis[static_cast<std::size_t>(end.axis)].n;
  const std::ptrdiff_t last = (end.low ? 0 : n - 1) * stride;
  const NodeState constant = node_state(*end.gas, end.boundary->state);
  const bool varies = end.boundary->incoming != nullptr;
  for (int i = 0; i < count; ++i) {
    const Real* at = node0 + last + i;
    const NodeState node{at[0], {at[sf], at[2 * sf], at[3 * sf]}, at[4 * sf]};
    NodeState s = varies ? node : open_state(end, node, constant);
    for (int layer = 0; layer < n_ghost; ++layer) {
      if (varies) s = open_state(end, node, node_state(*end.gas, incoming_at(end, i, layer)));
      const double value[5] = {s.rho, s.u[0], s.u[1], s.u[2], s.T};
      Real* ghost = node0 + (end.low ? -1 - layer : n + layer) * stride + i;
      for (int f = 0; f < n_primitive; ++f) ghost[f * sf] = static_cast<Real>(value[f]);
    }
  }
}

/// Ghost value of a quantity that has the value `wall` at the wall: quadratic, limited.
double beyond_wall(double wall, double first, double second, double mirrored, int layer) {
  const double* q = wall_quadratic[layer];
  const double odd = 2.0 * wall - mirrored;
  const double bend = q[0] * wall + q[1] * first + q[2] * second - odd;
  const double most = most_bending * std::abs(mirrored - wall);
  return odd + std::clamp(bend, -most, most);
}

/// No-slip or isothermal wall: pressure even, temperature and tangential velocity through their
/// wall values, mass flux odd to round-off.
void fill_wall_end(const EndOfLines& end, Real* node0, std::ptrdiff_t sf, std::ptrdiff_t stride,
                   int count) {
  const int n = end.grid->axis[static_cast<std::size_t>(end.axis)].n;
  const Wall& wall = end.boundary->wall;
  const std::ptrdiff_t inwards = end.low ? stride : -stride;
  for (int i = 0; i < count; ++i) {
    Real* first = node0 + (end.low ? 0 : n - 1) * stride + i;
    for (int layer = 0; layer < n_ghost; ++layer) {
      const Real* from = first + layer * inwards;
      Real* to = first - (1 + layer) * inwards;
      const double T = from[4 * sf];
      double ghost_T = T;
      if (wall.temperature > 0.0) {
        ghost_T = std::max(
            beyond_wall(wall.temperature, first[4 * sf], first[4 * sf + inwards], T, layer),
            least_temperature * std::min(T, wall.temperature));
      }
      const double rho = from[0] * T / ghost_T;
      to[0] = static_cast<Real>(rho);
      to[4 * sf] = static_cast<Real>(ghost_T);
      for (int a = 0; a < 3; ++a) {
        const std::ptrdiff_t f = (prim_u + a) * sf;
        if (a == end.axis)
          to[f] = static_cast<Real>(-from[f] * (from[0] / rho));
        else if (wall.slip)
          to[f] = from[f];
        else
          to[f] = static_cast<Real>(beyond_wall(wall.velocity[static_cast<std::size_t>(a)],
                                                first[f], first[f + inwards], from[f], layer));
      }
    }
  }
}

void fill_end(const EndOfLines& end, Real* node0, std::ptrdiff_t sf, std::ptrdiff_t stride,
              int count) {
  const BoundaryKind kind = end.boundary->kind;
  if (is_open(kind)) return fill_open_end(end, node0, sf, stride, count);
  if (kind == BoundaryKind::wall) return fill_wall_end(end, node0, sf, stride, count);
  const int n = end.grid->axis[static_cast<std::size_t>(end.axis)].n;
  for (int f = 0; f < n_primitive; ++f) {
    const Real sign = kind == BoundaryKind::symmetry && f == prim_u + end.axis ? Real{-1} : Real{1};
    for (int layer = 0; layer < n_ghost; ++layer) {
      const Real* from = node0 + f * sf + source_of(kind, end.low, layer, n) * stride;
      Real* to = node0 + f * sf + (end.low ? -1 - layer : n + layer) * stride;
      for (int i = 0; i < count; ++i) to[i] = sign * from[i];
    }
  }
}

/// Calls fill(axis, node 0 of the first line, stride, number of neighbouring lines) for all lines
/// of one axis beside the box: x-lines, or rows with their x ghosts, or planes with both.
template <class Fill>
void fill_ends_of(int axis, const Grid& grid, const NodeBox& box, Real* data, const Block& b,
                  int threads, const Fill& fill) {
  if (!grid.axis[static_cast<std::size_t>(axis)].present) return;
  const int first = box.lo[0] - n_ghost;
  const int width = box.hi[0] - box.lo[0] + 2 * n_ghost;
  if (axis < 2) {
#pragma omp parallel for schedule(static) num_threads(threads)
    for (int k = box.lo[2]; k < box.hi[2]; ++k) {
      if (axis == 1)
        fill(1, data + first + k * b.sk, b.sj, width);
      else
        for (int j = box.lo[1]; j < box.hi[1]; ++j) fill(0, data + j * b.sj + k * b.sk, 1, 1);
    }
    return;
  }
  const int g1 = grid.axis[1].ghosts();
#pragma omp parallel for schedule(static) num_threads(threads)
  for (int j = box.lo[1] - g1; j < box.hi[1] + g1; ++j)
    fill(2, data + first + j * b.sj, b.sk, width);
}

}  // namespace

void DomainGhosts::fill(int axis, bool low, Real* node0, std::array<int, 3> node,
                        std::ptrdiff_t stride, int count) const {
  const auto a = static_cast<std::size_t>(axis);
  if (!grid_.axis[a].present || (low ? box_.lo[axis] > 0 : box_.hi[axis] < grid_.axis[a].n)) return;
  const Boundary& b = boundaries_[2 * a + (low ? 0 : 1)];
  if (b.kind == BoundaryKind::neighbour) return;
  if (axis > 0 && count >= tile_width) {
    if (const std::optional<OutflowEnd> end = outflow_end(axis, low)) {
      const int n = grid_.axis[a].n;
      return kernels_.outflow_rows(*end, node0 + (low ? 0 : n - 1) * stride, W_.sf,
                                   low ? -stride : stride, count);
    }
  }
  fill_end({&grid_, &b, &gas_, t_, axis, low, {node[0], node[1], node[2]}}, node0, W_.sf, stride,
           count);
}

std::optional<OutflowEnd> DomainGhosts::outflow_end(int axis, bool low) const {
  const Boundary& b = boundaries_[2 * static_cast<std::size_t>(axis) + (low ? 0 : 1)];
  const bool diatomic =
      std::abs(gas_.heat_capacity_ratio - 1.4) < 1e-12;  // no power in the kernels
  if (b.kind != BoundaryKind::outflow || b.incoming != nullptr || !diatomic) return std::nullopt;
  const NodeState far = node_state(gas_, b.state);
  return OutflowEnd{.axis = axis,
                    .sign = low ? -1.0 : 1.0,
                    .rho = far.rho,
                    .u = {far.u[0], far.u[1], far.u[2]},
                    .T = far.T,
                    .gamma = gas_.heat_capacity_ratio,
                    .gas_constant = gas_.gas_constant};
}

void DomainGhosts::fill_x(int k, int j0, int j1) const {
  for (const bool low : {true, false}) {
    if (low ? box_.lo[0] > 0 : box_.hi[0] < grid_.axis[0].n) continue;
    if (const std::optional<OutflowEnd> end = outflow_end(0, low)) {
      Real* node = W_.data + (low ? 0 : grid_.axis[0].n - 1) + j0 * W_.sj + k * W_.sk;
      kernels_.outflow_columns(*end, node, W_.sf, W_.sj, low ? -1 : 1, j1 - j0);
      continue;
    }
    for (int j = j0; j < j1; ++j) fill(0, low, W_.data + j * W_.sj + k * W_.sk, {0, j, k}, 1, 1);
  }
}

void DomainGhosts::fill_y(int k, bool low) const {
  const int first = box_.lo[0] - n_ghost, width = box_.hi[0] + n_ghost - first;
  fill(1, low, W_.data + first + k * W_.sk, {first, 0, k}, W_.sj, width);
}

void DomainGhosts::fill_z(int j) const {
  const int first = box_.lo[0] - n_ghost, width = box_.hi[0] + n_ghost - first;
  for (const bool low : {true, false})
    fill(2, low, W_.data + first + j * W_.sj, {first, j, 0}, W_.sk, width);
}

void DomainGhosts::fill_all(int threads) const {
#pragma omp parallel for schedule(static) num_threads(threads)
  for (int k = box_.lo[2]; k < box_.hi[2]; ++k) {
    fill_x(k, box_.lo[1], box_.hi[1]);
    for (const bool low : {true, false}) fill_y(k, low);
  }
  fill_axis(2, threads);
}

void DomainGhosts::fill_axis(int axis, int threads) const {
  if (!grid_.axis[static_cast<std::size_t>(axis)].present) return;
  if (axis == 2) {
    const int g1 = grid_.axis[1].ghosts();
#pragma omp parallel for schedule(static) num_threads(threads)
    for (int j = box_.lo[1] - g1; j < box_.hi[1] + g1; ++j) fill_z(j);
    return;
  }
#pragma omp parallel for schedule(static) num_threads(threads)
  for (int k = box_.lo[2]; k < box_.hi[2]; ++k) {
    if (axis == 0)
      fill_x(k, box_.lo[1], box_.hi[1]);
    else
      for (const bool low : {true, false}) fill_y(k, low);
  }
}

void DomainGhosts::fill_all_z(int threads) const {
  if (!grid_.axis[2].present) return;
#pragma omp parallel for schedule(static) num_threads(threads)
  for (int j = box_.lo[1]; j < box_.hi[1]; ++j) fill_z(j);
}

void fill_scalar_ghosts(const Grid& grid, const Boundaries& boundaries, const NodeBox& box,
                        const Block& block, int field, int axis_to_fill, int threads) {
  const auto fill = [&](int axis, Real* node0, std::ptrdiff_t stride, int count) {
    const int n = grid.axis[static_cast<std::size_t>(axis)].n;
    for (int side = 0; side < 2; ++side) {
      if (side == 0 ? box.lo[axis] > 0 : box.hi[axis] < n) continue;
      const BoundaryKind kind = boundaries[static_cast<std::size_t>(2 * axis + side)].kind;
      if (kind == BoundaryKind::neighbour) continue;
      for (int layer = 0; layer < n_ghost; ++layer) {
        const Real* from = node0 + source_of(kind, side == 0, layer, n) * stride;
        Real* to = node0 + (side == 0 ? -1 - layer : n + layer) * stride;
        for (int i = 0; i < count; ++i) to[i] = from[i];
      }
    }
  };
  fill_ends_of(axis_to_fill, grid, box, block.data + field * block.sf, block, threads, fill);
}

}  // namespace ocublast::flow
