#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "solid_solver/elements/element_type.hpp"
#include "solid_solver/fields/aligned.hpp"
#include "solid_solver/materials/law_factory.hpp"
#include "solid_solver/materials/material.hpp"
#include "solid_solver/mesh/solid_mesh.hpp"

namespace ocublast::solid {

/// Coefficients of the bulk viscosity q = c1 rho c L rate - (c0 L)^2 rho rate^2 (the square in
/// compression only), rate = d(ln J)/dt, L the element's length.
struct BulkViscosity {
  double linear = 0.06;
  double quadratic = 1.2;
};

/// Hourglass stiffness of one-point elements, as a part of the physical one by the shear modulus
/// (1: bending modes of a parallelepiped as stiff as fully integrated), and the least modulus it
/// takes, in parts of the bulk modulus (liquids have no shear modulus of their own).
struct HourglassControl {
  double coefficient = 1.0;
  double least_modulus = 1e-6;
};

/// All elements of one type and one law, sorted along a space-filling curve and packed in batches
/// of 8 lanes. Chunks of batches number their own nodal rows, so that kernels gather from and
/// scatter to what fits in the first-level cache; neighbours along the curve lie in neighbouring
/// batches, so that those of one batch rarely wait for each other's additions. The last lanes of a
/// chunk are filled up with copies of weight zero.
class ElementBlock {
 public:
  struct Chunk {
    std::int64_t begin = 0;  ///< batches
    std::int64_t end = 0;
    std::size_t first_row = 0;  ///< its rows in row_nodes and row_pressures
    std::size_t n_rows = 0;
  };
  struct Parts {
    const SolidMesh& mesh;
    std::span<const Material> materials;
    std::span<const std::int32_t> material_of_tissue;  ///< per tissue id, index into materials
    BulkViscosity viscosity;
    HourglassControl hourglass;
    std::size_t chunk_elements = 128;  ///< of hexes; others by the square of their nodes
    /// [n_cells] Cells at nodes shared with other ranks go first, in chunks of their own; or empty.
    std::span<const std::uint8_t> at_border;
  };
  /// `cells` are numbered as in SolidMesh. Prony terms are as many as any material here has.
  ElementBlock(const ElementType& type, const MaterialLaw& law, std::vector<std::int64_t> cells,
               const Parts& parts);

  [[nodiscard]] BlockView view();
  [[nodiscard]] const ElementType& type() const { return type_; }
  [[nodiscard]] const MaterialLaw& law() const { return law_; }
  [[nodiscard]] bool rate_dependent() const { return rate_dependent_; }
  [[nodiscard]] std::int64_t n_batches() const {
    return static_cast<std::int64_t>(cell_.size() / batch_lanes);
  }
  /// Batches that go through the buffer at a time.
  [[nodiscard]] std::int64_t group() const {
    return std::max<std::int64_t>(1, buffer_points / static_cast<std::int64_t>(type_.n_points));
  }
  [[nodiscard]] std::size_t n_elements() const { return n_elements_; }
  [[nodiscard]] std::size_t n_pressure_nodes() const { return nodal_volume_.size(); }
  [[nodiscard]] const std::vector<Chunk>& chunks() const { return chunks_; }
  /// Node of each row of a chunk, ascending; twice where two materials average their pressures.
  [[nodiscard]] std::span<const std::int32_t> row_nodes(const Chunk& chunk) const {
    return {row_nodes_.data() + chunk.first_row, chunk.n_rows};
  }
  /// Nodal only: pressure node of each row.
  [[nodiscard]] std::span<const std::int32_t> row_pressures(const Chunk& chunk) const {
    return {row_pressures_.data() + chunk.first_row, chunk.n_rows};
  }
  /// The first of them: those of cells at the border to other ranks.
  [[nodiscard]] std::size_t n_border_chunks() const { return n_border_chunks_; }
  /// Cell number of a slot (8 batch + lane), -1 for a filler.
  [[nodiscard]] std::int64_t cell(std::size_t slot) const { return cell_[slot]; }
  /// Bulk viscosity's memory, [batch, 2, 8], and the overlays' state: part of the run's state.
  [[nodiscard]] std::span<double> memory() { return memory_; }
  [[nodiscard]] std::span<double> overlay_state() { return overlay_state_; }
  [[nodiscard]] AlignedVector<double>& nodal_volume_change() { return nodal_volume_change_; }
  [[nodiscard]] std::span<double> nodal_volume() { return nodal_volume_; }
  /// Node and material of a pressure node, sorted.
  struct PressureNode {
    std::int32_t node;
    std::int32_t material;
    std::int32_t number;
  };
  [[nodiscard]] std::vector<PressureNode> pressure_nodes_in_order() const;
  [[nodiscard]] std::span<const double> nodal_pressure() const { return nodal_pressure_; }
  [[nodiscard]] std::size_t bytes() const;

 private:
  void pack(std::span<const std::int64_t> cells, std::size_t chunk_elements);
  void fill_slot(std::size_t slot, std::int64_t cell, bool filler, const Parts& parts);
  void fill_material(std::size_t slot, const Material& material, double length,
                     const BulkViscosity& viscosity);
  void fill_fields(std::size_t slot, std::int64_t cell, const Parts& parts);
  void fill_overlay(std::size_t slot, const Material& material);
  void build_rows(const Parts& parts);
  std::vector<std::int64_t> number_pressure_nodes(const Parts& parts);

  const ElementType& type_;
  const MaterialLaw& law_;
  std::size_t n_elements_ = 0;
  std::size_t n_terms_ = 0;
  bool rate_dependent_ = false;
  std::vector<std::int64_t> cell_;
  std::vector<std::int64_t> cell_of_slot_;  ///< while it is built: the cell that fillers copy too
  std::vector<Chunk> chunks_;
  std::vector<std::int32_t> row_nodes_;
  std::vector<std::int32_t> row_pressures_;
  std::size_t n_border_chunks_ = 0;
  AlignedVector<std::uint16_t> nodes_;
  AlignedVector<double> reference_;
  AlignedVector<double> constants_;
  AlignedVector<double> viscosity_;
  AlignedVector<double> memory_;
  AlignedVector<double> overlay_parameters_;
  AlignedVector<double> overlay_state_;
  std::vector<std::array<std::int32_t, 2>> pressure_node_of_;  ///< (node, material)
  AlignedVector<double> nodal_volume_;
  AlignedVector<double> nodal_volume_change_;
  AlignedVector<double> nodal_pressure_;
  AlignedVector<double> nodal_constants_;
};

}  // namespace ocublast::solid
