#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "solid_solver/parallel/whole_state.hpp"

namespace ocublast::solid {

/// Writes OUT/solid.xmf and OUT/solid/NNNN.h5: a temporal collection on the deforming mesh. Each
/// HDF5 file is closed before the XDMF names it, and the XDMF is replaced at once, so a viewer or a
/// crash never meets half a step. Topology and tissue ids stand once in solid/mesh.h5.
class FieldOutput {
 public:
  FieldOutput(std::filesystem::path out, std::vector<std::string> fields);

  void write(const StateView& state);
  /// On ranks that do not write: notes that another does.
  void skip(double time) { times_.push_back(time); }
  /// Times written so far, s; for checkpoints.
  [[nodiscard]] const std::vector<double>& times() const { return times_; }
  /// Goes on after these times; later files are written over.
  void restore(std::vector<double> times) { times_ = std::move(times); }

 private:
  void write_mesh_file(const SolidMesh& mesh);
  void write_step(const std::filesystem::path& file, const StateView& state) const;
  [[nodiscard]] std::string grid(const SolidMesh& mesh, std::size_t step,
                                 const ShapeInfo& shape) const;
  [[nodiscard]] std::string document(const SolidMesh& mesh) const;

  std::filesystem::path out_;
  std::vector<std::string> fields_;
  std::vector<double> times_;
};

}  // namespace ocublast::solid
