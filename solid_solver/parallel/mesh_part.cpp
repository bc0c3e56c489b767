#include "solid_solver/parallel/mesh_part.hpp"

#include <algorithm>

namespace ocublast::solid {
namespace {

std::size_t index(std::int32_t n) {
  return static_cast<std::size_t>(n);
}

void take_cells(MeshPart& part, const SolidMesh& whole, std::span<const std::int32_t> rank_of) {
  std::vector<std::uint8_t> used(whole.n_nodes(), 0);
  for (std::size_t c = 0; c < whole.n_cells(); ++c) {
    if (rank_of[c] != part.ranks->rank()) continue;
    part.cell.push_back(static_cast<std::int64_t>(c));
    for (const auto n : whole.cell(c).nodes) used[index(n)] = 1;
  }
  for (std::size_t n = 0; n < whole.n_nodes(); ++n) {
    if (used[n] == 0) continue;
    part.node.push_back(static_cast<std::int32_t>(n));
    part.mesh.nodes.insert(part.mesh.nodes.end(), &whole.nodes[3 * n], &whole.nodes[3 * n] + 3);
  }
}

void fill_mesh(MeshPart& part, const SolidMesh& whole, const PartNumbers& numbers) {
  part.mesh.tissues = whole.tissues;
  for (const auto c : part.cell) {
    const auto cell = whole.cell(static_cast<std::size_t>(c));
    auto& own = part.mesh.of(cell.shape);
    for (const auto n : cell.nodes) own.nodes.push_back(numbers.of(n));
    own.tissue.push_back(cell.tissue);
    own.number.push_back(static_cast<std::int32_t>(cell.index));
    if (whole.fibres.empty()) continue;
    const auto* fibre = &whole.fibres[6 * static_cast<std::size_t>(c)];
    part.mesh.fibres.insert(part.mesh.fibres.end(), fibre, fibre + 6);
  }
  for (const auto& [name, nodes] : whole.node_sets) {
    auto& own = part.mesh.node_sets[name];
    for (const auto n : nodes)
      if (numbers.of(n) >= 0) own.push_back(numbers.of(n));
  }
}

/// Who else has this rank's nodes.
void find_shared(MeshPart& part, const SolidMesh& whole, std::span<const std::int32_t> rank_of,
                 const PartNumbers& numbers) {
  std::vector<std::vector<MeshPart::Holder>> holders(part.node.size());
  for (std::size_t c = 0; c < whole.n_cells(); ++c) {
    const auto cell = whole.cell(c);
    const MeshPart::Holder holder{.rank = rank_of[c], .shape = cell.shape, .tissue = cell.tissue};
    for (const auto n : cell.nodes) {
      if (numbers.of(n) < 0) continue;
      auto& list = holders[index(numbers.of(n))];
      if (std::find(list.begin(), list.end(), holder) == list.end()) list.push_back(holder);
    }
  }
  part.counts.assign(part.node.size(), 1);
  for (std::size_t n = 0; n < part.node.size(); ++n) {
    auto& list = holders[n];
    std::stable_sort(list.begin(), list.end(),
                     [](const auto& a, const auto& b) { return a.rank < b.rank; });
    if (list.front().rank == list.back().rank) continue;
    part.counts[n] = list.front().rank == part.ranks->rank() ? 1 : 0;
    part.shared.push_back({static_cast<std::int32_t>(n), std::move(list)});
  }
}

}  // namespace

PartNumbers::PartNumbers(const MeshPart& part) : number_(part.n_nodes_whole, -1) {
  for (std::size_t n = 0; n < part.node.size(); ++n)
    number_[index(part.node[n])] = static_cast<std::int32_t>(n);
}

std::shared_ptr<const MeshPart> make_mesh_part(const Ranks& ranks, const SolidMesh& whole,
                                               std::span<const std::int32_t> rank_of_cell) {
  auto part = std::make_shared<MeshPart>();
  part->ranks = &ranks;
  part->n_nodes_whole = whole.n_nodes();
  take_cells(*part, whole, rank_of_cell);
  const PartNumbers numbers(*part);
  fill_mesh(*part, whole, numbers);
  find_shared(*part, whole, rank_of_cell, numbers);
  return part;
}

}  // namespace ocublast::solid
