#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace ocublast::solid {

/// Node numbers of one boundary facet, outward; the fourth is -1 for a triangle.
using Facet = std::array<std::int32_t, 4>;

/// Finite element mesh as read: nodes, cells per type with tissue ids, named sets.
struct SolidMesh {
  std::vector<double> nodes;             ///< [n_nodes, 3] reference positions, m
  std::vector<std::int32_t> hex8;        ///< [n_hex, 8], VTK order
  std::vector<std::int32_t> tet4;        ///< [n_tet, 4], VTK order
  std::vector<std::int32_t> hex_tissue;  ///< [n_hex] index into tissues
  std::vector<std::int32_t> tet_tissue;  ///< [n_tet]
  std::vector<std::string> tissues;
  std::map<std::string, std::vector<std::int32_t>> node_sets;
  std::map<std::string, std::vector<Facet>> face_sets;

  [[nodiscard]] std::size_t n_nodes() const { return nodes.size() / 3; }
  [[nodiscard]] std::size_t n_hex() const { return hex8.size() / 8; }
  [[nodiscard]] std::size_t n_tet() const { return tet4.size() / 4; }
  /// Cells are numbered hexes first, then tets.
  [[nodiscard]] std::size_t n_cells() const { return n_hex() + n_tet(); }
  [[nodiscard]] std::int32_t tissue_of(std::size_t cell) const {
    return cell < n_hex() ? hex_tissue[cell] : tet_tissue[cell - n_hex()];
  }
};

}  // namespace ocublast::solid
