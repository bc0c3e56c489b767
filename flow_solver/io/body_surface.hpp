#pragma once

#include <filesystem>

#include "flow_solver/grid/precision.hpp"
#include "flow_solver/immersed/immersed_boundary.hpp"

namespace ocublast::flow::inline OCU_PRECISION {

/// Triangles of a surface file in the project's HDF5 mesh format (cells/tri3, else face_sets/wet of
/// a volume mesh with its quads cut in two). Throws CaseError that names the file.
[[nodiscard]] BodySurface read_body_surface(const std::filesystem::path& file);

}  // namespace ocublast::flow
