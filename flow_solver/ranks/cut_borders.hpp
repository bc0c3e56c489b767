#pragma once

#include <map>
#include <memory>
#include <tuple>
#include <vector>

#include "flow_solver/immersed/cut_lines.hpp"
#include "flow_solver/numerics/kernel.hpp"
#include "flow_solver/ranks/border_weights.hpp"
#include "flow_solver/ranks/rank_part.hpp"

namespace ocublast::flow::inline OCU_PRECISION {

/// This rank's part of the border sums for lines that a body cuts within reach of a border: the
/// weights are those of the segment that goes through the border, with the closure of its walls,
/// and the sum ends with the walls' ghosts. Lines cut farther away keep the weights of the whole
/// line, which are the same there but for least_weight.
class CutBorders {
 public:
  CutBorders(const RankPart& part, int axis, LineSolve solve, const WholeLine& line);
  /// Takes the segments of the whole grid. `sums`: those of the same axis and solve
  /// (BorderSums::sums), `border`: which border each is for, by the number of the part above it.
  void take(const CutLines& lines, const std::vector<int>& borders);
  /// Replaces their parts in `sums`; after the kernel has written those of whole lines.
  void put(const Context& ctx, const std::vector<BorderSum>& sums, int threads) const;

 private:
  /// Weights of a part of a segment [class, face, node].
  struct Weights {
    int first = 0, last = 0;  ///< nodes from the border on
    std::vector<double> weight;
  };
  /// One segment across one border.
  struct Line {
    int sum = 0;             ///< which of the sums
    int b = 0, c = 0;        ///< as in Segment, within the block
    int border = 0;          ///< node of the block above the border
    int begin = 0, end = 0;  ///< nodes of the segment, counted in the block
    int wall_low = -1, wall_high = -1;
    const Weights* weights = nullptr;  ///< null: no node of the block is in reach
  };
  /// Nodes to either end of the segment (at most reach_), whether a wall is there, and the block's
  /// ends.
  using Key = std::tuple<int, bool, int, bool, int, int>;
  [[nodiscard]] const Weights* weights_for(const Key& key);
  void sum_line(const Context& ctx, const Line& line, std::vector<double>& values, Real* out) const;
  /// Nodal fluxes, or conserved states, of the nodes [first, last) in reach, [component, node].
  void load(const Context& ctx, const Line& line, double* values, std::ptrdiff_t stride) const;

  const RankPart* part_;
  int axis_;
  LineSolve solve_;
  WholeLine line_;
  int known_, reach_;
  std::map<Key, std::unique_ptr<Weights>> weights_;
  std::vector<Line> lines_;
};

}  // namespace ocublast::flow
