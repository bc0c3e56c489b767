#include "solid_solver/elements/assembly.hpp"

#include <algorithm>
#include <bit>
#include <limits>
#include <map>

#include "solid_solver/elements/hex8_geometry.hpp"
#include "solid_solver/elements/tet4_geometry.hpp"

namespace ocublast::solid {

Assembly::Assembly(const SolidMesh& mesh, std::vector<Material> materials,
                   std::vector<std::int32_t> material_of_tissue, const AssemblyOptions& options)
    : mesh_(mesh),
      materials_(std::move(materials)),
      material_of_tissue_(std::move(material_of_tissue)),
      options_(options),
      laws_(make_laws()) {
  build_blocks();
  build_colours();
  build_mass();
}

void Assembly::build_blocks() {
  std::map<std::pair<ElementType, std::size_t>, std::vector<std::int64_t>> cells;
  for (std::size_t cell = 0; cell < mesh_.n_cells(); ++cell) {
    const auto type = cell < mesh_.n_hex() ? ElementType::hex8_q1p0 : ElementType::tet4_anp;
    cells[{type, material_of_cell(cell).law}].push_back(static_cast<std::int64_t>(cell));
  }
  const ElementBlock::Parts parts{.mesh = mesh_,
                                  .materials = materials_,
                                  .material_of_tissue = material_of_tissue_,
                                  .viscosity = options_.viscosity,
                                  .chunk_elements = options_.chunk_elements};
  for (auto& [key, list] : cells) {
    blocks_.emplace_back(key.first, key.second, laws_[key.second].constants.size(), std::move(list),
                         parts);
    has_tets_ = has_tets_ || key.first == ElementType::tet4_anp;
  }
}

void Assembly::build_colours() {
  // Greedy: each chunk takes the first colour that none of its nodes has seen. 64 colours are far
  // beyond what compact chunks need (about 8); more would mean a chunk of scattered elements, which
  // then gets a colour of its own.
  std::vector<std::uint64_t> seen(mesh_.n_nodes(), 0);
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    const auto view = blocks_[b].view();
    const std::int64_t width = (blocks_[b].type() == ElementType::hex8_q1p0 ? 8 : 4) * batch_lanes;
    for (const auto& [begin, end] : blocks_[b].chunks()) {
      const std::span nodes(view.nodes + begin * width,
                            static_cast<std::size_t>((end - begin) * width));
      std::uint64_t taken = 0;
      for (const std::int32_t n : nodes) taken |= seen[static_cast<std::size_t>(n)];
      const auto colour = static_cast<std::size_t>(std::countr_one(taken));
      const Chunk chunk{.block = b, .begin = begin, .end = end};
      if (colour >= 64) {
        colours_.push_back({chunk});
        continue;
      }
      if (colour >= colours_.size()) colours_.resize(colour + 1);
      colours_[colour].push_back(chunk);
      for (const std::int32_t n : nodes)
        seen[static_cast<std::size_t>(n)] |= std::uint64_t{1} << colour;
    }
  }
  std::size_t n_chunks = 0;
  for (const auto& colour : colours_) n_chunks += colour.size();
  sums_.resize(n_chunks);
}

void Assembly::build_mass() {
  mass_.assign(mesh_.n_nodes(), 0.0);
  for (std::size_t cell = 0; cell < mesh_.n_hex(); ++cell) {
    const std::int32_t* nodes = mesh_.hex8.data() + 8 * cell;
    const auto g = compute_hex_geometry(cell_positions<8>(mesh_, nodes));
    for (std::size_t a = 0; a < 8; ++a)
      mass_[static_cast<std::size_t>(nodes[a])] += material_of_cell(cell).density * g.lumped[a];
  }
  for (std::size_t t = 0; t < mesh_.n_tet(); ++t) {
    const std::int32_t* nodes = mesh_.tet4.data() + 4 * t;
    const double volume = compute_tet_geometry(cell_positions<4>(mesh_, nodes)).volume;
    for (std::size_t a = 0; a < 4; ++a)
      mass_[static_cast<std::size_t>(nodes[a])] +=
          0.25 * volume * material_of_cell(mesh_.n_hex() + t).density;
  }
}

