#pragma once

#include <filesystem>

#include "solid_solver/mesh/solid_mesh.hpp"

namespace ocublast::solid {

/// Reads a mesh file (HDF5, attributes format = "ocublast-mesh", version = 1). Throws CaseError for
/// a file of another kind or with arrays of the wrong shape; contents are checked by check_mesh.
[[nodiscard]] SolidMesh read_mesh(const std::filesystem::path& file);

/// Writes the same format.
void write_mesh(const std::filesystem::path& file, const SolidMesh& mesh);

}  // namespace ocublast::solid
