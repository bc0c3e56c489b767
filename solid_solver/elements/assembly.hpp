#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "solid_solver/elements/element_block.hpp"
#include "solid_solver/materials/law_factory.hpp"

namespace ocublast::solid {

struct AssemblyOptions {
  int threads = 1;
  InstructionSet instruction_set = InstructionSet::baseline;
  BulkViscosity viscosity;
  std::size_t chunk_elements = 128;
};

/// What a force computation found.
struct ForceReport {
  double viscous_work = 0.0;  ///< J dissipated by bulk viscosity since the last step
  bool bad = false;           ///< some element has J <= 0 or is not a number
};

/// Cell results, [n_cells, n_evaluated], cells numbered as in SolidMesh.
using CellResults = AlignedVector<double>;

/// Where and what the worst element is.
struct ElementPlace {
  std::size_t cell = 0;
  std::string tissue;
  std::array<double, 3> position{};  ///< current centre, m
  double jacobian = 0.0;             ///< smallest J in it
};

/// Internal forces of all elements. Chunks are coloured so that no two of one colour share a node;
/// colours run one after another and the order of additions at a node never changes: results do not
/// depend on the number of threads, to the last bit.
class Assembly {
 public:
  /// The mesh must stay alive. Preconditions: ids in range, positive Jacobians, material per
  /// tissue.
  Assembly(const SolidMesh& mesh, std::vector<Material> materials,
           std::vector<std::int32_t> material_of_tissue, const AssemblyOptions& options);

  /// Internal force [n_nodes, 4] (N) at displacement [n_nodes, 4] (m), overwritten. inverse_step >
  /// 0 adds bulk viscosity and advances its memory.
  ForceReport compute_force(std::span<const double> displacement, std::span<double> force,
                            double inverse_step);
  /// Stress, strain and energy per cell at the displacement.
  void evaluate(std::span<const double> displacement, CellResults& results);
  /// Lumped mass per node, kg (row sums of the consistent mass).
  [[nodiscard]] const std::vector<double>& nodal_mass() const { return mass_; }
  /// Smallest Jacobian and its place, for messages.
  [[nodiscard]] ElementPlace find_worst(std::span<const double> displacement);
  /// Smallest L/c and its cell in the current configuration: the element rule without its factor,
  /// s.
  [[nodiscard]] std::pair<double, std::size_t> smallest_transit(
      std::span<const double> displacement) const;

  [[nodiscard]] const SolidMesh& mesh() const { return mesh_; }
  [[nodiscard]] const Material& material_of_cell(std::size_t cell) const {
    return materials_[static_cast<std::size_t>(
        material_of_tissue_[static_cast<std::size_t>(mesh_.tissue_of(cell))])];
  }
  [[nodiscard]] std::vector<ElementBlock>& blocks() { return blocks_; }
  [[nodiscard]] std::size_t n_colours() const { return colours_.size(); }
  [[nodiscard]] int threads() const { return options_.threads; }
  [[nodiscard]] InstructionSet instruction_set() const { return options_.instruction_set; }
  [[nodiscard]] std::size_t bytes() const;

 private:
  void build_blocks();
  void build_colours();
  void build_mass();
  [[nodiscard]] const KernelTable& kernels(const ElementBlock& block) const {
    return laws_[block.law()].kernels[static_cast<std::size_t>(options_.instruction_set)];
  }
  void compute_nodal_pressures(const KernelStep& step);

  const SolidMesh& mesh_;
  std::vector<Material> materials_;
  std::vector<std::int32_t> material_of_tissue_;
  AssemblyOptions options_;
  std::vector<MaterialLaw> laws_;
  std::vector<ElementBlock> blocks_;
  std::vector<std::vector<Chunk>> colours_;
  std::vector<double> mass_;
  std::vector<KernelSums> sums_;  ///< per chunk in colour order
  bool has_tets_ = false;
};

}  // namespace ocublast::solid
