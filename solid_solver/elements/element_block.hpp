#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "solid_solver/elements/kernel_table.hpp"
#include "solid_solver/fields/aligned.hpp"
#include "solid_solver/materials/material.hpp"
#include "solid_solver/mesh/solid_mesh.hpp"

namespace ocublast::solid {

enum class ElementType { hex8_q1p0, tet4_anp };

/// Coefficients of the bulk viscosity q = c1 rho c L rate - (c0 L)^2 rho rate^2 (the square in
/// compression only), rate = d(ln J)/dt, L = V/A_max (hex) or the smallest altitude (tet).
struct BulkViscosity {
  double linear = 0.06;
  double quadratic = 1.2;
};

/// Batches [begin, end) of a block that one thread assembles at a time.
struct Chunk {
  std::size_t block = 0;
  std::int64_t begin = 0;
  std::int64_t end = 0;
};

/// All elements of one type and one law, sorted along a space-filling curve and packed in batches
/// of 8 lanes. The last batch of a chunk is filled up with copies of weight zero.
class ElementBlock {
 public:
  struct Parts {
    const SolidMesh& mesh;
    std::span<const Material> materials;
    std::span<const std::int32_t> material_of_tissue;  ///< per tissue id, index into materials
    BulkViscosity viscosity;
    std::size_t chunk_elements = 128;
  };
  /// `cells` are numbered as in SolidMesh (hexes, then tets).
  ElementBlock(ElementType type, std::size_t law, std::size_t n_constants,
               std::vector<std::int64_t> cells, const Parts& parts);

  [[nodiscard]] BlockView view();
  [[nodiscard]] ElementType type() const { return type_; }
  [[nodiscard]] std::size_t law() const { return law_; }
  [[nodiscard]] std::int64_t n_batches() const {
    return static_cast<std::int64_t>(cell_.size() / 8);
  }
  [[nodiscard]] std::size_t n_elements() const { return n_elements_; }
  [[nodiscard]] std::size_t n_pressure_nodes() const { return nodal_volume_.size(); }
  /// Batch ranges, in order.
  [[nodiscard]] const std::vector<std::pair<std::int64_t, std::int64_t>>& chunks() const {
    return chunks_;
  }
  /// Cell number of a slot (8 batch + lane), -1 for a filler.
  [[nodiscard]] std::int64_t cell(std::size_t slot) const { return cell_[slot]; }
  /// Bulk viscosity's memory, [batch, 2, 8]; part of the state.
  [[nodiscard]] std::span<double> memory() { return memory_; }
  [[nodiscard]] AlignedVector<double>& nodal_volume_change() { return nodal_volume_change_; }
  [[nodiscard]] std::size_t bytes() const;

 private:
  void pack(const std::vector<std::int64_t>& cells, std::size_t chunk_elements);
  void fill_slot(std::size_t slot, std::int64_t cell, bool filler, const Parts& parts);
  void fill_hex(std::size_t slot, std::int64_t cell, bool filler, const Parts& parts);
  void fill_tet(std::size_t slot, std::int64_t cell, bool filler, const Parts& parts);
  void fill_material(std::size_t slot, const Material& material, double length,
                     const BulkViscosity& viscosity);
  void build_pressure_nodes(const Parts& parts);

  ElementType type_;
  std::size_t law_;
  std::size_t n_constants_;
  std::size_t n_elements_ = 0;
  std::vector<std::int64_t> cell_;
  std::vector<std::pair<std::int64_t, std::int64_t>> chunks_;
  AlignedVector<std::int32_t> nodes_;
  AlignedVector<double> reference_;
  AlignedVector<double> constants_;
  AlignedVector<double> viscosity_;
  AlignedVector<double> memory_;
  AlignedVector<std::int32_t> pressure_nodes_;
  AlignedVector<double> nodal_volume_;
  AlignedVector<double> nodal_volume_change_;
  AlignedVector<double> nodal_pressure_;
  AlignedVector<double> nodal_constants_;
};

/// Positions of a cell's nodes, m; `displacement` ([n, 4], may be null) is added.
template <std::size_t N>
[[nodiscard]] std::array<std::array<double, 3>, N> cell_positions(
    const SolidMesh& mesh, const std::int32_t* nodes, const double* displacement = nullptr) {
  std::array<std::array<double, 3>, N> x{};
  for (std::size_t a = 0; a < N; ++a)
    for (std::size_t i = 0; i < 3; ++i) {
      x[a][i] = mesh.nodes[3 * static_cast<std::size_t>(nodes[a]) + i];
      if (displacement != nullptr)
        x[a][i] += displacement[4 * static_cast<std::size_t>(nodes[a]) + i];
    }
  return x;
}

/// Length of the step rule of a cell, m: V/A_max of a hex, smallest altitude of a tet.
[[nodiscard]] double cell_length(const SolidMesh& mesh, std::size_t cell,
                                 const double* displacement = nullptr);
/// Reference volume of a cell, m^3.
[[nodiscard]] double cell_volume(const SolidMesh& mesh, std::size_t cell);
/// Mean of a cell's node positions in the reference state, m.
[[nodiscard]] std::array<double, 3> cell_centre(const SolidMesh& mesh, std::size_t cell);

}  // namespace ocublast::solid
