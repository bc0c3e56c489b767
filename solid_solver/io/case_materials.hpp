#pragma once

#include <span>
#include <string>
#include <vector>

#include "coupler/base/case_reader.hpp"
#include "solid_solver/materials/material.hpp"
#include "solid_solver/mesh/solid_mesh.hpp"

namespace ocublast::solid {

/// Materials of a case and the tissues each is for.
struct MaterialKeys {
  std::vector<Material> materials;
  std::vector<std::vector<std::string>> tissues;  ///< per material
};

/// Reads [[solid.material]]: name, tissues, law, density and the law's own constants. A bulk
/// modulus may be given by the sound speed c instead: K = rho c^2 - 4 G / 3.
[[nodiscard]] MaterialKeys read_materials(Section& solid);

/// Material per tissue of the mesh (-1 where none, noted as a fault).
[[nodiscard]] std::vector<std::int32_t> assign_materials(Section& solid, const MaterialKeys& keys,
                                                         const std::vector<std::string>& tissues);

/// Notes tissues whose law needs fibre directions that the mesh does not have, or has not as unit
/// vectors. Tissues without a material (-1) are passed over.
void check_fibres(Section& solid, const std::vector<Material>& materials,
                  std::span<const std::int32_t> material_of_tissue, const SolidMesh& mesh);

}  // namespace ocublast::solid
