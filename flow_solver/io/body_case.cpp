#include "flow_solver/io/body_case.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace ocublast::flow::inline OCU_PRECISION {
namespace {

void read_path(Section& body, FlowCase& result, RigidPath& path) {
  auto table = body.table(
      "path",
      "x(t) = X + velocity t + amplitude (1 - cos(w t)), the same for an angle, and a table");
  table.real3("velocity_m_s", path.velocity, {.unit = "m/s", .help = "constant velocity"});
  table.real3("amplitude_m", path.amplitude, {.unit = "m", .help = "amplitude"});
  table.real("angular_frequency_1_s", path.angular_frequency,
             {.unit = "1/s", .min = 0.0, .help = "w"});
  table.real3("rotation_axis", path.rotation_axis,
              {.unit = "1", .help = "direction of the axis it turns about"});
  table.real3("rotation_center_m", path.rotation_center,
              {.unit = "m", .help = "point of the body on that axis"});
  table.real("angular_velocity_rad_s", path.angular_velocity,
             {.unit = "rad/s", .help = "constant turning"});
  table.real("angle_amplitude_rad", path.angle_amplitude,
             {.unit = "rad", .help = "amplitude of the angle"});
  std::filesystem::path file;
  table.file("table", file,
             {.help = "csv file time_s,x_m,y_m,z_m,angle_rad, added to the above by splines"});
  if (table.listing()) return;
  if (!file.empty()) {
    try {
      path.table = read_motion_table(file);
    } catch (const std::exception& error) {
      table.fault("table", error.what());
    }
    if (!path.table.empty() &&
        (path.table.first_time() > 0.0 || path.table.last_time() < result.common.end_time))
      table.fault("table", fmt::format("covers {} s to {} s, the run 0 to {} s; add rows",
                                       path.table.first_time(), path.table.last_time(),
                                       result.common.end_time));
  }
  const auto& axis = path.rotation_axis;
  const bool turns = path.angular_velocity != 0.0 || path.angle_amplitude != 0.0;
  if (turns && axis[0] == 0.0 && axis[1] == 0.0 && axis[2] == 0.0)
    table.fault("rotation_axis", "missing: a body that turns needs the direction of its axis");
  for (std::size_t a = 0; a < 3; ++a) {
    if (result.axes[a].present) continue;
    if (path.velocity[a] != 0.0 || path.amplitude[a] != 0.0)
      table.fault("velocity_m_s",
                  fmt::format("moves along {}, which flow.grid leaves out", "xyz"[a]));
    if (turns && (axis[(a + 1) % 3] != 0.0 || axis[(a + 2) % 3] != 0.0))
      table.fault("rotation_axis",
                  fmt::format("must be along {}, which flow.grid leaves out", "xyz"[a]));
  }
}

void read_free(Section& body, FreeBodyCase& free) {
  auto table = body.table("free", "a rigid body carried by the gas");
  table.real("mass_kg", free.mass,
             {.unit = "kg", .min = 0.0, .help = "mass of the whole body, or its density"});
  table.real("density_kg_m3", free.density,
             {.unit = "kg/m^3", .min = 0.0, .help = "uniform density, or the mass"});
  free.center_given = table.has("center_of_mass_m");
  table.real3("center_of_mass_m", free.center,
              {.unit = "m", .help = "on the reference shape; uniform density if left out"});
  table.reals(
      "inertia_kg_m2", free.inertia,
      {.unit = "kg m^2",
       .help =
           "xx, yy, zz, xy, yz, zx of the tensor about the center; uniform density if left out"});
  table.real3("velocity_m_s", free.velocity, {.unit = "m/s", .help = "at the start"});
  table.real3("angular_velocity_rad_s", free.angular_velocity,
              {.unit = "rad/s", .help = "at the start"});
  table.real3("gravity_m_s2", free.gravity,
              {.unit = "m/s^2", .help = "acceleration beside the gas's load"});
  std::vector<std::string> locked;
  table.texts("locked", locked, {.help = "what cannot change: x, y, z, turn_x, turn_y, turn_z"});
  if (table.listing()) return;
  if ((free.mass > 0.0) == (free.density > 0.0))
    table.fault("mass_kg", "give either mass_kg or density_kg_m3, above zero");
  if (!free.inertia.empty() && free.inertia.size() != 6)
    table.fault("inertia_kg_m2", fmt::format("has {} numbers, accepted 6: xx, yy, zz, xy, yz, zx",
                                             free.inertia.size()));
  if (free.inertia.size() == 6) {
    const auto& i = free.inertia;
    const double minor = i[0] * i[1] - i[3] * i[3];
    const double determinant = i[0] * (i[1] * i[2] - i[4] * i[4]) -
                               i[3] * (i[3] * i[2] - i[4] * i[5]) +
                               i[5] * (i[3] * i[4] - i[1] * i[5]);
    if (!(i[0] > 0.0 && minor > 0.0 && determinant > 0.0))
      table.fault("inertia_kg_m2", "is not positive definite");
  }
  static constexpr std::array<std::string_view, 6> words = {"x",      "y",      "z",
                                                            "turn_x", "turn_y", "turn_z"};
  for (const auto& word : locked) {
    const auto at = std::find(words.begin(), words.end(), word);
    if (at == words.end()) {
      table.fault("locked", fmt::format("'{}', accepted {}", word, fmt::join(words, ", ")));
      continue;
    }
    const auto n = static_cast<std::size_t>(at - words.begin());
    (n < 3 ? free.translates[n] : free.rotates[n - 3]) = false;
  }
}

}  // namespace

