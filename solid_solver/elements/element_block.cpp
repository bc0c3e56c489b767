#include "solid_solver/elements/element_block.hpp"

#include <algorithm>
#include <stdexcept>

#include "solid_solver/mesh/cell_geometry.hpp"

namespace ocublast::solid {
namespace {

constexpr std::size_t lanes = batch_lanes;
// Doubles of state per point of an overlay; the layout stands in overlay.hpp.
constexpr std::size_t overlay_state_per_point(std::size_t n_terms) {
  return 18 + 6 * n_terms;
}
// Offsets of rows are 16 bits wide; ten nodes of each element at most.
constexpr std::size_t most_chunk_elements = 65536 / row_stride / most_nodes;
// A filler's forces vanish through its weight; its volume only divides and must not be zero.
constexpr double filler_scale = 1e-200;

std::uint64_t spread_bits(std::uint64_t x) {  // 21 bits, two zeros between each
  x = (x | x << 32) & 0x1f00000000ffff;
  x = (x | x << 16) & 0x1f0000ff0000ff;
  x = (x | x << 8) & 0x100f00f00f00f00f;
  x = (x | x << 4) & 0x10c30c30c30c30c3;
  return (x | x << 2) & 0x1249249249249249;
}

/// Sorts cells along a Morton curve through their centres: neighbours in space become neighbours in
/// memory, chunks become compact and touch few other chunks.
void sort_along_curve(const SolidMesh& mesh, std::vector<std::int64_t>& cells) {
  std::array<double, 3> low{1e300, 1e300, 1e300};
  std::array<double, 3> high{-1e300, -1e300, -1e300};
  for (std::size_t n = 0; n < mesh.n_nodes(); ++n)
    for (std::size_t i = 0; i < 3; ++i) {
      low[i] = std::min(low[i], mesh.nodes[3 * n + i]);
      high[i] = std::max(high[i], mesh.nodes[3 * n + i]);
    }
  const double size = std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2], 1e-300});
  std::vector<std::pair<std::uint64_t, std::int64_t>> keyed;
  for (const std::int64_t cell : cells) {
    const auto x = cell_centre(mesh, static_cast<std::size_t>(cell));
    std::uint64_t key = 0;
    for (std::size_t i = 0; i < 3; ++i)
      key |= spread_bits(static_cast<std::uint64_t>((x[i] - low[i]) / size * 2097151.0)) << i;
    keyed.emplace_back(key, cell);
  }
  std::sort(keyed.begin(), keyed.end());
  for (std::size_t e = 0; e < cells.size(); ++e) cells[e] = keyed[e].second;
}

}  // namespace

ElementBlock::ElementBlock(const ElementType& type, const MaterialLaw& law,
                           std::vector<std::int64_t> cells, const Parts& parts)
    : type_(type), law_(law), n_elements_(cells.size()) {
  for (const auto cell : cells) {
    const auto tissue =
        static_cast<std::size_t>(parts.mesh.tissue_of(static_cast<std::size_t>(cell)));
    const auto& material =
        parts.materials[static_cast<std::size_t>(parts.material_of_tissue[tissue])];
    rate_dependent_ = rate_dependent_ || material.rate_dependent();
    n_terms_ = std::max(n_terms_, material.prony_ratios.size());
  }
  sort_along_curve(parts.mesh, cells);
  auto border = cells.begin();
  if (!parts.at_border.empty())
    border = std::stable_partition(cells.begin(), cells.end(), [&](std::int64_t cell) {
      return parts.at_border[static_cast<std::size_t>(cell)] != 0;
    });
  // Elements with fewer nodes share them more: larger chunks have fewer rows for each.
  const std::size_t n_nodes = info(type_.shape).n_nodes;
  const std::size_t chunk_elements =
      std::clamp(parts.chunk_elements * 64 / (n_nodes * n_nodes), lanes, most_chunk_elements) /
      lanes * lanes;
  pack({cells.begin(), border}, chunk_elements);
  n_border_chunks_ = chunks_.size();
  pack({border, cells.end()}, chunk_elements);
  const std::size_t n_batches = cell_.size() / lanes;
  reference_.resize(n_batches * type_.n_reference * lanes);
  constants_.resize(n_batches * law_.n_values() * lanes);
  viscosity_.resize(n_batches * 2 * lanes);
  memory_.resize(n_batches * 2 * lanes);
  if (rate_dependent_) {
    overlay_parameters_.resize(n_batches * (1 + 2 * n_terms_) * lanes);
    overlay_state_.resize(n_batches * type_.n_points * overlay_state_per_point(n_terms_) * lanes);
  }
  for (std::size_t slot = 0; slot < cell_.size(); ++slot)
    fill_slot(slot, cell_of_slot_[slot], cell_[slot] < 0, parts);
  build_rows(parts);
  cell_of_slot_ = {};
}

