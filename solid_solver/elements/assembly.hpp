#pragma once

#include <cstdint>
#include <functional>
#include <list>
#include <span>
#include <string>
#include <vector>

#include "solid_solver/elements/element_block.hpp"
#include "solid_solver/elements/task_rows.hpp"
#include "solid_solver/elements/task_shares.hpp"
#include "solid_solver/parallel/team.hpp"

namespace ocublast::solid {

struct AssemblyOptions {
  int threads = 1;
  InstructionSet instruction_set = InstructionSet::baseline;
  BulkViscosity viscosity;
  HourglassControl hourglass;
  std::size_t chunk_elements = 128;  ///< of hexes; others by the square of their nodes
  /// Element per tissue, for its cells of that element's shape; absent or empty: the shape's own.
  std::vector<std::string> element_of_tissue;
  bool skip_undeformed = true;  ///< leave out chunks whose nodes have not moved: same bits
};

/// What a force computation found.
struct ForceReport {
  double viscous_work = 0.0;      ///< J dissipated by bulk viscosity since the last step
  double overlay_work = 0.0;      ///< J of work on rate-dependent stress since the last step
  double hourglass_energy = 0.0;  ///< J stored now in hourglass stiffness
  bool bad = false;               ///< some element has J <= 0 or is not a number
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

/// The element whose own rule gives the smallest step.
struct StepBound {
  double transit = 0.0;  ///< length / sound speed, s
  double step = 0.0;     ///< the element's factor times it, s
  double length = 0.0;   ///< m
  std::size_t cell = 0;
};

/// "hex8 12 of sclera at (x, y, z) m".
[[nodiscard]] std::string describe_cell(const SolidMesh& mesh, std::size_t cell);

/// Internal forces of all elements. A chunk works on copies of its nodes' rows; consecutive chunks
/// along the curve make a task, which one thread runs from end to end. The tasks are the same for
/// any number of threads, and so is the order of additions at a node (see TaskRows): results do not
/// depend on the number of threads, to the last bit. Among ranks the elements at nodes that others
/// have as well come first; their sums travel while the other elements are computed.
class Assembly {
 public:
  /// The mesh must stay alive. Preconditions: ids in range, positive Jacobians, material per
  /// tissue, known elements. `part` is null where the mesh is whole; then nothing is collective.
  Assembly(const SolidMesh& mesh, std::vector<Material> materials,
           std::vector<std::int32_t> material_of_tissue, const AssemblyOptions& options,
           std::shared_ptr<const MeshPart> part = nullptr);
  Assembly(const Assembly&) = delete;
  Assembly& operator=(const Assembly&) = delete;

  /// Internal force [n_nodes, 4] (N) at displacement [n_nodes, 4] (m), overwritten. inverse_step >
  /// 0 adds bulk viscosity and overlays and advances their memory. `add_more` may add forces by
  /// nodes of this rank's own facets; they are summed over the ranks with the elements'.
  /// Collective; the report is this rank's.
  ForceReport compute_force(std::span<const double> displacement, std::span<double> force,
                            double inverse_step, const std::function<void()>& add_more = {});
  /// Stress, strain and energy per cell at the displacement. Collective.
  void evaluate(std::span<const double> displacement, CellResults& results);
  [[nodiscard]] Team& team() { return team_; }
  /// Lumped mass per node, kg.
  [[nodiscard]] const std::vector<double>& nodal_mass() const { return mass_; }
  /// Nodes that only plane elements use: they stay in their plane.
  [[nodiscard]] const std::vector<bool>& planar_nodes() const { return planar_; }
  /// Smallest Jacobian and its place among this rank's cells, for messages.
  [[nodiscard]] ElementPlace find_worst(std::span<const double> displacement);
  /// The step by the elements' own rules in the current configuration; of this rank's cells.
  [[nodiscard]] StepBound element_step(std::span<const double> displacement) const;
  /// Bound of the damping ratio of the highest mode (omega, rad/s) by viscous materials.
  [[nodiscard]] double viscous_damping_ratio(double omega) const;
  /// All chunks count as deformed until they are seen at rest again (after a resume).
  void wake_all();

