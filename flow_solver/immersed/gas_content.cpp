#include "flow_solver/immersed/gas_content.hpp"

#include "flow_solver/immersed/scan_conversion.hpp"

namespace ocublast::flow::inline OCU_PRECISION {
namespace {

/// Face below node i; the domain's own at its ends.
double face_below(const Axis& axis, int i) {
  if (i <= 0) return axis.min;
  return i >= axis.n ? axis.max : 0.5 * (axis.x(i - 1) + axis.x(i));
}

}  // namespace

WallCells integrate_wall_cells(const Grid& grid, const CutGrid& cut, const GasNodes& W,
                               const Gas& gas) {
  WallCells sum;
  int directions = 0;
  for (int a = 0; a < 3; ++a) {
    const Axis& axis = grid.axis[static_cast<std::size_t>(a)];
    if (!axis.present) continue;
    ++directions;
    const auto [b, c] = across(a);
    for (const Segment& s : cut.lines[static_cast<std::size_t>(a)].segments) {
      const double area = grid.axis[static_cast<std::size_t>(b)].h(s.b) *
                          grid.axis[static_cast<std::size_t>(c)].h(s.c);
      for (int side = 0; side < 2; ++side) {
        const int number = side == 0 ? s.wall_low : s.wall_high;
        if (number < 0) continue;
        const double wall =
            cut.walls[static_cast<std::size_t>(a)][static_cast<std::size_t>(number)].position;
        const int i = side == 0 ? s.begin : s.end - 1;
        const double length =
            side == 0 ? face_below(axis, i) - wall : wall - face_below(axis, i + 1);
        std::array<int, 3> at{};
        at[static_cast<std::size_t>(a)] = i;
        at[static_cast<std::size_t>(b)] = s.b;
        at[static_cast<std::size_t>(c)] = s.c;
        if (W.far != nullptr && !W.far->near_own(at, 0)) continue;
        const auto [w, stride] = W(at[0], at[1], at[2]);
        const double rho = w[0];
        const double T = w[prim_T * stride];
        const double volume = area * length;
        double kinetic = 0.0;
        for (std::size_t d = 0; d < 3; ++d) {
          const double u = w[static_cast<std::ptrdiff_t>(prim_u + d) * stride];
          kinetic += 0.5 * rho * u * u;
          sum.momentum[d] += volume * rho * u;
        }
        sum.volume += volume;
        sum.mass += volume * rho;
        sum.energy += volume * (pressure(gas, rho, T) / (gas.heat_capacity_ratio - 1.0) + kinetic);
      }
    }
  }
  if (directions == 0) return sum;
  const double share = 1.0 / directions;
  sum.volume *= share;
  sum.mass *= share;
  sum.energy *= share;
  for (double& m : sum.momentum) m *= share;
  return sum;
}

}  // namespace ocublast::flow
