#include "flow_solver/io/piston_body.hpp"

namespace ocublast::flow::inline OCU_PRECISION {

BodySurface make_piston_slab(const PistonCase& piston, const Grid& grid) {
  std::array<double, 3> low{}, high{};
  for (std::size_t a = 0; a < 3; ++a) {
    low[a] = grid.axis[a].min;
    high[a] = grid.axis[a].max;
  }
  // One length of the domain beyond the face: the slab's back never comes near the gas.
  const std::size_t a = piston.face / 2;
  const double length = grid.axis[a].max - grid.axis[a].min;
  (piston.face % 2 == 0 ? high : low)[a] = piston.position;
  (piston.face % 2 == 0 ? low : high)[a] += piston.face % 2 == 0 ? -length : length;
  BodySurface s;
  for (int corner = 0; corner < 8; ++corner) {
    for (std::size_t d = 0; d < 3; ++d)
      s.vertices.push_back(((corner >> d) & 1) != 0 ? high[d] : low[d]);
  }
  // Quadrilaterals of the box, counter-clockwise from outside, two triangles each.
  constexpr std::int32_t sides[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                                        {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  for (const auto& side : sides) {
    for (const int v : {0, 1, 2, 0, 2, 3}) s.triangles.push_back(side[v]);
  }
  return s;
}

}  // namespace ocublast::flow
