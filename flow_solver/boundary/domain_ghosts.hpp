#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "flow_solver/boundary/boundary.hpp"
#include "flow_solver/gas/gas.hpp"
#include "flow_solver/grid/grid.hpp"
#include "flow_solver/numerics/kernel.hpp"

namespace ocublast::flow::inline OCU_PRECISION {

/// Fills four ghost nodes of the primitives beyond the ends that a box has in common with the grid,
/// at time t.
class DomainGhosts {
 public:
  DomainGhosts(const Grid& grid, const Boundaries& boundaries, const Gas& gas, double t,
               const NodeBox& box, const Block& W, const Kernels& kernels)
      : grid_(grid),
        boundaries_(boundaries),
        gas_(gas),
        t_(t),
        box_(box),
        W_(W),
        kernels_(kernels) {}
  /// x-lines of rows [j0, j1) of plane k.
  void fill_x(int k, int j0, int j1) const;
  /// Rows beyond the low or high y end of plane k, over the whole length with the x ghosts.
  void fill_y(int k, bool low) const;
  /// Planes beyond the z ends, row j.
  void fill_z(int j) const;
  /// All: x first, then whole rows, then whole planes, so that edges and corners are filled as
  /// well.
  void fill_all(int threads) const;
  /// The ends along one axis of the same; x, y and z in turn are fill_all.
  void fill_axis(int axis, int threads) const;
  /// Only the z ends of the rows in the box.
  void fill_all_z(int threads) const;

 private:
  void fill(int axis, bool low, Real* node0, std::array<int, 3> node, std::ptrdiff_t stride,
            int count) const;
  /// The end as the kernels take it, if they can.
  [[nodiscard]] std::optional<OutflowEnd> outflow_end(int axis, bool low) const;
  const Grid& grid_;
  const Boundaries& boundaries_;
  const Gas& gas_;
  double t_;
  NodeBox box_;
  Block W_;
  const Kernels& kernels_;
};

/// Fills the ghosts of one even scalar field: mirrored at symmetry and walls, repeated if periodic,
/// else the end value. One axis at a time, x first: y takes whole rows, z whole planes with the
/// ghosts of those before.
void fill_scalar_ghosts(const Grid& grid, const Boundaries& boundaries, const NodeBox& box,
                        const Block& block, int field, int axis, int threads);

}  // namespace ocublast::flow
