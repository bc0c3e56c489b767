#include "flow_solver/io/charge_case.hpp"

#include <fmt/format.h>

#include <cmath>

namespace ocublast::flow::inline OCU_PRECISION {

bool is_outside(const FlowCase& flow_case, const ChargeCase& charge) {
  for (std::size_t a = 0; a < 3; ++a) {
    const AxisSpec& axis = flow_case.axes[a];
    if (axis.present && (charge.center[a] < axis.min || charge.center[a] > axis.max)) return true;
  }
  return false;
}

bool through_charge(const FlowCase& result, std::size_t face, const ChargeCase& charge) {
  const std::size_t a = face / 2;
  if (a == 0 && result.geometry != Geometry::cartesian) return true;
  const double plane = face % 2 == 0 ? result.axes[a].min : result.axes[a].max;
  return result.boundaries[face].kind == BoundaryKind::symmetry &&
         std::abs(charge.center[a] - plane) <= 1e-9 * (result.axes[a].max - result.axes[a].min);
}

namespace {

constexpr RealKey positive(std::string_view unit, std::string_view help, bool required) {
  return {.unit = unit, .min = 0.0, .above_min = true, .required = required, .help = help};
}

void check_charge_place(Section& table, const FlowCase& result, const ChargeCase& charge) {
  const bool radial = result.geometry != Geometry::cartesian;
  const std::size_t present =
      result.axes[0].present + result.axes[1].present + result.axes[2].present;
  if (result.geometry == Geometry::cylindrical || (!radial && present != 3))
    table.fault("name",
                "a charge is a sphere: it needs a 3-D, an axisymmetric or a spherical grid");
  if (radial && (charge.center[0] != 0.0 ||
                 (result.geometry == Geometry::spherical && charge.center[1] != 0.0)))
    table.fault("center_m", "on a radial grid a charge lies at r = 0");
  if (result.initial.kind != InitialKind::uniform)
    table.fault("name", "a charge needs a uniform start (flow.initial.kind)");
  bool on_ground = radial && result.geometry == Geometry::spherical;
  for (std::size_t face = 0; face < 6; ++face) {
    const std::size_t a = face / 2;
    if (!result.axes[a].present || (a == 0 && radial)) continue;
    if (through_charge(result, face, charge)) {
      on_ground = true;
      continue;
    }
    const bool outside = is_outside(result, charge);
    if (outside && result.boundaries[face].kind == BoundaryKind::symmetry)
      table.fault(
          "center_m",
          fmt::format("the charge lies outside the grid and not on the plane of symmetry {}: "
                      "what that plane reflects outside would be missing; extend the grid to "
                      "the charge",
                      domain_face_names[face]));
  }
  if (charge.burst == BurstKind::surface && !on_ground)
    table.fault("burst", "surface: the ground must be a symmetry face through center_m");
  if (charge.source == ChargeSource::kingery_bulmash && !is_outside(result, charge))
    table.fault("source",
                "kingery_bulmash prescribes a wave from outside; center_m lies inside the grid");
}

}  // namespace

void read_charges(Section& flow, FlowCase& result) {
  static constexpr std::pair<std::string_view, ChargeSource> sources[] = {
      {"calibrated", ChargeSource::calibrated},
      {"jwl", ChargeSource::jwl},
      {"ball", ChargeSource::ball},
      {"kingery_bulmash", ChargeSource::kingery_bulmash}};
  static constexpr std::pair<std::string_view, BurstKind> bursts[] = {
      {"free_air", BurstKind::free_air}, {"surface", BurstKind::surface}};
  flow.tables(
      "charge",
      "charge computed in one dimension until its front comes near; may lie outside the grid",
      [&](Section& table, std::size_t index) {
        ChargeCase charge{.name = fmt::format("charge{}", index)};
        table.text("name", charge.name, {.help = "name in reports"});
        table.choice("source", charge.source, sources,
                     {.required = true,
                      .help = "calibrated: TNT against Kingery-Bulmash, Z = 2 to 10; jwl: TNT, "
                              "nearer; ball: hot gas; kingery_bulmash: prescribed wave form"});
        table.real3("center_m", charge.center,
                    {.unit = "m", .required = true, .help = "place; may lie outside the grid"});
        const bool ball = charge.source == ChargeSource::ball;
        table.real("mass_kg", charge.mass,
                   positive("kg", "mass of TNT; of a ball: mass above ambient", true));
        if (ball || table.listing()) {
          table.real("energy_J", charge.energy,
                     positive("J", "ball: energy above ambient", !table.listing()));
          table.real("radius_m", charge.radius, positive("m", "ball: radius", !table.listing()));
        }
        table.choice("burst", charge.burst, bursts,
                     {.help = "TNT in the air, or on the ground (a symmetry face through center_m, "
                              "which takes part)"});
        table.real("start_radius_m", charge.start_radius,
                   {.unit = "m",
                    .min = 0.0,
                    .help = "front radius at which the wave comes to the grid; 0: the largest "
                            "free of walls"});
        if (table.listing()) return;
        if (ball && charge.burst == BurstKind::surface)
          table.fault("burst",
                      "of a ball give the whole energy; a symmetry face through it takes its half");
        check_charge_place(table, result, charge);
        result.charges.push_back(charge);
      });
}

}  // namespace ocublast::flow
