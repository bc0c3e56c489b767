#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "coupler/base/case_common.hpp"
#include "coupler/base/case_reader.hpp"
#include "solid_solver/materials/law_factory.hpp"
#include "solid_solver/step.hpp"

namespace ocublast::solid {

/// One [[solid.history]]: a tissue, the cell nearest to a place, or a node set.
struct HistoryKeys {
  std::string name;
  std::string tissue;
  std::vector<double> position;  ///< [3] m
  std::string nodes;
};

struct OutputKeys {
  double every = 0.0;             ///< s between field outputs
  double history_every = 0.0;     ///< s between rows of tables
  double running_mean = 50e-6;    ///< s, width of the running mean of pressures
  double checkpoint_every = 0.0;  ///< s, stand-alone runs; 0: none
  std::vector<std::string> fields;
};

/// [solid.initial]: relaxation to an equilibrium before the start.
struct EquilibriumKeys {
  bool wanted = false;
  double tolerance = 1e-4;
  int most_steps = 200000;
};

/// What a case says of the solid, read and checked; names are resolved against the mesh.
struct SolidCase {
  CaseCommon common;
  SolidSetup setup;
  /// The mesh as read; the set-up's own is a part of it among several ranks. Null on ranks but the
  /// root then.
  std::shared_ptr<const SolidMesh> whole_mesh;
  double imbalance = 1.0;  ///< cost of the dearest rank over the mean
  std::string interface;   ///< face set of the coupled surface; empty when there is none
  bool coupled = false;    ///< the case has [coupling]
  OutputKeys output;
  EquilibriumKeys equilibrium;
  std::vector<HistoryKeys> histories;
  struct InitialVelocity {
    std::vector<std::int32_t> nodes;
    std::array<double, 3> velocity{};  ///< m/s
  };
  std::vector<InitialVelocity> initial_velocities;
};

/// Declares and reads every key of [solid]. All faults of keys, mesh and names are gathered in the
/// reader; the caller ends with reader.finish(), which throws them together.
[[nodiscard]] SolidCase read_solid_case(CaseReader& reader);

}  // namespace ocublast::solid
