#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "coupler/base/case_common.hpp"
#include "coupler/base/case_reader.hpp"
#include "flow_solver/grid/make_grid.hpp"
#include "flow_solver/immersed/immersed_boundary.hpp"
#include "flow_solver/immersed/rigid_motion.hpp"
#include "flow_solver/io/probes.hpp"
#include "flow_solver/sources/kingery_bulmash.hpp"
#include "flow_solver/step.hpp"

namespace ocublast::flow::inline OCU_PRECISION {

enum class BodyMotion { fixed, prescribed, free, coupled };

/// A rigid body that the gas carries. Mass or density is given; center and inertia else follow from
/// the surface at uniform density.
struct FreeBodyCase {
  double mass = 0.0;     ///< kg
  double density = 0.0;  ///< kg/m^3
  bool center_given = false;
  std::array<double, 3> center{};    ///< m, of mass, on the reference shape
  std::vector<double> inertia;       ///< kg m^2 about it: xx, yy, zz, xy, yz, zx; empty: uniform
  std::array<double, 3> velocity{};  ///< m/s, at the start
  std::array<double, 3> angular_velocity{};  ///< rad/s, at the start
  std::array<double, 3> gravity{};           ///< m/s^2
  std::array<bool, 3> translates{true, true, true};
  std::array<bool, 3> rotates{true, true, true};
};

/// A plane wall across the whole domain that moves along a direction and replaces a face of the
/// domain; it moves by the law of its body.
struct PistonCase {
  std::size_t face = 0;   ///< x_min, x_max, y_min, ..
  double position = 0.0;  ///< m, at t = 0
};

struct BodyCase {
  std::string name;
  std::string solid;              ///< coupled: which of several moves it
  std::filesystem::path surface;  ///< may be empty for a coupled body: then the solid's own
  BodyMotion motion = BodyMotion::fixed;
  RigidPath path;
  FreeBodyCase free;
  WallSlip slip = WallSlip::slip;
  double wall_temperature = 0.0;     ///< K, 0: adiabatic
  std::optional<PistonCase> piston;  ///< the body is the piston of a face of the domain
};

enum class InitialKind { uniform, riemann };

struct GasState {
  double pressure = 0.0;             ///< Pa
  double temperature = 0.0;          ///< K
  std::array<double, 3> velocity{};  ///< m/s
};

/// Start of the gas before bursts are added.
struct InitialCase {
  InitialKind kind = InitialKind::uniform;
  int axis = 0;                  ///< of the Riemann problem
  double position = 0.0;         ///< m, of its interface
  double interface_width = 0.5;  ///< of the tanh across it, in cells
  GasState left, right;          ///< of its two sides; uniform: ambient at rest
};

/// A ball of hot gas at rest. Either its energy above ambient, or its pressure, is given.
struct BurstCase {
  std::string name;
  std::array<double, 3> center{};  ///< m
  double radius = 0.0;             ///< m
  double energy = 0.0;             ///< J above ambient; 0: pressure given
  double pressure = 0.0;           ///< Pa; 0: energy given
  double temperature = 0.0;        ///< K, of the ball
};

enum class ChargeSource {
  calibrated,      ///< TNT by its calibrated ball
  jwl,             ///< TNT by detonation and expansion of its products
  ball,            ///< ball of hot gas of given energy, radius and mass
  kingery_bulmash  ///< prescribed wave form, from outside only
};

/// A charge whose wave is computed in one dimension until its front comes near, then brought to the
/// grid.
struct ChargeCase {
  std::string name;
  ChargeSource source = ChargeSource::calibrated;
  BurstKind burst = BurstKind::free_air;
  std::array<double, 3> center{};  ///< m
  double mass = 0.0;               ///< kg of TNT; of the ball above ambient
  double energy = 0.0;             ///< J above ambient, of a ball
  double radius = 0.0;             ///< m, of a ball
  double start_radius = 0.0;       ///< m, of the front when it is brought to the grid; 0: chosen
};

struct FrontSpeed {
  std::string name, from, to;  ///< speed between the arrivals at two probes
};

/// Overpressure at the vertex of a body that is nearest to a point of its reference shape.
struct SurfaceProbe {
  std::string name;
  std::string body;
  std::array<double, 3> position{};  ///< m
};

struct OutputCase {
  double every = 0.0;            ///< s, 0: no fields
  double interface_every = 0.0;  ///< s, 0: none
};

/// Everything [flow] says.
struct FlowCase {
  CaseCommon common;
  std::array<AxisSpec, 3> axes;
  Geometry geometry = Geometry::cartesian;
  FlowOptions options;
  Boundaries boundaries;
  InitialCase initial;
  std::vector<BurstCase> bursts;
  std::vector<ChargeCase> charges;
  std::vector<BodyCase> bodies;
  ImmersedOptions immersed;
  std::vector<Probe> probes;
  std::vector<SurfaceProbe> surface_probes;
  std::vector<FrontSpeed> front_speeds;
  OutputCase output;
  Precision precision = Precision::double_precision;
  double quiet_overpressure = 1e-7;  ///< relative to ambient; a smaller load counts as none
  bool coupled = false;              ///< some body is moved by a solid
  std::vector<std::string> solids;   ///< of the case, in its order; one empty name: a single one
};

/// Declares and reads [case], [time], [ambient] and [flow]; faults are left with the reader.
[[nodiscard]] FlowCase read_flow_case(CaseReader& reader);

}  // namespace ocublast::flow
