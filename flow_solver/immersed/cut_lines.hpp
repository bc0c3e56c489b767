#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "flow_solver/grid/fields.hpp"
#include "flow_solver/grid/grid.hpp"

namespace ocublast::flow {

/// A maximal run of fluid nodes [begin, end) on one grid line that no body crosses. The line of
/// direction a is addressed by its indices (b, c) along the other two axes in ascending order:
/// x-lines (j, k), y-lines (i, k), z-lines (i, j).
struct Segment {
  int b = 0;
  int c = 0;
  int begin = 0;
  int end = 0;
  int wall_low =
      -1;  ///< index of the wall end before node `begin`; -1: reaches the domain boundary
  int wall_high = -1;  ///< index of the wall end behind node `end - 1`; -1 likewise
};

/// All lines of one direction that a body cuts. Lines not marked are uncut fluid from end to end;
/// a marked line without a segment lies in a body altogether.
struct CutLines {
  std::vector<std::uint8_t> cut;  ///< [n_c, n_b] 1 where the line is listed in `segments`
  std::vector<Segment> segments;  ///< ordered by c, then b, then begin
  int n_walls = 0;                ///< wall ends of this direction
  /// Ghost states of the wall ends [n_walls, n_ghost, n_primitive], layer 0 next to the fluid;
  /// renewed at every stage; their place in memory changes with the topology only.
  std::vector<double> ghost;
  /// Unit normal of the wall (zero: no slip) and its velocity, m/s, per wall end [n_walls, 6];
  /// renewed with the ghosts. For fluxes that mirror the end node's own state.
  std::vector<double> wall_motion;
  /// Position of the wall on the line, m, per wall end.
  std::vector<double> wall_position;
};

/// Node tags [n_k, n_j, n_i] (no ghosts).
enum NodeTag : std::uint8_t {
  tag_fluid = 0,
  tag_body = 1,     ///< in a body, out of reach of any fluid stencil: value kept, never used
  tag_band = 2,     ///< in a body within reach of the fluid: holds a nearest-side value
  tag_blocked = 3,  ///< fluid by position, but in a gap narrower than the gap rule allows
};

}  // namespace ocublast::flow
