// How an assembly is laid out: elements per tissue, blocks, chunks, tasks, rows, lumped mass.

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>
#include <tuple>

#include "solid_solver/elements/assembly.hpp"
#include "solid_solver/mesh/cell_geometry.hpp"

namespace ocublast::solid {
namespace {

std::size_t index(std::int32_t n) {
  return static_cast<std::size_t>(n);
}

/// Enough that dynamic scheduling evens out the threads of a large machine; few, so that most nodes
/// are inside a task.
constexpr double most_tasks = 64.0;

}  // namespace

Assembly::Assembly(const SolidMesh& mesh, std::vector<Material> materials,
                   std::vector<std::int32_t> material_of_tissue, const AssemblyOptions& options,
                   std::shared_ptr<const MeshPart> part)
    : mesh_(mesh),
      materials_(std::move(materials)),
      material_of_tissue_(std::move(material_of_tissue)),
      options_(options),
      laws_(make_laws()),
      elements_(make_elements()),
      team_(std::move(part)),
      volume_shares_(options.threads),
      force_shares_(options.threads),
      scratch_(static_cast<std::size_t>(options.threads)) {
  choose_elements();
  build_blocks();
  build_tasks();
  if (has_nodal_) build_pressure_rows();
  build_mass();
  if (!team_.alone()) share_pressure_nodes();
}

void Assembly::choose_elements() {
  const auto find = [&](const std::string& name) {
    const auto found = std::find_if(elements_.begin(), elements_.end(),
                                    [&](const ElementType& type) { return type.name == name; });
    if (found == elements_.end()) throw std::invalid_argument("no element " + name);
    return &*found;
  };
  for (const auto& shape : shapes) {
    auto& list = element_of_[static_cast<std::size_t>(shape.shape)];
    list.assign(mesh_.tissues.size(), find(shape.default_element));
    for (std::size_t t = 0; t < options_.element_of_tissue.size(); ++t) {
      if (options_.element_of_tissue[t].empty()) continue;
      const auto* type = find(options_.element_of_tissue[t]);
      if (type->shape == shape.shape) list[t] = type;
    }
  }
}

void Assembly::build_blocks() {
  // Materials with rates are kept apart: the others need no state.
  std::map<std::tuple<std::size_t, std::size_t, bool>, std::vector<std::int64_t>> cells;
  for (std::size_t number = 0; number < mesh_.n_cells(); ++number) {
    const auto type = static_cast<std::size_t>(&element_of(mesh_.cell(number)) - elements_.data());
    const auto& material = material_of_cell(number);
    cells[{type, material.law, material.rate_dependent()}].push_back(
        static_cast<std::int64_t>(number));
  }
  std::vector<std::uint8_t> at_border;
  if (!team_.alone()) {
    std::vector<std::uint8_t> shared(mesh_.n_nodes(), 0);
    for (const auto& node : team_.part()->shared) shared[index(node.node)] = 1;
    for (std::size_t number = 0; number < mesh_.n_cells(); ++number) {
      const auto nodes = mesh_.cell(number).nodes;
      at_border.push_back(std::any_of(nodes.begin(), nodes.end(),
                                      [&](std::int32_t n) { return shared[index(n)] != 0; }));
    }
  }
  const ElementBlock::Parts parts{.mesh = mesh_,
                                  .materials = materials_,
                                  .material_of_tissue = material_of_tissue_,
                                  .viscosity = options_.viscosity,
                                  .hourglass = options_.hourglass,
                                  .chunk_elements = options_.chunk_elements,
                                  .at_border = at_border};
  for (auto& [key, list] : cells) {
    const auto& type = elements_[std::get<0>(key)];
    blocks_.emplace_back(type, laws_[std::get<1>(key)], std::move(list), parts);
    has_nodal_ = has_nodal_ || type.volumetric == Volumetric::nodal;
  }
}

/// Chunks in the order of the curve, those at the border to other ranks first, cut into tasks of
/// about equal cost.
void Assembly::build_tasks() {
  for (const bool border : {true, false}) {
    const std::size_t first = chunks_.size();
    for (auto& block : blocks_) {
      const std::size_t n_border = block.n_border_chunks();
      const std::size_t last = border ? n_border : block.chunks().size();
      for (std::size_t k = border ? 0 : n_border; k < last; ++k)
        chunks_.push_back({.block = &block, .range = &block.chunks()[k]});
    }
    const auto cost_of = [](const Chunk& chunk) {
      return chunk.block->type().cost * static_cast<double>(chunk.range->end - chunk.range->begin);
    };
    double cost = 0.0;
    for (std::size_t k = first; k < chunks_.size(); ++k) cost += cost_of(chunks_[k]);
    double done = 0.0;
    double next = 0.0;  // where the next task begins
    for (std::size_t k = first; k < chunks_.size(); ++k) {
      if (done >= next) {
        tasks_.push_back({.begin = k, .end = k});
        next = cost / most_tasks * (std::floor(done / cost * most_tasks) + 1.0);
      }
      tasks_.back().end = k + 1;
      done += cost_of(chunks_[k]);
    }
    if (border) n_border_tasks_ = tasks_.size();
  }
  std::vector<TaskRows::Use> uses;
  std::size_t most_rows = 0;
  for (std::size_t t = 0; t < tasks_.size(); ++t)
    for (std::size_t k = tasks_[t].begin; k < tasks_[t].end; ++k) {
      uses.push_back({.rows = chunks_[k].block->row_nodes(*chunks_[k].range), .task = t});
      most_rows = std::max(most_rows, uses.back().rows.size());
    }
  force_rows_ = TaskRows(mesh_.n_nodes(), row_stride, uses, n_border_tasks_);
  sums_.resize(chunks_.size());
  for (auto& scratch : scratch_) {
    scratch.rows.resize(row_stride * most_rows);
    scratch.forces.resize(row_stride * most_rows);
  }
}

void Assembly::build_pressure_rows() {
  for (auto& block : blocks_) {
    if (block.type().volumetric != Volumetric::nodal) continue;
    std::vector<TaskRows::Use> uses;
    auto& rows = pressure_rows_.emplace_back();
    for (std::size_t t = 0; t < tasks_.size(); ++t)
      for (std::size_t k = tasks_[t].begin; k < tasks_[t].end; ++k) {
        auto& chunk = chunks_[k];
        if (chunk.block != &block) continue;
        chunk.pressures = &rows;
        chunk.pressure_use = uses.size();
        uses.push_back({.rows = block.row_pressures(*chunk.range), .task = t});
      }
    rows = TaskRows(block.n_pressure_nodes(), 1, uses, n_border_tasks_);
  }
}

void Assembly::build_mass() {
  mass_.assign(mesh_.n_nodes(), 0.0);
  planar_.assign(mesh_.n_nodes(), true);
  std::array<double, most_nodes> volumes{};
  for (std::size_t number = 0; number < mesh_.n_cells(); ++number) {
    const auto cell = mesh_.cell(number);
    const auto& type = element_of(cell);
    const auto x = cell_positions(mesh_, cell.nodes);
    type.geometry.lump(x.nodes(), {volumes.data(), x.n});
    for (std::size_t a = 0; a < x.n; ++a) {
      mass_[index(cell.nodes[a])] += material_of_cell(number).density * volumes[a];
      if (!type.planar) planar_[index(cell.nodes[a])] = false;
    }
  }
  if (team_.alone()) return;
  team_.add_nodal(mass_);
  std::vector<double> planar(planar_.begin(), planar_.end());
  team_.take_least_nodal(planar);
  for (std::size_t n = 0; n < planar.size(); ++n) planar_[n] = planar[n] != 0.0;
}

/// A pressure node belongs to the ranks that have cells of its element and material at its node.
void Assembly::share_pressure_nodes() {
  int channel = pressure_channel;
  for (const auto& element : elements_) {  // all ranks count channels alike: by element and law
    for (std::size_t law = 0; law < laws_.size(); ++law)
      for (const bool rates : {false, true}) {
        if (element.volumetric != Volumetric::nodal) continue;
        const int own = channel++;
        const auto found = std::find_if(blocks_.begin(), blocks_.end(), [&](const auto& block) {
          return &block.type() == &element && &block.law() == &laws_[law] &&
                 block.rate_dependent() == rates;
        });
        if (found == blocks_.end()) continue;
        std::map<std::int32_t, const MeshPart::SharedNode*> shared;
        for (const auto& node : team_.part()->shared) shared[node.node] = &node;
        std::vector<SharedValues::Item> items;
        for (const auto& p : found->pressure_nodes_in_order()) {
          const auto node = shared.find(p.node);
          if (node == shared.end()) continue;
          SharedValues::Item item{.at = p.number};
          for (const auto& h : node->second->holders) {
            const auto* type = element_of_[static_cast<std::size_t>(h.shape)][index(h.tissue)];
            if (type != &element || material_of_tissue_[index(h.tissue)] != p.material) continue;
            if (item.ranks.empty() || item.ranks.back() != h.rank) item.ranks.push_back(h.rank);
          }
          if (item.ranks.size() > 1) items.push_back(std::move(item));
        }
        shared_pressures_.push_back(
            {&*found, SharedValues(*team_.part()->ranks, own, items, 1, 1)});
        shared_pressures_.back().values.add(found->nodal_volume());
      }
  }
}

}  // namespace ocublast::solid
