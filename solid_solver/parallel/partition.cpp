#include "solid_solver/parallel/partition.hpp"

#include <fmt/format.h>
#include <metis.h>

#include <algorithm>
#include <memory>
#include <numeric>

#include "coupler/base/errors.hpp"

namespace ocublast::solid {
namespace {

/// METIS takes whole numbers: costs in hundredths of the cheapest cell.
constexpr double cost_unit = 0.01;
/// Recursive bisection balances best; beyond some parts the direct method is as good and faster.
constexpr int most_parts_by_bisection = 8;

struct MetisFree {
  void operator()(idx_t* p) const { METIS_Free(p); }
};
using MetisArray = std::unique_ptr<idx_t, MetisFree>;

/// Nodes at the corners: those in the middle of edges would join cells that share an edge only.
std::size_t corners(Shape shape) {
  return shape == Shape::tet10 ? 4 : info(shape).n_nodes;
}

/// A graph as METIS takes it.
struct Graph {
  std::vector<idx_t> first{0};
  std::vector<idx_t> neighbours;
  std::vector<idx_t> shared;  ///< weight of an edge: faces in common
  std::vector<idx_t> cost;
};

struct Dual {
  MetisArray first;
  MetisArray neighbours;
};

Dual make_dual(const SolidMesh& mesh) {
  std::vector<idx_t> first{0};
  std::vector<idx_t> nodes;
  bool planar = true;
  for (std::size_t c = 0; c < mesh.n_cells(); ++c) {
    const auto cell = mesh.cell(c);
    planar = planar && cell.shape == Shape::quad4;
    const auto n = corners(cell.shape);
    nodes.insert(nodes.end(), cell.nodes.begin(), cell.nodes.begin() + static_cast<long>(n));
    first.push_back(static_cast<idx_t>(nodes.size()));
  }
  idx_t n_cells = static_cast<idx_t>(mesh.n_cells());
  idx_t n_nodes = static_cast<idx_t>(mesh.n_nodes());
  idx_t common = planar ? 2 : 3;  // of an edge; of a triangle, the smallest face
  idx_t numbering = 0;
  idx_t* out_first = nullptr;
  idx_t* out_neighbours = nullptr;
  if (METIS_MeshToDual(&n_cells, &n_nodes, first.data(), nodes.data(), &common, &numbering,
                       &out_first, &out_neighbours) != METIS_OK)
    throw std::runtime_error("METIS cannot make the graph of cells");
  return {MetisArray(out_first), MetisArray(out_neighbours)};
}

/// Vertex of each cell: cells that touch a list of kept_together share one. Returns their number.
std::size_t number_vertices(const SolidMesh& mesh, const PartitionKeys& keys,
                            std::vector<std::size_t>& vertex) {
  std::vector<std::size_t> lead(keys.kept_together.size());  // lists that meet in a cell are one
  std::iota(lead.begin(), lead.end(), std::size_t{0});
  const auto find = [&](std::size_t k) {
    while (lead[k] != k) k = lead[k];
    return k;
  };
  std::vector<std::vector<std::size_t>> lists_of_node(mesh.n_nodes());
  for (std::size_t k = 0; k < keys.kept_together.size(); ++k)
    for (const auto n : keys.kept_together[k])
      lists_of_node[static_cast<std::size_t>(n)].push_back(k);
  constexpr auto none = static_cast<std::size_t>(-1);
  std::vector<std::size_t> list_of_cell(mesh.n_cells(), none);
  for (std::size_t c = 0; c < mesh.n_cells(); ++c)
    for (const auto n : mesh.cell(c).nodes)
      for (const auto k : lists_of_node[static_cast<std::size_t>(n)]) {
        if (list_of_cell[c] == none) list_of_cell[c] = k;
        lead[find(k)] = find(list_of_cell[c]);
      }
  std::vector<std::size_t> vertex_of_list(keys.kept_together.size(), none);
  std::size_t n = 0;
  vertex.resize(mesh.n_cells());
  for (std::size_t c = 0; c < mesh.n_cells(); ++c) {
    if (list_of_cell[c] == none) {
      vertex[c] = n++;
      continue;
    }
    auto& of_list = vertex_of_list[find(list_of_cell[c])];
    if (of_list == none) of_list = n++;
    vertex[c] = of_list;
  }
  return n;
}

Graph make_graph(const SolidMesh& mesh, const PartitionKeys& keys,
                 const std::vector<std::size_t>& vertex, std::size_t n_vertices) {
  const auto dual = make_dual(mesh);
  std::vector<std::vector<idx_t>> to(n_vertices);  // with repeats
  std::vector<double> cost(n_vertices, 0.0);
  for (std::size_t c = 0; c < mesh.n_cells(); ++c) {
    cost[vertex[c]] += keys.cost[c];
    for (idx_t k = dual.first.get()[c]; k < dual.first.get()[c + 1]; ++k) {
      const auto other = vertex[static_cast<std::size_t>(dual.neighbours.get()[k])];
      if (other != vertex[c]) to[vertex[c]].push_back(static_cast<idx_t>(other));
    }
  }
  const double unit = cost_unit * *std::min_element(keys.cost.begin(), keys.cost.end());
  Graph graph;
  for (std::size_t v = 0; v < n_vertices; ++v) {
    std::sort(to[v].begin(), to[v].end());
    for (std::size_t k = 0; k < to[v].size(); ++k) {
      if (k > 0 && to[v][k] == to[v][k - 1]) {
        ++graph.shared.back();
        continue;
      }
      graph.neighbours.push_back(to[v][k]);
      graph.shared.push_back(1);
    }
    graph.first.push_back(static_cast<idx_t>(graph.neighbours.size()));
    graph.cost.push_back(static_cast<idx_t>(cost[v] / unit));
  }
  return graph;
}

std::vector<idx_t> cut(Graph& graph, int parts) {
  idx_t n = static_cast<idx_t>(graph.cost.size());
  idx_t constraints = 1;
  idx_t wanted = parts;
  idx_t edges_cut = 0;
  idx_t options[METIS_NOPTIONS];
  METIS_SetDefaultOptions(options);
  options[METIS_OPTION_SEED] = 1;
  options[METIS_OPTION_NUMBERING] = 0;
  std::vector<idx_t> part(graph.cost.size(), 0);
  const auto method =
      parts <= most_parts_by_bisection ? METIS_PartGraphRecursive : METIS_PartGraphKway;
  if (method(&n, &constraints, graph.first.data(), graph.neighbours.data(), graph.cost.data(),
             nullptr, graph.shared.data(), &wanted, nullptr, nullptr, options, &edges_cut,
             part.data()) != METIS_OK)
    throw std::runtime_error("METIS cannot cut the graph of cells");
  return part;
}

}  // namespace

std::vector<std::int32_t> partition_cells(const SolidMesh& mesh, const PartitionKeys& keys) {
  std::vector<std::size_t> vertex;
  const auto n_vertices = number_vertices(mesh, keys, vertex);
  const auto refuse = [&] {
    throw CaseError(fmt::format(
        "{} ranks are too many for {} cells, of which {} can be parted (cells at ties and contacts "
        "stay on one rank); use fewer ranks",
        keys.parts, mesh.n_cells(), n_vertices));
  };
  if (n_vertices < static_cast<std::size_t>(keys.parts)) refuse();
  auto graph = make_graph(mesh, keys, vertex, n_vertices);
  const auto part = cut(graph, keys.parts);
  std::vector<std::int32_t> result(mesh.n_cells());
  std::vector<bool> used(static_cast<std::size_t>(keys.parts), false);
  for (std::size_t c = 0; c < result.size(); ++c) {
    result[c] = static_cast<std::int32_t>(part[vertex[c]]);
    used[static_cast<std::size_t>(result[c])] = true;
  }
  if (std::find(used.begin(), used.end(), false) != used.end()) refuse();
  return result;
}

double imbalance(std::span<const std::int32_t> part_of_cell, std::span<const double> cost,
                 int parts) {
  std::vector<double> sums(static_cast<std::size_t>(parts), 0.0);
  for (std::size_t c = 0; c < cost.size(); ++c)
    sums[static_cast<std::size_t>(part_of_cell[c])] += cost[c];
  return *std::max_element(sums.begin(), sums.end()) * parts /
         std::accumulate(sums.begin(), sums.end(), 0.0);
}

}  // namespace ocublast::solid