void ElementBlock::pack(std::span<const std::int64_t> cells, std::size_t chunk_elements) {
  for (std::size_t first = 0; first < cells.size(); first += chunk_elements) {
    const std::size_t n = std::min(cells.size() - first, chunk_elements);
    const std::size_t n_batches = (n + lanes - 1) / lanes;
    const auto begin = static_cast<std::int64_t>(cell_.size() / lanes);
    for (std::size_t batch = 0; batch < n_batches; ++batch)
      for (std::size_t lane = 0; lane < lanes; ++lane) {
        const std::size_t e = lane * n_batches + batch;
        cell_.push_back(e < n ? cells[first + e] : -1);
        cell_of_slot_.push_back(cells[first + std::min(e, n - 1)]);
      }
    chunks_.push_back({.begin = begin, .end = begin + static_cast<std::int64_t>(n_batches)});
  }
}

void ElementBlock::fill_slot(std::size_t slot, std::int64_t cell, bool filler, const Parts& parts) {
  const auto c = parts.mesh.cell(static_cast<std::size_t>(cell));
  const auto& material = parts.materials[static_cast<std::size_t>(
      parts.material_of_tissue[static_cast<std::size_t>(c.tissue)])];
  const std::size_t batch = slot / lanes;
  const std::size_t lane = slot % lanes;
  const auto x = cell_positions(parts.mesh, c.nodes);
  const double modulus =
      std::max(material.moduli.shear, parts.hourglass.least_modulus * material.moduli.bulk);
  type_.geometry.fill(x.nodes(),
                      {.scale = filler ? filler_scale : 1.0,
                       .hourglass_modulus = parts.hourglass.coefficient * modulus},
                      reference_.data() + batch * type_.n_reference * lanes + lane);
  fill_material(slot, material, type_.geometry.length(x.nodes()), parts.viscosity);
  if (law_.n_fields > 0) fill_fields(slot, cell, parts);
  if (rate_dependent_) fill_overlay(slot, material);
}

void ElementBlock::fill_material(std::size_t slot, const Material& material, double length,
                                 const BulkViscosity& viscosity) {
  const std::size_t batch = slot / lanes;
  const std::size_t lane = slot % lanes;
  for (std::size_t k = 0; k < law_.constants.size(); ++k)
    constants_[(batch * law_.n_values() + k) * lanes + lane] = material.constants[k];
  const double reach = viscosity.quadratic * length;
  viscosity_[batch * 2 * lanes + lane] =
      viscosity.linear * material.density * material.sound_speed() * length +
      material.stiffness_damping * material.moduli.bulk;
  viscosity_[(batch * 2 + 1) * lanes + lane] = material.density * reach * reach;
}

void ElementBlock::fill_fields(std::size_t slot, std::int64_t cell, const Parts& parts) {
  const std::size_t n = law_.n_fields;
  for (std::size_t k = 0; k < n; ++k)
    constants_[(slot / lanes * law_.n_values() + law_.constants.size() + k) * lanes +
               slot % lanes] = parts.mesh.fibres[static_cast<std::size_t>(cell) * n + k];
}

void ElementBlock::fill_overlay(std::size_t slot, const Material& material) {
  double* out =
      overlay_parameters_.data() + slot / lanes * (1 + 2 * n_terms_) * lanes + slot % lanes;
  *out = material.shear_viscosity();
  for (std::size_t t = 0; t < material.prony_ratios.size(); ++t) {
    out[(1 + 2 * t) * lanes] = material.prony_ratios[t];
    out[(2 + 2 * t) * lanes] = 1.0 / material.prony_times[t];
  }
}