  [[nodiscard]] const SolidMesh& mesh() const { return mesh_; }
  [[nodiscard]] const Material& material_of_cell(std::size_t cell) const {
    return materials_[static_cast<std::size_t>(
        material_of_tissue_[static_cast<std::size_t>(mesh_.tissue_of(cell))])];
  }
  [[nodiscard]] const ElementType& element_of(const Cell& cell) const {
    return *element_of_[static_cast<std::size_t>(cell.shape)]
                       [static_cast<std::size_t>(cell.tissue)];
  }
  [[nodiscard]] std::list<ElementBlock>& blocks() { return blocks_; }
  [[nodiscard]] std::size_t n_tasks() const { return tasks_.size(); }
  [[nodiscard]] std::size_t n_chunks() const { return chunks_.size(); }
  [[nodiscard]] std::size_t n_active_chunks() const;
  [[nodiscard]] int threads() const { return options_.threads; }
  [[nodiscard]] InstructionSet instruction_set() const { return options_.instruction_set; }
  [[nodiscard]] std::size_t bytes() const;

 private:
  /// A chunk of a block and where its sums go.
  struct Chunk {
    ElementBlock* block = nullptr;
    const ElementBlock::Chunk* range = nullptr;
    TaskRows* pressures = nullptr;  ///< nodal only, with the number of its use there
    std::size_t pressure_use = 0;
    bool active = false;
  };
  /// Chunks [begin, end), by one thread.
  struct Task {
    std::size_t begin = 0;
    std::size_t end = 0;
  };
  /// What a thread works in.
  struct Scratch {
    PointBuffer buffer;
    AlignedVector<double> rows;    ///< displacement (m) and pressure (Pa) of a chunk's nodes
    AlignedVector<double> forces;  ///< N; of the pressure pass: volume change, m^3
  };
  void choose_elements();
  void build_blocks();
  void build_tasks();
  void build_pressure_rows();
  void build_mass();
  void share_pressure_nodes();
  [[nodiscard]] const ElementKernels& element_kernels(const ElementBlock& block) const {
    return block.type().kernels[static_cast<std::size_t>(options_.instruction_set)];
  }
  [[nodiscard]] const LawKernels& law_kernels(const ElementBlock& block) const {
    return block.law().kernels[static_cast<std::size_t>(options_.instruction_set)];
  }
  [[nodiscard]] bool moved(const Chunk& chunk, const double* displacement) const;
  [[nodiscard]] bool deformed(const Chunk& chunk, const double* displacement) const;
  enum class Exchange { none, all };
  void compute_nodal_pressures(const double* displacement, Exchange exchange);
  void share_out_tasks();
  void add_volumes(TaskShares& tasks, const double* displacement);
  void run_tasks(TaskShares& tasks, bool border, const double* displacement, double* force,
                 double inverse_step);
  void fetch_rows(const Chunk& chunk, const double* displacement, Scratch& scratch) const;
  void prefetch_rows(std::size_t chunk, const double* displacement) const;
  void evaluate(std::span<const double> displacement, CellResults& results, Exchange exchange);
  void evaluate_chunk(const Chunk& chunk, Scratch& scratch, std::span<double> out,
                      CellResults& results) const;
  void run_chunk(const Chunk& chunk, double inverse_step, Scratch& scratch, KernelSums& sums) const;

  const SolidMesh& mesh_;
  std::vector<Material> materials_;
  std::vector<std::int32_t> material_of_tissue_;
  AssemblyOptions options_;
  std::vector<MaterialLaw> laws_;
  std::vector<ElementType> elements_;
  std::array<std::vector<const ElementType*>, n_shapes> element_of_;  ///< per shape and tissue
  std::list<ElementBlock> blocks_;
  Team team_;
  std::vector<Chunk> chunks_;
  std::vector<Task> tasks_;
  std::size_t n_border_tasks_ = 0;  ///< the first of them
  /// Of one force computation: the border tasks and the others, once for each pass.
  struct Shares {
    explicit Shares(int threads) : border(threads), others(threads) {}
    TaskShares border;
    TaskShares others;
  };
  Shares volume_shares_;
  Shares force_shares_;
  TaskRows force_rows_;
  std::list<TaskRows> pressure_rows_;  ///< per block that averages at nodes
  struct SharedPressures {
    ElementBlock* block;
    SharedValues values;
  };
  std::vector<SharedPressures> shared_pressures_;
  std::vector<double> mass_;
  std::vector<bool> planar_;
  std::vector<KernelSums> sums_;                             ///< per chunk
  std::vector<Scratch, AlignedAllocator<Scratch>> scratch_;  ///< per thread
  bool has_nodal_ = false;
};

}  // namespace ocublast::solid
