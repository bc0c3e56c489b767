#include "solid_solver/parallel/distribute.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "coupler/base/errors.hpp"
#include "solid_solver/parallel/partition.hpp"

namespace ocublast::solid {
namespace {

std::size_t index(std::int32_t n) {
  return static_cast<std::size_t>(n);
}

/// A tissue that remembers takes about this much more time.
constexpr double cost_of_memory = 1.6;

std::vector<double> cell_costs(const SolidSetup& setup) {
  const auto& mesh = *setup.mesh;
  const auto elements = make_elements();
  const auto cost_of = [&](const std::string& name) {
    for (const auto& e : elements)
      if (e.name == name) return e.cost;
    throw std::invalid_argument("no element " + name);
  };
  std::vector<double> of_shape_and_tissue;
  for (const auto& shape : shapes)
    for (std::size_t t = 0; t < mesh.tissues.size(); ++t) {
      double cost = cost_of(shape.default_element);
      for (const auto& e : elements)
        if (t < setup.assembly.element_of_tissue.size() && e.shape == shape.shape &&
            e.name == setup.assembly.element_of_tissue[t])
          cost = e.cost;
      const auto& material = setup.materials[index(setup.material_of_tissue[t])];
      of_shape_and_tissue.push_back(cost * (material.rate_dependent() ? cost_of_memory : 1.0));
    }
  std::vector<double> costs;
  for (std::size_t c = 0; c < mesh.n_cells(); ++c) {
    const auto cell = mesh.cell(c);
    costs.push_back(of_shape_and_tissue[static_cast<std::size_t>(cell.shape) * mesh.tissues.size() +
                                        index(cell.tissue)]);
  }
  return costs;
}

std::vector<std::int32_t> nodes_of(const std::vector<Facet>& facets) {
  std::vector<std::int32_t> nodes;
  for (const auto& f : facets)
    for (const auto n : f)
      if (n >= 0) nodes.push_back(n);
  return nodes;
}

std::vector<std::vector<std::int32_t>> kept_together(const SolidSetup& setup) {
  std::vector<std::vector<std::int32_t>> lists;
  for (const auto& tie : setup.ties) {
    auto list = nodes_of(tie.facets);
    list.insert(list.end(), tie.nodes.begin(), tie.nodes.end());
    lists.push_back(std::move(list));
  }
  for (const auto& contact : setup.contacts) {
    auto list = nodes_of(contact.first);
    const auto more = nodes_of(contact.second);
    list.insert(list.end(), more.begin(), more.end());
    lists.push_back(std::move(list));
  }
  return lists;
}

/// What a rank keeps of lists of nodes and facets.
class Share {
 public:
  Share(const SolidMesh& whole, const MeshPart& part, std::span<const std::int32_t> rank_of_cell)
      : whole_(whole), part_(part), rank_of_cell_(rank_of_cell), numbers_(part) {
    cells_.resize(whole.n_nodes());
    for (std::size_t c = 0; c < whole.n_cells(); ++c)
      for (const auto n : whole.cell(c).nodes) cells_[index(n)].push_back(c);
  }

  /// Cuts a list of nodes down; where `along` is given, a list of numbers per node with it.
  void cut(std::vector<std::int32_t>& nodes, std::vector<double>* along = nullptr,
           std::vector<double>* along_too = nullptr) const {
    std::size_t kept = 0;
    for (std::size_t k = 0; k < nodes.size(); ++k) {
      const auto own = numbers_.of(nodes[k]);
      if (own < 0) continue;
      nodes[kept] = own;
      if (along != nullptr) (*along)[kept] = (*along)[k];
      if (along_too != nullptr) (*along_too)[kept] = (*along_too)[k];
      ++kept;
    }
    nodes.resize(kept);
    if (along != nullptr) along->resize(kept);
    if (along_too != nullptr) along_too->resize(kept);
  }

  /// Cuts a list of facets down; where `along` is given, a list per facet with it.
  void cut(std::vector<Facet>& facets, std::vector<Schedule>* along = nullptr) const {
    std::vector<Facet> kept;
    for (std::size_t k = 0; k < facets.size(); ++k) {
      auto facet = facets[k];
      if (rank_of_cell_[cell_behind(facet)] != part_.ranks->rank()) continue;
      if (along != nullptr) std::swap((*along)[kept.size()], (*along)[k]);
      for (auto& n : facet)
        if (n >= 0) n = numbers_.of(n);
      kept.push_back(facet);
    }
    facets = std::move(kept);
    if (along != nullptr) along->resize(facets.size());
  }

 private:
  /// The first cell that has all nodes of the facet.
  [[nodiscard]] std::size_t cell_behind(const Facet& facet) const {
    for (const auto c : cells_[index(facet[0])]) {
      const auto nodes = whole_.cell(c).nodes;
      if (std::all_of(facet.begin(), facet.end(), [&](std::int32_t n) {
            return n < 0 || std::find(nodes.begin(), nodes.end(), n) != nodes.end();
          }))
        return c;
    }
    throw CaseError(fmt::format(
        "solid.mesh: the facet of nodes {} belongs to no cell; several ranks need to know which",
        fmt::join(facet, ", ")));
  }

  const SolidMesh& whole_;
  const MeshPart& part_;
  std::span<const std::int32_t> rank_of_cell_;
  PartNumbers numbers_;
  std::vector<std::vector<std::size_t>> cells_;  ///< at a node, ascending
};

void cut_lists(SolidSetup& setup, const Share& share) {
  for (auto& f : setup.fixed) share.cut(f.nodes);
  for (auto& p : setup.prescribed) share.cut(p.nodes);
  for (auto& s : setup.springs) share.cut(s.nodes, &s.stiffness, &s.damping);
  for (auto& p : setup.pressures) share.cut(p.facets, p.by_facet ? &p.of_facet : nullptr);
  for (auto& l : setup.node_loads) share.cut(l.nodes, &l.share);
  for (auto& w : setup.walls) share.cut(w.nodes);
  for (auto& c : setup.contacts) {
    share.cut(c.first);
    share.cut(c.second);
  }
  for (auto& t : setup.ties) {
    share.cut(t.nodes);
    share.cut(t.facets);
  }
  for (auto& p : setup.planes) share.cut(p.nodes);
  share.cut(setup.interface);
}

}  // namespace

double distribute(SolidSetup& setup, const Ranks& ranks) {
  if (ranks.alone()) return 1.0;
  const auto whole = setup.mesh;
  const auto costs = cell_costs(setup);
  // Cut once, so that all ranks have the same parts whatever machine they run on.
  std::vector<std::int32_t> rank_of_cell(whole->n_cells());
  ranks.together([&] {
    if (ranks.root())
      rank_of_cell = partition_cells(
          *whole, {.parts = ranks.size(), .cost = costs, .kept_together = kept_together(setup)});
  });
  ranks.broadcast(std::span<std::int32_t>(rank_of_cell));
  setup.part = make_mesh_part(ranks, *whole, rank_of_cell);
  setup.mesh = std::shared_ptr<const SolidMesh>(setup.part, &setup.part->mesh);
  ranks.together([&] { cut_lists(setup, Share(*whole, *setup.part, rank_of_cell)); });
  return imbalance(rank_of_cell, costs, ranks.size());
}

}  // namespace ocublast::solid
