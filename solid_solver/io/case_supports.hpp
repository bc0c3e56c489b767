#pragma once

#include <string>
#include <vector>

#include "coupler/base/case_reader.hpp"
#include "solid_solver/step.hpp"

namespace ocublast::solid {

/// Resolves names of sets against the mesh and notes what is missing.
class SetNames {
 public:
  explicit SetNames(const SolidMesh& mesh) : mesh_(mesh) {}
  [[nodiscard]] std::vector<std::int32_t> nodes(Section& section, std::string_view key,
                                                const std::string& name) const;
  [[nodiscard]] std::vector<Facet> facets(Section& section, std::string_view key,
                                          const std::string& name) const;
  [[nodiscard]] const SolidMesh& mesh() const { return mesh_; }

 private:
  const SolidMesh& mesh_;
};

/// A text key, e.g. the name of a set.
[[nodiscard]] std::string read_name(Section& section, const char* key, bool required,
                                    const char* help);
/// times_s and the values of a schedule.
[[nodiscard]] Schedule read_schedule(Section& section, const char* values_key, const char* unit,
                                     const char* help);

/// [[solid.fixed]], prescribed, symmetry, tie, spring, wall, contact: how the body is held.
void read_supports(Section& solid, const SetNames& names, SolidSetup& setup);
/// [[solid.pressure]], gravity, force: what acts on it.
void read_loads(Section& solid, const SetNames& names, SolidSetup& setup);
/// Two prescriptions of one node and direction contradict each other: noted as faults.
void check_supports(Section& solid, const SolidSetup& setup);

}  // namespace ocublast::solid
