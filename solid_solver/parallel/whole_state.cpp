#include "solid_solver/parallel/whole_state.hpp"

#include <algorithm>

namespace ocublast::solid {

WholeState::WholeState(std::shared_ptr<const SolidMesh> whole, const SolidRun& run)
    : whole_(std::move(whole)) {
  const auto& team = run.team();
  if (team.alone()) return;
  const auto& part = *team.part();
  std::vector<std::int64_t> counted;
  for (std::size_t n = 0; n < part.node.size(); ++n)
    if (team.counts(n)) counted.push_back(part.node[n]);
  nodes_ = part.ranks->gather(std::span<const std::int64_t>(counted));
  cells_ = part.ranks->gather(std::span<const std::int64_t>(part.cell));
  if (part.ranks->root()) state_ = NodalState(whole_->n_nodes());
}

void WholeState::gather_nodes(const Team& team, std::span<const double> field,
                              AlignedVector<double>& whole) const {
  std::vector<double> mine;
  for (std::size_t n = 0; n < field.size() / 4; ++n)
    if (team.counts(n)) mine.insert(mine.end(), &field[4 * n], &field[4 * n] + 3);
  const auto all = team.part()->ranks->gather(std::span<const double>(mine));
  for (std::size_t r = 0; r < all.size(); ++r)
    for (std::size_t k = 0; k < all[r].size() / 3; ++k)
      std::copy_n(&all[r][3 * k], 3, &whole[4 * static_cast<std::size_t>(nodes_[r][k])]);
}

StateView WholeState::gather(const SolidRun& run, const CellResults& cells) {
  const auto& team = run.team();
  const auto& state = run.state();
  if (team.alone())
    return {whole_.get(),   state.time,         state.displacement,
            state.velocity, state.acceleration, cells};
  gather_nodes(team, state.displacement, state_.displacement);
  gather_nodes(team, state.velocity, state_.velocity);
  gather_nodes(team, state.acceleration, state_.acceleration);
  const auto all = team.part()->ranks->gather(std::span<const double>(cells));
  if (team.part()->ranks->root()) results_.resize(whole_->n_cells() * n_evaluated);
  for (std::size_t r = 0; r < all.size(); ++r)
    for (std::size_t k = 0; k < all[r].size() / n_evaluated; ++k)
      std::copy_n(&all[r][k * n_evaluated], n_evaluated,
                  &results_[static_cast<std::size_t>(cells_[r][k]) * n_evaluated]);
  return {whole_.get(),    state.time,          state_.displacement,
          state_.velocity, state_.acceleration, results_};
}

}  // namespace ocublast::solid
