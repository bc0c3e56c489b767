#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "solid_solver/mesh/cell_shape.hpp"

namespace ocublast::solid {

/// Node numbers of one boundary facet, outward; the fourth is -1 for a triangle, the third as well
/// for an edge of a plane mesh (cells counter-clockwise, edges as the cells run through them).
using Facet = std::array<std::int32_t, 4>;

/// Cells of one shape.
struct Cells {
  std::vector<std::int32_t> nodes;   ///< [n, nodes of the shape], VTK order
  std::vector<std::int32_t> tissue;  ///< [n] index into tissues
  std::vector<std::int32_t> number;  ///< [n] in the mesh file, where this is a part of it; or empty
};

/// One cell of a mesh.
struct Cell {
  Shape shape = Shape::hex8;
  std::size_t index = 0;  ///< among the cells of its shape in the mesh file
  std::span<const std::int32_t> nodes;
  std::int32_t tissue = 0;
};

/// Finite element mesh as read: nodes, cells per shape with tissue ids, named sets.
struct SolidMesh {
  std::vector<double> nodes;  ///< [n_nodes, 3] reference positions, m
  std::array<Cells, n_shapes> cells;
  std::vector<std::string> tissues;
  std::map<std::string, std::vector<std::int32_t>> node_sets;
  std::map<std::string, std::vector<Facet>> face_sets;
  /// Two unit vectors per cell, [n_cells, 6], for laws with fibres; may be empty.
  std::vector<double> fibres;

  [[nodiscard]] Cells& of(Shape shape) { return cells[static_cast<std::size_t>(shape)]; }
  [[nodiscard]] const Cells& of(Shape shape) const {
    return cells[static_cast<std::size_t>(shape)];
  }
  [[nodiscard]] std::size_t n_nodes() const { return nodes.size() / 3; }
  [[nodiscard]] std::size_t count(Shape shape) const {
    return of(shape).nodes.size() / info(shape).n_nodes;
  }
  /// Cells are numbered shape after shape.
  [[nodiscard]] std::size_t n_cells() const {
    std::size_t n = 0;
    for (const auto& s : shapes) n += count(s.shape);
    return n;
  }
  [[nodiscard]] std::size_t first_cell(Shape shape) const {
    std::size_t n = 0;
    for (std::size_t s = 0; s < static_cast<std::size_t>(shape); ++s) n += count(shapes[s].shape);
    return n;
  }
  [[nodiscard]] Cell cell(std::size_t number) const {
    std::size_t s = 0;
    while (number >= count(shapes[s].shape)) number -= count(shapes[s++].shape);
    const std::size_t n = shapes[s].n_nodes;
    return {.shape = shapes[s].shape,
            .index = cells[s].number.empty() ? number
                                             : static_cast<std::size_t>(cells[s].number[number]),
            .nodes = {cells[s].nodes.data() + n * number, n},
            .tissue = cells[s].tissue[number]};
  }
  [[nodiscard]] std::int32_t tissue_of(std::size_t number) const { return cell(number).tissue; }
};

}  // namespace ocublast::solid
