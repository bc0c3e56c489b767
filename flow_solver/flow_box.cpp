// The active box: kernels run on a context whose pointers start at the box's corner and whose lines
// end at its faces, with the real nodes beyond as ghosts. Gas outside is at rest and stays as it
// is.

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <utility>

#include "flow_solver/flow_core.hpp"

namespace ocublast::flow::inline OCU_PRECISION {
namespace {

/// Nodes around the start's disturbance: the filter spreads a jump over the whole line in the first
/// step, falling by 0.70 per node at alpha 0.47 (root of a z^2 + z + a); to a tenth of the
/// tolerance.
int start_margin(double tolerance) {
  return static_cast<int>(std::ceil(std::log(0.1 * std::min(tolerance, 0.1)) / std::log(0.70)));
}

/// The values as kernels read them: themselves, or rounded into the copy.
template <class T>
const Real* stored_values(const std::vector<T>& values, std::vector<Real>& copy) {
  if constexpr (std::is_same_v<Real, T>) {
    return values.data();
  } else {
    copy.assign(values.begin(), values.end());
    return copy.data();
  }
}

int down_to_tile(int i) {
  return i / tile_width * tile_width;
}

}  // namespace

void Flow::Core::set_box(const std::array<int, 3>& new_lo, const std::array<int, 3>& new_hi) {
  const LineScheme scheme{.eighth_order = options.scheme == Scheme::compact8,
                          .filter_alpha = options.filter_alpha};
  ghosts_filled = false;
  for (std::size_t a = 0; a < 3; ++a) {
    lo[a] = new_lo[a];
    hi[a] = new_hi[a];
    if (lo[a] == 0 && hi[a] == grid.axis[a].n) continue;
    // A periodic direction is never shortened.
    const auto end = [&](std::size_t face, bool inner) {
      return inner ? LineEnd::ghosted : line_end(boundaries[face].kind);
    };
    LineTable plain = make_line_table(hi[a] - lo[a], end(2 * a, lo[a] > 0),
                                      end(2 * a + 1, hi[a] < grid.axis[a].n), scheme);
    if (radial.power > 0 && a == 0) {
      box_radial_table =
          stored(make_radial_table(plain, radial.power, lo[0] == 0 && grid.axis[0].min == 0.0));
    }
    box_table[a] = stored(std::move(plain));
  }
  if (bodies) {
    for (int axis = 0; axis < 3; ++axis) {
      if (ctx.present[axis]) set_segments(axis);
    }
  }
  refresh_box();
}

void Flow::Core::refresh_box() {
  if (bodies) {
    // The ghosts may have moved in memory when they were computed.
    for (int axis = 0; axis < 3; ++axis) {
      const auto a = static_cast<std::size_t>(axis);
      ctx.wall_ghost[axis] = stored_values(bodies->lines(axis).ghost, wall_ghost[a]);
      ctx.wall_motion[axis] = stored_values(bodies->lines(axis).wall_motion, wall_motion[a]);
    }
  }
  box = ctx;
  const auto shift = [&](Block& b) {
    if (b.data != nullptr) b.data += lo[0] + lo[1] * b.sj + lo[2] * b.sk;
  };
  for (Block* b : {&box.W, &box.R, &box.Q, &box.A, &box.G}) shift(*b);
  box.X = box.R;
  const std::ptrdiff_t row = lo[2] * ctx.mask_rows + lo[1];
  const int tile = lo[0] / tile_width;
  box.fluid += row * ctx.mask_tiles + tile;
  box.mark += row * ctx.mask_tiles * tile_width + lo[0];
  box.failed += row * ctx.mask_tiles * tile_width + lo[0];
  const std::ptrdiff_t offset[3] = {lo[2] * ctx.mask_groups + lo[1] / tile_width,
                                    lo[2] * ctx.mask_tiles + tile, lo[1] * ctx.mask_tiles + tile};
  for (std::size_t a = 0; a < 3; ++a) {
    box.cut[a] += offset[a];
    box.line_marked[a] += offset[a];
    const int n = hi[a] - lo[a];
    box.n[a] = n;
    LineView& v = box.line[a];
    v.inverse_face_spacing += lo[a];
    v.face_jacobian += lo[a];
    v.inverse_jacobian += lo[a];
    v.jacobian += lo[a];
    v.filter_inverse_jacobian += lo[a];
    if (n == grid.axis[a].n) continue;
    const StoredTable& t = box_table[a];
    v.n = n;
    v.face_begin = t.face_begin;
    v.face_end = t.face_end;
    v.periodic = false;
    v.flux = t.flux.data() + table_offset * flux_row_size;
    v.filter = t.filter.data() + table_offset * filter_row_size;
    if (lo[a] > 0) v.low = LaneEnd::domain_ghost;
    if (hi[a] < grid.axis[a].n) v.high = LaneEnd::domain_ghost;
    if (lo[a] > 0) box.from_mirror[a] = box.from_ghost[a];
  }
  if (radial.power > 0) {
    for (const Real** p : {&box.radial.node_weight, &box.radial.inverse_volume,
                           &box.radial.face_area, &box.radial.power_over_r}) {
      *p += lo[0];
    }
    if (lo[0] > 0) box.radial.from_axis = false;
    if (box.n[0] != grid.axis[0].n)
      box.radial.flux = box_radial_table.flux.data() + table_offset * flux_row_size;
  }
  box.tiles = (box.n[0] + tile_width - 1) / tile_width;
  box.row_groups = (box.n[1] + tile_width - 1) / tile_width;
}

bool Flow::Core::face_disturbs(std::size_t face) const {
  const Boundary& b = boundaries[face];
  const State &s = b.state, &q = options.quiescent;
  const bool quiet = s.rho == q.rho && s.p == q.p && s.u == q.u && s.v == q.v && s.w == q.w;
  switch (b.kind) {
    case BoundaryKind::outflow:
    case BoundaryKind::fixed_state:
    case BoundaryKind::subsonic_inflow:
    case BoundaryKind::reservoir:
      return b.incoming != nullptr || !quiet;
    case BoundaryKind::wall:
      return b.wall.temperature > 0.0 || b.wall.velocity != std::array<double, 3>{};
    case BoundaryKind::symmetry:
    case BoundaryKind::periodic:
    case BoundaryKind::neighbour:
      break;
  }
  return false;
}

bool Flow::Core::disturbed(int i, int j, int k) const {
  const State& q = options.quiescent;
  const Real* w = ctx.W.data + i + j * ctx.W.sj + k * ctx.W.sk;
  const Gas& gas = options.gas;
  const double T = q.p / (q.rho * gas.gas_constant), c = sound_speed(gas, T),
               tol = options.active_tolerance;
  const double u = w[ctx.W.sf] - q.u, v = w[2 * ctx.W.sf] - q.v, ww = w[3 * ctx.W.sf] - q.w;
  return !(std::abs(w[0] - q.rho) <= tol * q.rho && std::abs(w[4 * ctx.W.sf] - T) <= tol * T &&
           u * u + v * v + ww * ww <= tol * tol * c * c);
}

void Flow::Core::find_box() {
  const std::array<int, 3> n{ctx.n[0], ctx.n[1], ctx.n[2]};
  if (!options.active_box) {
    set_box({0, 0, 0}, n);
    return;
  }
  std::array<int, 3> first = n, last{-1, -1, -1};
  for (int k = 0; k < n[2]; ++k) {
    for (int j = 0; j < n[1]; ++j) {
      for (int i = 0; i < n[0]; ++i) {
        const bool gas_here =
            ((fluid[static_cast<std::size_t>((k * n[1] + j) * ctx.mask_tiles + i / tile_width)] >>
              (i % tile_width)) &
             1) != 0;
        if (!gas_here || !disturbed(i, j, k)) continue;
        const int x[3] = {i, j, k};
        for (std::size_t a = 0; a < 3; ++a) {
          first[a] = std::min(first[a], x[a]);
          last[a] = std::max(last[a], x[a]);
        }
      }
    }
  }
  // Without any disturbance, and without bodies or faces that could start one, the smallest box
  // that the lines allow.
  bool quiet = last[0] < 0 && !bodies;
  for (std::size_t face = 0; face < 6; ++face)
    quiet = quiet && !(grid.axis[face / 2].present && face_disturbs(face));
  for (std::size_t a = 0; a < 3; ++a) {
    if (last[a] < 0) first[a] = last[a] = n[a] / 2;
    if (!grid.axis[a].present) continue;
    if (face_disturbs(2 * a)) first[a] = 0;
    if (face_disturbs(2 * a + 1)) last[a] = n[a] - 1;
  }
  // Such a face needs the box over its whole area.
  for (std::size_t a = 0; a < 3; ++a) {
    if (!grid.axis[a].present || (!face_disturbs(2 * a) && !face_disturbs(2 * a + 1))) continue;
    for (std::size_t across = 0; across < 3; ++across) {
      if (across == a) continue;
      first[across] = 0;
      last[across] = n[across] - 1;
    }
  }
  std::array<int, 3> a_lo{}, a_hi{};
  for (std::size_t a = 0; a < 3; ++a) {
    // One layer more than the test of grow_box looks at.
    const int margin =
        quiet ? tile_width
              : std::max(start_margin(options.active_tolerance), options.active_margin) + 1;
    a_lo[a] = down_to_tile(std::max(0, first[a] - margin));
    a_hi[a] = std::min(n[a], down_to_tile(last[a] + margin + tile_width));
    const bool periodic = boundaries[2 * a].kind == BoundaryKind::periodic;
    // Lines shorter than the stencils at both ends are not worth a box.
    if (!grid.axis[a].present || periodic || a_hi[a] - a_lo[a] < 2 * tile_width) {
      a_lo[a] = 0;
      a_hi[a] = n[a];
    }
  }
  set_box(a_lo, a_hi);
}

bool Flow::Core::layer_disturbed(int axis, int at) const {
  std::array<int, 3> from = lo, to = hi;
  from[static_cast<std::size_t>(axis)] = at;
  to[static_cast<std::size_t>(axis)] = at + 1;
  for (int k = from[2]; k < to[2]; ++k) {
    for (int j = from[1]; j < to[1]; ++j) {
      for (int i = from[0]; i < to[0]; ++i) {
        const LaneBits bits =
            fluid[static_cast<std::size_t>((k * ctx.n[1] + j) * ctx.mask_tiles + i / tile_width)];
        if (((bits >> (i % tile_width)) & 1) != 0 && disturbed(i, j, k)) return true;
      }
    }
  }
  return false;
}

void Flow::Core::grow_box() {
  std::array<int, 3> new_lo = lo, new_hi = hi;
  bool grown = false;
  for (std::size_t a = 0; a < 3; ++a) {
    const int axis = static_cast<int>(a), n = grid.axis[a].n, margin = options.active_margin;
    if (lo[a] > 0 && layer_disturbed(axis, std::min(lo[a] + margin, hi[a] - 1))) {
      new_lo[a] = std::max(0, lo[a] - tile_width);
      grown = true;
    }
    if (hi[a] < n && layer_disturbed(axis, std::max(hi[a] - 1 - margin, lo[a]))) {
      new_hi[a] = std::min(n, hi[a] + tile_width);
      grown = true;
    }
  }
  if (!grown) return;
  set_box(new_lo, new_hi);
  grow_box();
}

}  // namespace ocublast::flow