/// Inside a parallel region: dilatation and pressure at the nodes of tets.
void Assembly::compute_nodal_pressures(const KernelStep& step) {
  for (auto& block : blocks_) {
    if (block.type() != ElementType::tet4_anp) continue;
    auto& change = block.nodal_volume_change();
#pragma omp for schedule(static)
    for (std::size_t a = 0; a < change.size(); ++a) change[a] = 0.0;
  }
  for (const auto& colour : colours_) {
#pragma omp for schedule(dynamic)
    for (std::size_t k = 0; k < colour.size(); ++k) {
      auto& block = blocks_[colour[k].block];
      if (block.type() == ElementType::tet4_anp)
        kernels(block).tet_volume(block.view(), step, colour[k].begin, colour[k].end);
    }
  }
  for (auto& block : blocks_) {
    if (block.type() != ElementType::tet4_anp) continue;
    const auto n = static_cast<std::int64_t>(block.n_pressure_nodes());
#pragma omp for schedule(static)
    for (std::int64_t part = 0; part < (n + 1023) / 1024; ++part)
      kernels(block).tet_pressure(block.view(), 1024 * part, std::min(n, 1024 * (part + 1)));
  }
}

ForceReport Assembly::compute_force(std::span<const double> displacement, std::span<double> force,
                                    double inverse_step) {
  const KernelStep step{
      .displacement = displacement.data(), .force = force.data(), .inverse_step = inverse_step};
#pragma omp parallel num_threads(options_.threads)
  {
#pragma omp for schedule(static)
    for (std::size_t i = 0; i < force.size(); ++i) force[i] = 0.0;
    if (has_tets_) compute_nodal_pressures(step);
    std::size_t first = 0;
    for (const auto& colour : colours_) {
#pragma omp for schedule(dynamic)
      for (std::size_t k = 0; k < colour.size(); ++k) {
        auto& block = blocks_[colour[k].block];
        KernelSums sums;
        const auto kernel = block.type() == ElementType::hex8_q1p0 ? kernels(block).hex_force
                                                                   : kernels(block).tet_force;
        kernel(block.view(), step, colour[k].begin, colour[k].end, sums);
        sums_[first + k] = sums;
      }
      first += colour.size();
    }
  }
  ForceReport report;
  for (const auto& sums : sums_) {
    report.viscous_work += sums.viscous_work;
    report.bad = report.bad || sums.bad > 0;
  }
  return report;
}

void Assembly::evaluate(std::span<const double> displacement, CellResults& results) {
  results.resize(mesh_.n_cells() * n_evaluated);
  const KernelStep step{.displacement = displacement.data()};
#pragma omp parallel num_threads(options_.threads)
  {
    if (has_tets_) compute_nodal_pressures(step);
    AlignedVector<double> batch(n_evaluated * batch_lanes);
    for (auto& block : blocks_) {
      // The kernels write at batch * n_evaluated * 8; one batch at a time keeps the memory small.
      const auto kernel = block.type() == ElementType::hex8_q1p0 ? kernels(block).hex_evaluate
                                                                 : kernels(block).tet_evaluate;
#pragma omp for schedule(static)
      for (std::int64_t b = 0; b < block.n_batches(); ++b) {
        kernel(block.view(), displacement.data(), b, b + 1,
               batch.data() - b * n_evaluated * batch_lanes);
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
  evaluate(displacement, results);
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
  place.tissue = mesh_.tissues[static_cast<std::size_t>(mesh_.tissue_of(place.cell))];
  place.position = cell_centre(mesh_, place.cell);
  const bool hex = place.cell < mesh_.n_hex();
  const std::size_t n = hex ? 8 : 4;
  const std::int32_t* nodes =
      hex ? &mesh_.hex8[8 * place.cell] : &mesh_.tet4[4 * (place.cell - mesh_.n_hex())];
  for (std::size_t a = 0; a < n; ++a)
    for (std::size_t i = 0; i < 3; ++i)
      place.position[i] +=
          displacement[4 * static_cast<std::size_t>(nodes[a]) + i] / static_cast<double>(n);
  return place;
}

std::pair<double, std::size_t> Assembly::smallest_transit(
    std::span<const double> displacement) const {
  std::pair<double, std::size_t> smallest{std::numeric_limits<double>::infinity(), 0};
  for (std::size_t cell = 0; cell < mesh_.n_cells(); ++cell) {
    const double transit =
        cell_length(mesh_, cell, displacement.data()) / material_of_cell(cell).sound_speed();
    if (transit < smallest.first) smallest = {transit, cell};
  }
  return smallest;
}

std::size_t Assembly::bytes() const {
  std::size_t sum = 8 * mass_.size();
  for (const auto& block : blocks_) sum += block.bytes();
  return sum;
}

}  // namespace ocublast::solid
