#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "flow_solver/grid/precision.hpp"
#include "flow_solver/ranks/border_sums.hpp"
#include "flow_solver/ranks/cut_borders.hpp"
#include "flow_solver/ranks/halo.hpp"
#include "flow_solver/ranks/rank_part.hpp"

namespace ocublast::flow::inline OCU_PRECISION {

/// What a scalar field's ghosts are needed for.
enum class ScalarGhosts { differences, average, faces };

/// All messages of a flow under ranks.
struct RankFlow {
  /// `state_depth`: layers of the primitives that the sweeps and sensors look at.
  RankFlow(RankPart part_in, const LineScheme& scheme, int state_depth, bool strain,
           bool with_filter);

  RankPart part;
  [[nodiscard]] const Ranks& ranks() const { return *part.ranks; }
  Halo state;  ///< primitives; along all axes at once
  /// The same axis by axis with edges and corners, which the stress in the ghosts of open faces
  /// reads.
  std::vector<Halo> state_by_axis;
  Halo conserved;  ///< one layer of q^n, for first-order fluxes at the border
  /// Scalar fields of R (the sensors) and W (kappa), axis by axis so that corners are filled.
  std::vector<Halo> theta, sensors, kappa;
  /// Border fluxes of divided axes.
  std::array<std::unique_ptr<BorderSums>, 3> flux, filter;
  /// The same where bodies cut the lines near the borders.
  std::array<std::unique_ptr<CutBorders>, 3> cut_flux, cut_filter;

  /// One byte per line group at both ends of every axis, [axis][0 low, 1 high]: bits of the lines.
  using EndBits = std::array<std::array<std::vector<LaneBits>, 2>, 3>;
  /// Sends each border layer's bits to the neighbour; gives those of the neighbours' nodes beyond
  /// the borders. Collective.
  [[nodiscard]] const EndBits& exchange_bits(const std::function<bool(int i, int j, int k)>& bit);
  EndBits marked;  ///< what the kernels see of the neighbours' marks

  /// What this rank sends in a step without marks; `nodal`: with nodal stress.
  [[nodiscard]] Traffic step_traffic(bool nodal, bool sensors_on) const;

 private:
  struct BitFace {
    int axis;
    bool low;
    std::vector<LaneBits> out, in;
  };
  std::array<int, 3> n_groups_{};
  std::vector<std::unique_ptr<BitFace>> bit_faces_;
  std::unique_ptr<RankExchange> bit_exchange_;
  EndBits received_;
};

}  // namespace ocublast::flow
