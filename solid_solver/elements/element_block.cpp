#include "solid_solver/elements/element_block.hpp"

#include <algorithm>
#include <map>
#include <numeric>

#include "solid_solver/elements/hex8_geometry.hpp"
#include "solid_solver/elements/lanes.hpp"
#include "solid_solver/elements/tet4_geometry.hpp"

namespace ocublast::solid {
namespace {

constexpr std::size_t lanes = batch_lanes;

std::span<const std::int32_t> cell_nodes(const SolidMesh& mesh, std::size_t cell) {
  if (cell < mesh.n_hex()) return {mesh.hex8.data() + 8 * cell, 8};
  return {mesh.tet4.data() + 4 * (cell - mesh.n_hex()), 4};
}

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

std::array<double, 3> cell_centre(const SolidMesh& mesh, std::size_t cell) {
  std::array<double, 3> x{};
  const auto nodes = cell_nodes(mesh, cell);
  for (const std::int32_t n : nodes)
    for (std::size_t i = 0; i < 3; ++i)
      x[i] += mesh.nodes[3 * static_cast<std::size_t>(n) + i] / static_cast<double>(nodes.size());
  return x;
}

double cell_length(const SolidMesh& mesh, std::size_t cell, const double* displacement) {
  const std::int32_t* nodes = cell_nodes(mesh, cell).data();
  if (cell < mesh.n_hex()) return hex_length(cell_positions<8>(mesh, nodes, displacement));
  return tet_length(cell_positions<4>(mesh, nodes, displacement));
}

double cell_volume(const SolidMesh& mesh, std::size_t cell) {
  const std::int32_t* nodes = cell_nodes(mesh, cell).data();
  if (cell < mesh.n_hex()) return compute_hex_geometry(cell_positions<8>(mesh, nodes)).volume;
  return compute_tet_geometry(cell_positions<4>(mesh, nodes)).volume;
}

ElementBlock::ElementBlock(ElementType type, std::size_t law, std::size_t n_constants,
                           std::vector<std::int64_t> cells, const Parts& parts)
    : type_(type), law_(law), n_constants_(n_constants), n_elements_(cells.size()) {
  sort_along_curve(parts.mesh, cells);
  pack(cells, std::max(lanes, parts.chunk_elements / lanes * lanes));
  const std::size_t n_batches = cell_.size() / lanes;
  const bool hex = type_ == ElementType::hex8_q1p0;
  nodes_.resize(n_batches * (hex ? 8 : 4) * lanes);
  reference_.resize(n_batches * (hex ? 80 : 10) * lanes);
  constants_.resize(n_batches * n_constants_ * lanes);
  viscosity_.resize(n_batches * 2 * lanes);
  memory_.resize(n_batches * 2 * lanes);
  std::int64_t last = -1;
  for (std::size_t slot = 0; slot < cell_.size(); ++slot) {
    const bool filler = cell_[slot] < 0;
    if (!filler) last = cell_[slot];
    fill_slot(slot, last, filler, parts);
  }
  if (!hex) build_pressure_nodes(parts);
}

void ElementBlock::pack(const std::vector<std::int64_t>& cells, std::size_t chunk_elements) {
  for (std::size_t first = 0; first < cells.size(); first += chunk_elements) {
    const std::size_t last = std::min(cells.size(), first + chunk_elements);
    const auto begin = static_cast<std::int64_t>(cell_.size() / lanes);
    for (std::size_t e = first; e < last; ++e) cell_.push_back(cells[e]);
    while (cell_.size() % lanes != 0) cell_.push_back(-1);
    chunks_.emplace_back(begin, static_cast<std::int64_t>(cell_.size() / lanes));
  }
}

void ElementBlock::fill_slot(std::size_t slot, std::int64_t cell, bool filler, const Parts& parts) {
  if (type_ == ElementType::hex8_q1p0)
    fill_hex(slot, cell, filler, parts);
  else
    fill_tet(slot, cell, filler, parts);
  const auto c = static_cast<std::size_t>(cell);
  const auto tissue = static_cast<std::size_t>(parts.mesh.tissue_of(c));
  fill_material(slot, parts.materials[static_cast<std::size_t>(parts.material_of_tissue[tissue])],
                cell_length(parts.mesh, c), parts.viscosity);
}

void ElementBlock::fill_material(std::size_t slot, const Material& material, double length,
                                 const BulkViscosity& viscosity) {
  const std::size_t batch = slot / lanes;
  const std::size_t lane = slot % lanes;
  for (std::size_t k = 0; k < n_constants_; ++k)
    constants_[(batch * n_constants_ + k) * lanes + lane] = material.constants[k];
  const double linear = viscosity.linear * material.density * material.sound_speed() * length;
  const double reach = viscosity.quadratic * length;
  viscosity_[batch * 2 * lanes + lane] = linear;
  viscosity_[(batch * 2 + 1) * lanes + lane] = material.density * reach * reach;
}

void ElementBlock::fill_hex(std::size_t slot, std::int64_t cell, bool filler, const Parts& parts) {
  const std::size_t batch = slot / lanes;
  const std::size_t lane = slot % lanes;
  const std::int32_t* nodes = parts.mesh.hex8.data() + 8 * cell;
  for (std::size_t b = 0; b < 8; ++b)
    nodes_[(batch * 8 + b) * lanes + lane] = nodes[hex_vtk_of_binary[b]];
  const auto g = compute_hex_geometry(cell_positions<8>(parts.mesh, nodes));
  for (std::size_t q = 0; q < 8; ++q) {
    double* out = reference_.data() + ((batch * 8 + q) * 10) * lanes + lane;
    for (std::size_t i = 0; i < 9; ++i) out[i * lanes] = g.gradients[q][i];
    // A filler's forces vanish through its weight; its volume only divides and must not be zero.
    out[9 * lanes] = filler ? 1e-200 : g.weights[q];
  }
}

void ElementBlock::fill_tet(std::size_t slot, std::int64_t cell, bool filler, const Parts& parts) {
  const std::size_t batch = slot / lanes;
  const std::size_t lane = slot % lanes;
  const std::int32_t* nodes =
      parts.mesh.tet4.data() + 4 * (cell - static_cast<std::int64_t>(parts.mesh.n_hex()));
  for (std::size_t a = 0; a < 4; ++a) nodes_[(batch * 4 + a) * lanes + lane] = nodes[a];
  const auto g = compute_tet_geometry(cell_positions<4>(parts.mesh, nodes));
  double* out = reference_.data() + batch * 10 * lanes + lane;
  for (std::size_t a = 0; a < 3; ++a)
    for (std::size_t j = 0; j < 3; ++j) out[(3 * a + j) * lanes] = g.gradients[a][j];
  out[9 * lanes] = filler ? 0.0 : g.volume;
}

void ElementBlock::build_pressure_nodes(const Parts& parts) {
  pressure_nodes_.resize(nodes_.size());
  std::map<std::pair<std::int32_t, std::int32_t>, std::int32_t> numbers;  // (node, material)
  std::int64_t cell = -1;
  for (std::size_t slot = 0; slot < cell_.size(); ++slot) {
    const bool filler = cell_[slot] < 0;
    if (!filler) cell = cell_[slot];
    const auto tissue =
        static_cast<std::size_t>(parts.mesh.tissue_of(static_cast<std::size_t>(cell)));
    const std::int32_t material = parts.material_of_tissue[tissue];
    const auto& constants = parts.materials[static_cast<std::size_t>(material)].constants;
    for (std::size_t a = 0; a < 4; ++a) {
      const std::size_t at = (slot / lanes * 4 + a) * lanes + slot % lanes;
      const auto [entry, added] =
          numbers.try_emplace({nodes_[at], material}, static_cast<std::int32_t>(numbers.size()));
      if (added) {
        nodal_volume_.push_back(0.0);
        nodal_constants_.insert(nodal_constants_.end(), constants.begin(), constants.end());
      }
      pressure_nodes_[at] = entry->second;
      nodal_volume_[static_cast<std::size_t>(entry->second)] +=
          0.25 * reference_[(slot / lanes * 10 + 9) * lanes + slot % lanes];
    }
  }
  nodal_volume_change_.resize(nodal_volume_.size());
  nodal_pressure_.resize(nodal_volume_.size());
}

BlockView ElementBlock::view() {
  return {.nodes = nodes_.data(),
          .reference = reference_.data(),
          .constants = constants_.data(),
          .viscosity = viscosity_.data(),
          .memory = memory_.data(),
          .pressure_nodes = pressure_nodes_.data(),
          .nodal_volume_change = nodal_volume_change_.data(),
          .nodal_pressure = nodal_pressure_.data(),
          .nodal_volume = nodal_volume_.data(),
          .nodal_constants = nodal_constants_.data()};
}

std::size_t ElementBlock::bytes() const {
  return 8 * (reference_.size() + constants_.size() + viscosity_.size() + memory_.size() +
              4 * nodal_volume_.size() + nodal_constants_.size() + cell_.size()) +
         4 * (nodes_.size() + pressure_nodes_.size());
}

}  // namespace ocublast::solid
