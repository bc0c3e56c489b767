#include "solid_solver/elements/assembly.hpp"

#include <fmt/format.h>
#include <omp.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>
#include <map>
#include <stdexcept>

#include "solid_solver/mesh/cell_geometry.hpp"

namespace ocublast::solid {
namespace {

std::size_t index(std::int32_t n) {
  return static_cast<std::size_t>(n);
}

}  // namespace

std::string describe_cell(const SolidMesh& mesh, std::size_t cell) {
  const auto c = mesh.cell(cell);
  const auto x = cell_centre(mesh, cell);
  return fmt::format("{} {} of {} at ({:.4g}, {:.4g}, {:.4g}) m", info(c.shape).name, c.index,
                     mesh.tissues[index(c.tissue)], x[0], x[1], x[2]);
}

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
      buffers_(static_cast<std::size_t>(options.threads)) {
  choose_elements();
  build_blocks();
  build_colours();
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

void Assembly::build_colours() {
  colour_chunks(true);
  n_border_colours_ = colours_.size();
  colour_chunks(false);
  std::size_t n_chunks = 0;
  for (const auto& colour : colours_) n_chunks += colour.size();
  sums_.resize(n_chunks);
}

/// Adds the colours of the chunks at the border to other ranks, or of the others.
void Assembly::colour_chunks(bool border) {
  // Greedy: each chunk takes the first colour that none of its nodes has seen. 64 colours are far
  // beyond what compact chunks need (about 8); more would mean a chunk of scattered elements, which
  // then gets a colour of its own.
  std::vector<std::uint64_t> seen(mesh_.n_nodes(), 0);
  const std::size_t before = colours_.size();
  for (auto& block : blocks_) {
    const std::size_t n_border = block.n_border_chunks();
    const std::size_t last = border ? n_border : block.chunks().size();
    for (std::size_t k = border ? 0 : n_border; k < last; ++k) {
      const auto [begin, end] = block.chunks()[k];
      const auto span = block.nodes(begin, end);
      std::vector<std::int32_t> nodes(span.begin(), span.end());
      std::sort(nodes.begin(), nodes.end());
      nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
      Chunk chunk{.block = &block,
                  .begin = begin,
                  .end = end,
                  .first_node = chunk_nodes_.size(),
                  .last_node = chunk_nodes_.size() + nodes.size()};
      chunk_nodes_.insert(chunk_nodes_.end(), nodes.begin(), nodes.end());
      std::uint64_t taken = 0;
      for (const std::int32_t n : nodes) taken |= seen[index(n)];
      const auto colour = static_cast<std::size_t>(std::countr_one(taken));
      if (colour >= 64) {
        colours_.push_back({chunk});
        continue;
      }
      if (before + colour >= colours_.size()) colours_.resize(before + colour + 1);
      colours_[before + colour].push_back(chunk);
      for (const std::int32_t n : nodes) seen[index(n)] |= std::uint64_t{1} << colour;
    }
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

bool Assembly::moved(const Chunk& chunk, const double* displacement) const {
  if (chunk.active || !options_.skip_undeformed) return true;
  for (std::size_t k = chunk.first_node; k < chunk.last_node; ++k) {
    const double* d = displacement + 4 * index(chunk_nodes_[k]);
    if (d[0] != 0.0 || d[1] != 0.0 || d[2] != 0.0) return true;
  }
  return false;
}

/// Whether a chunk must be computed: an undeformed one has no forces, exactly.
bool Assembly::deformed(const Chunk& chunk, const double* displacement) const {
  if (moved(chunk, displacement)) return true;
  if (chunk.block->type().volumetric != Volumetric::nodal) return false;
  // A pressure node may have got its pressure from the other side.
  const auto view = chunk.block->view();
  const auto* begin = view.pressure_nodes + chunk.begin * 4 * batch_lanes;
  const auto* end = view.pressure_nodes + chunk.end * 4 * batch_lanes;
  return std::any_of(begin, end,
                     [&](std::int32_t p) { return view.nodal_volume_change[p] != 0.0; });
}

/// Inside a parallel region: adds the dilatations of a colour at its pressure nodes.
void Assembly::add_volumes(std::vector<Chunk>& colour, const double* displacement) {
  auto& buffer = buffers_[static_cast<std::size_t>(omp_get_thread_num())];
#pragma omp for schedule(dynamic)
  for (std::size_t k = 0; k < colour.size(); ++k) {
    auto& block = *colour[k].block;
    if (block.type().volumetric != Volumetric::nodal) continue;
    if (!moved(colour[k], displacement)) continue;
    const auto& element = element_kernels(block);
    const auto& law = law_kernels(block);
    const auto view = block.view();
    for (auto b = colour[k].begin; b < colour[k].end; b += block.group()) {
      const auto last = std::min(colour[k].end, b + block.group());
      element.gradients(view, displacement, b, last, buffer);
      law.dilatation(b, last, buffer);
      element.add_volume(view, b, last, buffer);
    }
  }
}

/// Inside a parallel region: dilatation and pressure at the nodes of elements that average there.
void Assembly::compute_nodal_pressures(const double* displacement, Exchange exchange) {
  for (auto& block : blocks_) {
    if (block.type().volumetric != Volumetric::nodal) continue;
    auto& change = block.nodal_volume_change();
#pragma omp for schedule(static)
    for (std::size_t a = 0; a < change.size(); ++a) change[a] = 0.0;
  }
  for (std::size_t c = 0; c < n_border_colours_; ++c) add_volumes(colours_[c], displacement);
  if (exchange == Exchange::all) {
#pragma omp master
    for (auto& [block, values] : shared_pressures_) values.start(block->nodal_volume_change());
  }
  for (std::size_t c = n_border_colours_; c < colours_.size(); ++c)
    add_volumes(colours_[c], displacement);
  if (exchange == Exchange::all) {
#pragma omp master
    for (auto& [block, values] : shared_pressures_) values.finish(block->nodal_volume_change());
#pragma omp barrier
  }
  for (auto& block : blocks_) {
    if (block.type().volumetric != Volumetric::nodal) continue;
    const auto n = static_cast<std::int64_t>(block.n_pressure_nodes());
#pragma omp for schedule(static)
    for (std::int64_t part = 0; part < (n + 1023) / 1024; ++part)
      law_kernels(block).nodal_pressure(block.view(), 1024 * part, std::min(n, 1024 * (part + 1)));
  }
}

void Assembly::run_chunk(const Chunk& chunk, const double* displacement, double* force,
                         double inverse_step, PointBuffer& buffer, KernelSums& sums) const {
  auto& block = *chunk.block;
  const auto& element = element_kernels(block);
  const auto& law = law_kernels(block);
  const auto view = block.view();
  const bool nodal = block.type().volumetric == Volumetric::nodal;
  for (auto b = chunk.begin; b < chunk.end; b += block.group()) {
    const auto last = std::min(chunk.end, b + block.group());
    element.gradients(view, displacement, b, last, buffer);
    if (nodal) element.gather_pressure(view, b, last, buffer);
    law.stress(view, inverse_step, b, last, buffer, sums);
    element.forces(view, b, last, buffer, force);
    if (!block.type().hourglass) continue;
    for (std::int64_t e = 0; e < last - b; ++e)
      for (int lane = 0; lane < batch_lanes; ++lane)
        sums.hourglass_energy += buffer.hourglass[e][lane];
  }
}

/// Inside a parallel region: forces of the chunks of a colour, the first of which is number
/// `first`.
void Assembly::run_colour(std::size_t colour, std::size_t first, const double* displacement,
                          double* force, double inverse_step) {
  auto& chunks = colours_[colour];
  const int thread = omp_get_thread_num();
  // MPI belongs to the thread that has started it.
  const bool polls = thread == 0 && !team_.alone() && colour >= n_border_colours_;
#pragma omp for schedule(dynamic)
  for (std::size_t k = 0; k < chunks.size(); ++k) {
    KernelSums sums;
    if (deformed(chunks[k], displacement)) {
      // Only steps in time leave a mark: probes of the stiffness move everything.
      chunks[k].active = chunks[k].active || inverse_step > 0.0;
      run_chunk(chunks[k], displacement, force, inverse_step,
                buffers_[static_cast<std::size_t>(thread)], sums);
    }
    sums_[first + k] = sums;
    if (polls) team_.forces()->poll();
  }
}

ForceReport Assembly::compute_force(std::span<const double> displacement, std::span<double> force,
                                    double inverse_step, const std::function<void()>& add_more) {
#pragma omp parallel num_threads(options_.threads)
  {
#pragma omp for schedule(static)
    for (std::size_t i = 0; i < force.size(); ++i) force[i] = 0.0;
    if (has_nodal_) compute_nodal_pressures(displacement.data(), Exchange::all);
    std::size_t first = 0;
    const auto run_colours = [&](std::size_t begin, std::size_t end) {
      for (std::size_t c = begin; c < end; first += colours_[c++].size())
        run_colour(c, first, displacement.data(), force.data(), inverse_step);
    };
    run_colours(0, n_border_colours_);
    if (!team_.alone()) {
#pragma omp master
      {
        if (add_more) add_more();
        team_.forces()->start(force);
      }
#pragma omp barrier
    }
    run_colours(n_border_colours_, colours_.size());
  }
  if (!team_.alone())
    team_.forces()->finish(force);
  else if (add_more)
    add_more();
  ForceReport report;
  for (const auto& sums : sums_) {
    report.viscous_work += sums.viscous_work;
    report.overlay_work += sums.overlay_work;
    report.hourglass_energy += sums.hourglass_energy;
    report.bad = report.bad || sums.bad > 0;
  }
  return report;
}

void Assembly::evaluate(std::span<const double> displacement, CellResults& results) {
  evaluate(displacement, results, Exchange::all);
}

void Assembly::evaluate(std::span<const double> displacement, CellResults& results,
                        Exchange exchange) {
  results.resize(mesh_.n_cells() * n_evaluated);
#pragma omp parallel num_threads(options_.threads)
  {
    if (has_nodal_) compute_nodal_pressures(displacement.data(), exchange);
    auto& buffer = buffers_[static_cast<std::size_t>(omp_get_thread_num())];
    std::memset(buffer.hourglass, 0, sizeof buffer.hourglass);
    AlignedVector<double> batch(n_evaluated * batch_lanes);
    for (auto& block : blocks_) {
      const auto& element = element_kernels(block);
      const auto view = block.view();
#pragma omp for schedule(static)
      for (std::int64_t b = 0; b < block.n_batches(); ++b) {
        element.gradients(view, displacement.data(), b, b + 1, buffer);
        if (element.gather_pressure != nullptr && block.type().volumetric == Volumetric::nodal)
          element.gather_pressure(view, b, b + 1, buffer);
        law_kernels(block).evaluate(view, b, b + 1, buffer, batch.data());
        for (std::size_t lane = 0; lane < batch_lanes; ++lane) {
          const std::int64_t cell = block.cell(static_cast<std::size_t>(b) * batch_lanes + lane);
          if (cell < 0) continue;
          for (std::size_t k = 0; k < n_evaluated; ++k)
            results[static_cast<std::size_t>(cell) * n_evaluated + k] =
                batch[k * batch_lanes + lane];
        }
      }
    }
  }
}

ElementPlace Assembly::find_worst(std::span<const double> displacement) {
  CellResults results;
  evaluate(displacement, results, Exchange::none);  // the others may not be here
  ElementPlace place{.jacobian = std::numeric_limits<double>::infinity()};
  for (std::size_t cell = 0; cell < mesh_.n_cells(); ++cell) {
    const double jacobian = results[cell * n_evaluated + smallest_jacobian];
    const double mean = results[cell * n_evaluated + dilatation_mean];
    const bool lost = !(mean == mean);  // not a number is worse than any number
    if (!lost && !(jacobian < place.jacobian)) continue;
    place.cell = cell;
    place.jacobian = lost ? mean : jacobian;
    if (lost) break;
  }
  place.tissue = mesh_.tissues[index(mesh_.tissue_of(place.cell))];
  place.position = cell_centre(mesh_, place.cell, displacement.data());
  return place;
}

StepBound Assembly::element_step(std::span<const double> displacement) const {
  StepBound smallest{.step = std::numeric_limits<double>::infinity()};
  for (std::size_t number = 0; number < mesh_.n_cells(); ++number) {
    const auto cell = mesh_.cell(number);
    const auto& type = element_of(cell);
    const auto x = cell_positions(mesh_, cell.nodes, displacement.data());
    const double length = type.geometry.length(x.nodes());
    const double transit = length / material_of_cell(number).sound_speed();
    if (type.step_factor * transit >= smallest.step) continue;
    smallest = {
        .transit = transit, .step = type.step_factor * transit, .length = length, .cell = number};
  }
  return smallest;
}

double Assembly::viscous_damping_ratio(double omega) const {
  // Shear viscosity eta damps the highest mode of an element of length L by at most
  // 8 eta / (rho L^2) (largest eigenvalue of a hex's deviatoric operator, with a third to spare);
  // the ratio is half of that over omega.
  double largest = 0.0;
  for (std::size_t number = 0; number < mesh_.n_cells(); ++number) {
    const auto& material = material_of_cell(number);
    const double eta = material.shear_viscosity();
    if (eta == 0.0 && material.stiffness_damping == 0.0) continue;
    const auto cell = mesh_.cell(number);
    const double length =
        element_of(cell).geometry.length(cell_positions(mesh_, cell.nodes).nodes());
    largest = std::max(largest, 4.0 * eta / (material.density * length * length * omega) +
                                    0.5 * material.stiffness_damping * omega);
  }
  return largest;
}

void Assembly::wake_all() {
  for (auto& colour : colours_)
    for (auto& chunk : colour) chunk.active = true;
}

std::size_t Assembly::n_active_chunks() const {
  std::size_t n = 0;
  for (const auto& colour : colours_)
    n += static_cast<std::size_t>(
        std::count_if(colour.begin(), colour.end(), [](const Chunk& c) { return c.active; }));
  return n;
}

std::size_t Assembly::bytes() const {
  std::size_t sum = 8 * mass_.size() + 4 * chunk_nodes_.size();
  for (const auto& block : blocks_) sum += block.bytes();
  return sum;
}

}  // namespace ocublast::solid