/// Numbers of the pressure nodes of all slots, [slot, 4]: pairs of node and material, ascending.
std::vector<std::int64_t> ElementBlock::number_pressure_nodes(const Parts& parts) {
  const auto n_materials = static_cast<std::int64_t>(parts.materials.size());
  std::vector<std::int64_t> keys(4 * cell_.size());
  for (std::size_t slot = 0; slot < cell_.size(); ++slot) {
    const auto cell = parts.mesh.cell(static_cast<std::size_t>(cell_of_slot_[slot]));
    const auto material = parts.material_of_tissue[static_cast<std::size_t>(cell.tissue)];
    for (std::size_t a = 0; a < 4; ++a)
      keys[4 * slot + a] =
          n_materials * cell.nodes[static_cast<std::size_t>(type_.geometry.order[a])] + material;
  }
  auto sorted = keys;
  std::sort(sorted.begin(), sorted.end());
  sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
  for (const auto key : sorted) {
    const auto material = static_cast<std::size_t>(key % n_materials);
    const auto& constants = parts.materials[material].constants;
    pressure_node_of_.push_back(
        {static_cast<std::int32_t>(key / n_materials), static_cast<std::int32_t>(material)});
    nodal_constants_.insert(nodal_constants_.end(), constants.begin(), constants.end());
    nodal_constants_.resize(pressure_node_of_.size() * law_.n_values());
  }
  nodal_volume_.resize(sorted.size());
  nodal_volume_change_.resize(sorted.size());
  nodal_pressure_.resize(sorted.size());
  for (std::size_t slot = 0; slot < cell_.size(); ++slot)
    for (std::size_t a = 0; a < 4; ++a) {
      auto& key = keys[4 * slot + a];
      key = std::lower_bound(sorted.begin(), sorted.end(), key) - sorted.begin();
      if (cell_[slot] >= 0)
        nodal_volume_[static_cast<std::size_t>(key)] +=
            0.25 * reference_[(slot / lanes * type_.n_reference + 9) * lanes + slot % lanes];
    }
  return keys;
}

/// Rows of every chunk and where each element's nodes lie among them.
void ElementBlock::build_rows(const Parts& parts) {
  const bool nodal = type_.volumetric == Volumetric::nodal;
  const std::size_t n = info(type_.shape).n_nodes;
  std::vector<std::int64_t> ids;  // [slot, node] node or pressure node
  if (nodal) {
    ids = number_pressure_nodes(parts);
  } else {
    for (const auto cell : cell_of_slot_) {
      const auto nodes = parts.mesh.cell(static_cast<std::size_t>(cell)).nodes;
      for (std::size_t a = 0; a < n; ++a)
        ids.push_back(nodes[static_cast<std::size_t>(type_.geometry.order[a])]);
    }
  }
  nodes_.resize(ids.size());
  for (auto& chunk : chunks_) {
    const auto first = static_cast<std::size_t>(chunk.begin) * lanes;
    const auto last = static_cast<std::size_t>(chunk.end) * lanes;
    std::vector<std::int64_t> rows(ids.begin() + static_cast<std::ptrdiff_t>(n * first),
                                   ids.begin() + static_cast<std::ptrdiff_t>(n * last));
    std::sort(rows.begin(), rows.end());
    rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
    chunk.first_row = row_nodes_.size();
    chunk.n_rows = rows.size();
    for (const auto id : rows) {
      if (nodal) row_pressures_.push_back(static_cast<std::int32_t>(id));
      row_nodes_.push_back(nodal ? pressure_node_of_[static_cast<std::size_t>(id)][0]
                                 : static_cast<std::int32_t>(id));
    }
    for (std::size_t slot = first; slot < last; ++slot)
      for (std::size_t a = 0; a < n; ++a) {
        const auto row = std::lower_bound(rows.begin(), rows.end(), ids[n * slot + a]);
        nodes_[(slot / lanes * n + a) * lanes + slot % lanes] =
            static_cast<std::uint16_t>(row_stride * (row - rows.begin()));
      }
  }
}

std::vector<ElementBlock::PressureNode> ElementBlock::pressure_nodes_in_order() const {
  std::vector<PressureNode> list;
  for (const auto& [node, material] : pressure_node_of_)
    list.push_back({node, material, static_cast<std::int32_t>(list.size())});
  return list;
}

BlockView ElementBlock::view() {
  return {.n_points = static_cast<int>(type_.n_points),
          .volumetric = type_.volumetric,
          .nodes = nodes_.data(),
          .reference = reference_.data(),
          .constants = constants_.data(),
          .viscosity = viscosity_.data(),
          .memory = memory_.data(),
          .overlay = {.n_terms = static_cast<int>(n_terms_),
                      .n_state = static_cast<int>(overlay_state_per_point(n_terms_)),
                      .parameters = overlay_parameters_.data(),
                      .state = rate_dependent_ ? overlay_state_.data() : nullptr},
          .nodal_volume_change = nodal_volume_change_.data(),
          .nodal_pressure = nodal_pressure_.data(),
          .nodal_volume = nodal_volume_.data(),
          .nodal_constants = nodal_constants_.data()};
}

std::size_t ElementBlock::bytes() const {
  return 8 * (reference_.size() + constants_.size() + viscosity_.size() + memory_.size() +
              overlay_parameters_.size() + overlay_state_.size() + 3 * nodal_volume_.size() +
              nodal_constants_.size() + cell_.size()) +
         4 * (row_nodes_.size() + row_pressures_.size() + 2 * pressure_node_of_.size()) +
         2 * nodes_.size();
}

}  // namespace ocublast::solid
