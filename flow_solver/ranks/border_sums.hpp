#pragma once

#include <memory>
#include <vector>

#include "coupler/base/rank_exchange.hpp"
#include "flow_solver/numerics/kernel.hpp"
#include "flow_solver/ranks/border_weights.hpp"
#include "flow_solver/ranks/halo.hpp"
#include "flow_solver/ranks/rank_part.hpp"

namespace ocublast::flow::inline OCU_PRECISION {

/// Fluxes at the borders across one axis from the parts of all ranks within reach of the weights. A
/// rank adds its nodes' part for every such border (the kernels border_flux and border_filter fill
/// `sums`) and sends it to the ranks on both sides; those add the parts in the order of the blocks,
/// so that both have the same bits.
class BorderSums {
 public:
  /// `groups`: line groups of tile_width lines along the axis.
  BorderSums(const RankPart& part, int axis, LineSolve solve, const WholeLine& line, int groups,
             int channel);
  [[nodiscard]] const std::vector<BorderSum>& sums() const { return sums_; }
  /// Which border each sum is for: the number of the part above it.
  [[nodiscard]] const std::vector<int>& borders_of_sums() const { return border_of_sum_; }
  void start();
  void poll() { exchange_->poll(); }
  /// Until the other ranks' parts are there; `finish` does it where it has not been done, and adds
  /// them.
  void wait() { exchange_->finish(); }
  void finish();
  /// Fluxes of the known faces at either end of the block, [group, face, component, lane]; null: no
  /// border.
  [[nodiscard]] const Real* low() const { return low_ ? low_->total.data() : nullptr; }
  [[nodiscard]] const Real* high() const { return high_ ? high_->total.data() : nullptr; }
  [[nodiscard]] int known() const { return known_; }
  /// What this rank sends each time.
  [[nodiscard]] Traffic traffic() const;

 private:
  /// A border within reach of this block's nodes.
  struct Border {
    BorderWeights weights;
    std::vector<Real> weight, ratio;  ///< of the weights, as kernels read them
    std::vector<Real> sum;            ///< [group, 2 known - 1, component, lane]
  };
  /// One side's half of a border's sum on its way to the rank there.
  struct Outgoing {
    const Border* border;
    bool low_end;  ///< whether the border is the low end of the rank that gets it
    std::vector<Real> data;
  };
  /// What an end of this block gets: one part per contributing block, in their order; own parts are
  /// taken from `own`.
  struct End {
    std::vector<std::vector<Real>> parts;
    std::vector<const Border*> own;  ///< null where the part comes from another rank
    std::vector<Real> total;
  };
  void copy_half(const Border& border, bool low_end, Real* to) const;
  int known_ = 0;
  std::size_t groups_ = 0;
  std::vector<std::unique_ptr<Border>> borders_;
  std::vector<BorderSum> sums_;
  std::vector<int> border_of_sum_;
  std::vector<std::unique_ptr<Outgoing>> outgoing_;
  std::unique_ptr<End> low_, high_;
  std::unique_ptr<RankExchange> exchange_;
};

}  // namespace ocublast::flow
