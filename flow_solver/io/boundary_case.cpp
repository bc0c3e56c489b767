#include "flow_solver/io/boundary_case.hpp"

#include <fmt/format.h>

#include <cmath>

#include "coupler/base/errors.hpp"
#include "flow_solver/boundary/inflow_table.hpp"

namespace ocublast::flow::inline OCU_PRECISION {
namespace {

constexpr std::array<std::string_view, 6> face_names = {"x_min", "x_max", "y_min",
                                                        "y_max", "z_min", "z_max"};

/// What a face is called in a case; some words share a kind.
enum class FaceWord {
  symmetry,
  slip_wall,
  no_slip_wall,
  outflow,
  fixed_state,
  supersonic_inflow,
  subsonic_inflow,
  reservoir,
  periodic,
  piston
};
constexpr std::pair<std::string_view, FaceWord> face_words[] = {
    {"symmetry", FaceWord::symmetry},
    {"slip_wall", FaceWord::slip_wall},
    {"no_slip_wall", FaceWord::no_slip_wall},
    {"outflow", FaceWord::outflow},
    {"fixed_state", FaceWord::fixed_state},
    {"supersonic_inflow", FaceWord::supersonic_inflow},
    {"subsonic_inflow", FaceWord::subsonic_inflow},
    {"reservoir", FaceWord::reservoir},
    {"periodic", FaceWord::periodic},
    {"piston", FaceWord::piston}};

BoundaryKind kind_of(FaceWord word, const Wall& wall) {
  switch (word) {
    case FaceWord::no_slip_wall:
      return BoundaryKind::wall;
    case FaceWord::slip_wall:
      return wall.temperature > 0.0 ? BoundaryKind::wall : BoundaryKind::symmetry;
    case FaceWord::outflow:
      return BoundaryKind::outflow;
    case FaceWord::fixed_state:
    case FaceWord::supersonic_inflow:
      return BoundaryKind::fixed_state;
    case FaceWord::subsonic_inflow:
      return BoundaryKind::subsonic_inflow;
    case FaceWord::reservoir:
      return BoundaryKind::reservoir;
    case FaceWord::periodic:
      return BoundaryKind::periodic;
    case FaceWord::symmetry:
    case FaceWord::piston:
      break;  // what lies behind a piston is covered by its body
  }
  return BoundaryKind::symmetry;
}

bool is_wall(FaceWord word) {
  return word == FaceWord::slip_wall || word == FaceWord::no_slip_wall;
}
bool takes_table(FaceWord word) {
  return word == FaceWord::fixed_state || word == FaceWord::supersonic_inflow ||
         word == FaceWord::subsonic_inflow || word == FaceWord::reservoir;
}

struct Face {
  std::size_t index;
  FaceWord word;
  [[nodiscard]] std::size_t axis() const { return index / 2; }
  [[nodiscard]] double inwards() const { return index % 2 == 0 ? 1.0 : -1.0; }
  [[nodiscard]] std::string_view name() const { return face_names[index]; }
};

void read_wall(Section& table, const Face& face, FlowCase& result) {
  const std::string name = fmt::format("{}_wall", face.name());
  auto keys = table.table(name, "a wall's temperature, and its motion along itself");
  Wall& wall = result.boundaries[face.index].wall;
  wall.slip = face.word == FaceWord::slip_wall;
  keys.real("temperature_K", wall.temperature, {.unit = "K", .min = 0.0, .help = "0: adiabatic"});
  keys.real3("velocity_m_s", wall.velocity,
             {.unit = "m/s", .help = "no_slip_wall: along the wall"});
  if (table.listing()) return;
  if (keys.present() && !is_wall(face.word))
    table.fault(name, "only slip_wall and no_slip_wall have a wall");
  const bool inviscid = result.options.viscosity == Viscosity::none;
  if (face.word == FaceWord::no_slip_wall && inviscid)
    table.fault(face.name(),
                "a no_slip_wall needs flow.gas.viscosity; take slip_wall for an inviscid gas");
  if (wall.temperature > 0.0 && inviscid)
    keys.fault("temperature_K",
               "an isothermal wall needs flow.gas.viscosity, from which the conductivity follows");
  if (wall.velocity[face.axis()] != 0.0)
    keys.fault(
        "velocity_m_s",
        fmt::format("the component along {} is {} m/s: a wall moves along itself; take piston",
                    "xyz"[face.axis()], wall.velocity[face.axis()]));
  if (wall.slip && wall.velocity != std::array<double, 3>{})
    keys.fault("velocity_m_s", "a slip_wall does not drag the gas; take no_slip_wall");
}

/// Faults of an inflow at one speed along the inward normal.
void check_inflow(Section& table, std::string_view key, const Face& face, double speed,
                  double sound) {
  const bool supersonic = face.word == FaceWord::supersonic_inflow;
  if (supersonic && speed < sound)
    table.fault(
        key,
        fmt::format("{} m/s into the domain, sound {:.6g} m/s: supersonic_inflow needs more; take "
                    "subsonic_inflow or reservoir",
                    speed, sound));
  if (face.word == FaceWord::subsonic_inflow && (speed <= 0.0 || speed >= sound))
    table.fault(key,
                fmt::format("{} m/s into the domain, accepted (0, {:.6g}) m/s for subsonic_inflow",
                            speed, sound));
  if (face.word == FaceWord::reservoir && speed != 0.0)
    table.fault(key, fmt::format("{} m/s into the domain: gas in a reservoir is at rest", speed));
}

void read_table(Section& table, const Face& face, FlowCase& result) {
  const std::string name = fmt::format("{}_table", face.name());
  std::filesystem::path file;
  table.file(
      name, file,
      {.help = "inflow in time: CSV of time_s,pressure_Pa,temperature_K,speed_m_s (inwards)"});
  if (table.listing() || file.empty()) return;
  if (!takes_table(face.word)) {
    table.fault(name, "only inflows and reservoirs follow a table");
    return;
  }
  std::array<double, 3> inwards{};
  inwards[face.axis()] = face.inwards();
  try {
    const auto gas =
        std::make_shared<InflowTable>(read_inflow_points(file), result.options.gas, inwards);
    for (const InflowPoint& p : gas->points())
      check_inflow(table, name, face, p.speed, sound_speed(result.options.gas, p.temperature));
    result.boundaries[face.index].incoming = gas;
  } catch (const CaseError& error) {
    table.fault(name, error.what());
  }
}

void read_piston(Section& table, const Face& face, FlowCase& result) {
  const std::string name = fmt::format("{}_piston", face.name());
  auto keys = table.table(
      name,
      "a plane wall across the domain: s(t) = position + velocity t + amplitude (1 - cos(w t))");
  PistonCase piston{.face = face.index};
  RigidPath path;
  const std::size_t a = face.axis();
  keys.real("position_m", piston.position,
            {.unit = "m",
             .required = face.word == FaceWord::piston && !table.listing(),
             .help = "place at t = 0"});
  keys.real("velocity_m_s", path.velocity[a],
            {.unit = "m/s", .help = "constant part, along the axis"});
  keys.real("amplitude_m", path.amplitude[a],
            {.unit = "m", .help = "of the oscillation, along the axis"});
  keys.real("angular_frequency_1_s", path.angular_frequency,
            {.unit = "1/s", .min = 0.0, .help = "w"});
  if (table.listing()) return;
  if (face.word != FaceWord::piston) {
    if (keys.present()) table.fault(name, fmt::format("{} is no piston", face.name()));
    return;
  }
  const AxisSpec& axis = result.axes[a];
  if (piston.position <= axis.min || piston.position >= axis.max)
    keys.fault(
        "position_m",
        fmt::format("is {} m, accepted ({}, {}) m: the cells behind it must reach as far as it "
                    "ever recedes",
                    piston.position, axis.min, axis.max));
  if ((face.index % 2 == 0 ? axis.low : axis.high).cells > 0)
    table.fault(
        face.name(),
        fmt::format("a piston cannot stand in the stretched layer of flow.grid.{}", "xyz"[a]));
  if (result.geometry != Geometry::cartesian)
    table.fault(face.name(), "a piston needs flow.grid.geometry = \"cartesian\"");
  result.bodies.push_back({.name = fmt::format("piston_{}", face.name()),
                           .motion = BodyMotion::prescribed,
                           .path = path,
                           .piston = piston});
}

}  // namespace

GasState read_gas_state(Section state, const CaseCommon& common) {
  GasState gas{.pressure = common.ambient_pressure,
               .temperature = common.ambient_temperature,
               .velocity = {}};
  state.real("pressure_Pa", gas.pressure, positive_key("Pa", "absolute pressure"));
  state.real("temperature_K", gas.temperature, positive_key("K", "temperature"));
  state.real3("velocity_m_s", gas.velocity, {.unit = "m/s", .help = "velocity"});
  return gas;
}

State to_state(const GasState& gas, const Gas& law) {
  return {.rho = density(law, gas.pressure, gas.temperature),
          .u = gas.velocity[0],
          .v = gas.velocity[1],
          .w = gas.velocity[2],
          .p = gas.pressure};
}

void read_boundaries(Section& flow, FlowCase& result) {
  auto table = flow.table("boundary", "the six faces of the domain");
  for (std::size_t f = 0; f < face_names.size(); ++f) {
    auto& boundary = result.boundaries[f];
    Face face{f, FaceWord::outflow};
    const bool present = table.listing() || result.axes[f / 2].present;
    if (!present) {
      if (table.has(face.name()))
        table.fault(face.name(), "this direction is absent from flow.grid");
      continue;
    }
    table.choice(face.name(), face.word, face_words,
                 {.required = true, .help = "what lies beyond this face"});
    const std::string state_name = fmt::format("{}_state", face.name());
    const GasState gas = read_gas_state(
        table.table(state_name, "gas beyond the face; ambient at rest if left out"), result.common);
    boundary.state = to_state(gas, result.options.gas);
    read_wall(table, face, result);
    read_table(table, face, result);
    read_piston(table, face, result);
    boundary.kind = kind_of(face.word, boundary.wall);
    if (!table.listing() && boundary.incoming == nullptr)
      check_inflow(table, state_name, face, face.inwards() * gas.velocity[face.axis()],
                   sound_speed(result.options.gas, gas.temperature));
  }
  if (table.listing()) return;
  for (std::size_t f = 0; f < face_names.size(); ++f) {
    if (!result.bodies.empty() && result.axes[f / 2].present &&
        result.boundaries[f].kind == BoundaryKind::periodic)
      table.fault(face_names[f], "a piston in a domain with a periodic direction");
  }
  if (result.geometry != Geometry::cartesian && result.axes[0].present &&
      (result.axes[0].min == 0.0) !=
          (result.boundaries[0].kind == BoundaryKind::symmetry && result.axes[0].min == 0.0))
    table.fault("x_min", "x is a radius that starts at 0: x_min must be symmetry");
  for (std::size_t a = 0; a < 3; ++a) {
    const bool low = result.boundaries[2 * a].kind == BoundaryKind::periodic;
    const bool high = result.boundaries[2 * a + 1].kind == BoundaryKind::periodic;
    if (result.axes[a].present && low != high)
      table.fault(face_names[2 * a], "periodic needs the opposite face to be periodic as well");
    result.axes[a].periodic = low && high;
    if (low && high && (result.axes[a].low.cells > 0 || result.axes[a].high.cells > 0))
      table.fault(face_names[2 * a], "a periodic direction takes no stretched layers");
  }
}

}  // namespace ocublast::flow