void read_bodies(Section& flow, FlowCase& result) {
  static constexpr std::pair<std::string_view, BodyMotion> motions[] = {
      {"fixed", BodyMotion::fixed},
      {"prescribed", BodyMotion::prescribed},
      {"free", BodyMotion::free},
      {"coupled", BodyMotion::coupled}};
  static constexpr std::pair<std::string_view, WallSlip> slips[] = {{"slip", WallSlip::slip},
                                                                    {"no_slip", WallSlip::no_slip}};
  std::set<std::string> names, moved;
  const bool several = result.solids.size() > 1;
  flow.tables("body", "closed surface immersed in the gas", [&](Section& table, std::size_t) {
    BodyCase body;
    table.text("name", body.name, {.required = true, .help = "name in outputs"});
    table.choice(
        "motion", body.motion, motions,
        {.required = true,
         .help = "free: the gas carries it; coupled: the solid sends the surface and moves it"});
    table.file("surface", body.surface,
               {.required = !table.listing() && body.motion != BodyMotion::coupled,
                .help = "mesh file with the surface; coupled: instead of the solid's own"});
    if ((body.motion == BodyMotion::coupled && several) || table.listing())
      table.text(
          "solid", body.solid,
          {.help = "coupled: which of several [[solid]] moves it; default the one of its name"});
    table.choice("slip", body.slip, slips, {.help = "wall condition of the velocity"});
    table.real("wall_temperature_K", body.wall_temperature,
               {.unit = "K", .min = 0.0, .help = "0: adiabatic"});
    if (body.motion == BodyMotion::prescribed || table.listing())
      read_path(table, result, body.path);
    if (body.motion == BodyMotion::free || table.listing()) read_free(table, body.free);
    if (table.listing()) return;
    if (!names.insert(body.name).second)
      table.fault("name", fmt::format("'{}' is used twice", body.name));
    if (body.slip == WallSlip::no_slip && result.options.viscosity == Viscosity::none)
      table.fault("slip", "no_slip needs flow.gas.viscosity; take slip for an inviscid gas");
    if (body.motion == BodyMotion::coupled) {
      result.coupled = true;
      if (body.solid.empty() && several) body.solid = body.name;
      if (std::find(result.solids.begin(), result.solids.end(), body.solid) == result.solids.end())
        table.fault("solid", fmt::format("no solid is called '{}'; there are {}", body.solid,
                                         fmt::join(result.solids, ", ")));
      if (!moved.insert(body.solid).second)
        table.fault(
            "solid",
            several
                ? fmt::format("solid '{}' moves two bodies", body.solid)
                : std::string("one solid moves one body; several are given as tables [[solid]]"));
    }
    for (std::size_t a = 0; a < 3; ++a)
      if (result.axes[a].periodic)
        table.fault("name", "a body in a domain with a periodic direction");
    if (result.geometry != Geometry::cartesian)
      table.fault("name", "bodies need flow.grid.geometry = \"cartesian\"");
    result.bodies.push_back(std::move(body));
  });
  for (const auto& solid : result.solids)
    if (several && result.coupled && !moved.contains(solid))
      flow.fault("body", fmt::format("no body is moved by solid '{}'", solid));
  auto immersed = flow.table("immersed", "numerics of immersed walls");
  immersed.real("gap_block_cells", result.immersed.gap_block,
                {.unit = "1",
                 .min = 0.0,
                 .max = 4.0,
                 .help = "gaps narrower than this count as closed; 0 for bodies that never touch"});
  immersed.real(
      "smooth_below_degrees", result.immersed.smooth_below_degrees,
      {.unit = "degree", .min = 0.0, .max = 90.0, .help = "edges flatter than this are smoothed"});
}

}  // namespace ocublast::flow
