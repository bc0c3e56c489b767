#include "flow_solver/io/flow_case.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "flow_solver/io/body_case.hpp"
#include "flow_solver/io/boundary_case.hpp"
#include "flow_solver/io/charge_case.hpp"
#include "flow_solver/io/precision_case.hpp"

namespace ocublast::flow::inline OCU_PRECISION {
namespace {

void read_gas(Section& flow, FlowOptions& options) {
  auto gas = flow.table("gas", "equation of state and transport");
  gas.real("heat_capacity_ratio", options.gas.heat_capacity_ratio,
           {.unit = "1",
            .min = 1.0,
            .max = 3.0,
            .above_min = true,
            .required = true,
            .help = "cp/cv; air 1.4"});
  gas.real("gas_constant_J_per_kgK", options.gas.gas_constant,
           positive_key("J/(kg K)", "specific gas constant; air 287.05", true));
  static constexpr std::pair<std::string_view, Viscosity> words[] = {
      {"none", Viscosity::none},
      {"constant", Viscosity::constant},
      {"sutherland", Viscosity::sutherland}};
  gas.choice("viscosity", options.viscosity, words,
             {.required = true, .help = "none: inviscid, costs nothing"});
  gas.real("dynamic_viscosity_Pa_s", options.dynamic_viscosity,
           positive_key("Pa s", "constant, or Sutherland's at its reference temperature"));
  gas.real("sutherland_reference_K", options.sutherland_reference,
           positive_key("K", "reference temperature of Sutherland's law"));
  gas.real("sutherland_temperature_K", options.sutherland_temperature,
           positive_key("K", "Sutherland's temperature"));
  gas.real("prandtl", options.prandtl, positive_key("1", "Prandtl number"));
}

void read_stretch(Section& axis, std::string_view name, StretchLayer& layer) {
  auto table = axis.table(name, "growing cells outside this end, so that no echo returns in time");
  table.integer("cells", layer.cells, {.min = 0, .max = 200, .help = "cells of the layer"});
  table.real("ratio", layer.ratio,
             {.unit = "1", .min = 1.0, .max = 1.3, .help = "growth per cell"});
}

void check_nodes(Section& axis, const AxisSpec& spec) {
  if (const std::string fault = fault_of_nodes(spec.min, spec.max, spec.nodes); !fault.empty())
    axis.fault("nodes_m", fault);
  if (spec.refined)
    axis.fault("zone_spacing_m", "nodes_m give the cells already: leave the fine zone out");
}

void read_axis(Section& grid, std::string_view name, AxisSpec& spec) {
  auto axis = grid.table(name, "one direction; leave it out for an absent direction");
  spec.present = axis.present();
  if (!spec.present) return;
  axis.real("min_m", spec.min, {.unit = "m", .required = true, .help = "first face"});
  axis.real("max_m", spec.max, {.unit = "m", .required = true, .help = "last face"});
  axis.reals(
      "nodes_m", spec.nodes,
      {.unit = "m", .help = "cell centres in rising order, instead of spacing_m and a fine zone"});
  axis.real("spacing_m", spec.spacing,
            positive_key("m", "largest cell inside [min_m, max_m]", spec.nodes.empty()));
  spec.refined = axis.has("zone_spacing_m");
  if (spec.refined) {
    axis.real("zone_min_m", spec.zone_min,
              {.unit = "m", .required = true, .help = "start of the fine zone"});
    axis.real("zone_max_m", spec.zone_max,
              {.unit = "m", .required = true, .help = "end of the fine zone"});
    axis.real("zone_spacing_m", spec.zone_spacing, positive_key("m", "cell inside the fine zone"));
  }
  axis.real("growth", spec.growth,
            {.unit = "1",
             .min = 1.0,
             .max = 1.2,
             .above_min = true,
             .help = "ratio of neighbouring cells beside the fine zone"});
  read_stretch(axis, "stretch_low", spec.low);
  read_stretch(axis, "stretch_high", spec.high);
  if (axis.listing()) return;
  if (spec.max <= spec.min)
    axis.fault("max_m", fmt::format("is {} m, accepted > min_m = {} m", spec.max, spec.min));
  else if (!spec.nodes.empty())
    check_nodes(axis, spec);
  else if ((spec.max - spec.min) / spec.spacing < 8.0)
    axis.fault("spacing_m",
               fmt::format("is {} m: fewer than 8 cells in {} m; take a smaller one, or "
                           "leave the direction out",
                           spec.spacing, spec.max - spec.min));
  if (spec.refined && (spec.zone_max <= spec.zone_min || spec.zone_spacing > spec.spacing ||
                       spec.zone_min < spec.min || spec.zone_max > spec.max))
    axis.fault("zone_spacing_m",
               "the fine zone must lie inside [min_m, max_m] with a smaller cell");
}

void read_geometry(Section& grid, FlowCase& result) {
  static constexpr std::pair<std::string_view, Geometry> words[] = {
      {"cartesian", Geometry::cartesian},
      {"cylindrical", Geometry::cylindrical},
      {"spherical", Geometry::spherical},
      {"axisymmetric", Geometry::axisymmetric}};
  grid.choice("geometry", result.geometry, words,
              {.help = "cylindrical, spherical: x alone, the radius; axisymmetric: x the radius, y "
                       "along the axis"});
}

void check_geometry(Section& grid, const FlowCase& result) {
  if (result.geometry == Geometry::cartesian || grid.listing()) return;
  const bool two = result.geometry == Geometry::axisymmetric;
  if (result.axes[2].present || result.axes[1].present != two)
    grid.fault("geometry",
               two ? "axisymmetric needs x (the radius) and y (along the axis), and no z"
                   : "cylindrical and spherical need x (the radius) alone");
  if (result.axes[0].present && (result.axes[0].min < 0.0 || result.axes[0].low.cells > 0))
    grid.fault("geometry", "the radius x starts at 0 or above, without a layer below");
  if (result.options.viscosity != Viscosity::none)
    grid.fault("geometry",
               "only Cartesian grids carry viscous gas; take flow.gas.viscosity = \"none\"");
}

void read_initial(Section& flow, FlowCase& result) {
  auto table = flow.table("initial", "gas at the start; bursts are added to it");
  static constexpr std::pair<std::string_view, InitialKind> words[] = {
      {"uniform", InitialKind::uniform}, {"riemann", InitialKind::riemann}};
  table.choice("kind", result.initial.kind, words, {.help = "uniform: ambient unless said"});
  if (result.initial.kind == InitialKind::uniform || table.listing())
    result.initial.left = read_gas_state(table.table("state", "uniform: the gas"), result.common);
  if (result.initial.kind == InitialKind::riemann || table.listing()) {
    static constexpr std::pair<std::string_view, int> axes[] = {{"x", 0}, {"y", 1}, {"z", 2}};
    table.choice("axis", result.initial.axis, axes, {.help = "direction of the interface"});
    table.real("position_m", result.initial.position,
               {.unit = "m", .required = !table.listing(), .help = "place of the interface"});
    table.real(
        "interface_width_cells", result.initial.interface_width,
        {.unit = "1",
         .min = 0.05,
         .max = 4.0,
         .help = "width of the start's tanh; 0.5 where a shock moves already, 0.4 from rest"});
    result.initial.left =
        read_gas_state(table.table("left", "gas below the interface"), result.common);
    result.initial.right =
        read_gas_state(table.table("right", "gas above the interface"), result.common);
  }
}

void read_bursts(Section& flow, FlowCase& result) {
  flow.tables("burst", "ball of hot gas at rest", [&](Section& table, std::size_t index) {
    BurstCase burst{.name = fmt::format("burst{}", index)};
    table.text("name", burst.name, {.help = "name in reports"});
    table.real3("center_m", burst.center, {.unit = "m", .required = true, .help = "centre"});
    table.real("radius_m", burst.radius, positive_key("m", "radius", true));
    table.real("energy_J", burst.energy, {.unit = "J", .min = 0.0, .help = "energy above ambient"});
    table.real("pressure_Pa", burst.pressure,
               {.unit = "Pa", .min = 0.0, .help = "pressure, instead of energy"});
    table.real("temperature_K", burst.temperature,
               positive_key("K", "temperature of the ball; with it the mass in it", true));
    if (table.listing()) return;
    if ((burst.energy > 0.0) == (burst.pressure > 0.0))
      table.fault("energy_J", "give either energy_J or pressure_Pa, above zero");
    for (std::size_t a = 0; a < 3; ++a)
      if (result.axes[a].present &&
          (burst.center[a] < result.axes[a].min || burst.center[a] > result.axes[a].max))
        table.fault("center_m",
                    fmt::format("{} = {} m lies outside the grid, accepted [{}, {}]", "xyz"[a],
                                burst.center[a], result.axes[a].min, result.axes[a].max));
    result.bursts.push_back(burst);
  });
}

void read_numerics(Section& flow, FlowCase& result) {
  auto table = flow.table("numerics", "scheme and its constants");
  auto& options = result.options;
  // A body that moves by its own law stirs the gas wherever it is.
  const bool stirred =
      std::any_of(result.bodies.begin(), result.bodies.end(), [](const BodyCase& body) {
        return body.motion != BodyMotion::fixed && body.motion != BodyMotion::coupled;
      });
  const bool incident = std::any_of(result.charges.begin(), result.charges.end(),
                                    [&](const ChargeCase& c) { return is_outside(result, c); });
  options.active_box = result.initial.kind == InitialKind::uniform && !stirred && !incident;
  options.quiescent = to_state(result.initial.left, options.gas);
  static constexpr std::pair<std::string_view, Scheme> schemes[] = {
      {"compact6", Scheme::compact6}, {"compact8", Scheme::compact8}, {"muscl", Scheme::muscl}};
  table.choice(
      "scheme", options.scheme, schemes,
      {.help = "compact6: 6th order; compact8: 8th order; muscl: robust second order, inviscid"});
  if (options.scheme == Scheme::muscl && options.viscosity != Viscosity::none && !table.listing())
    table.fault(
        "scheme",
        "muscl computes inviscid gas only; take flow.gas.viscosity = \"none\" or a compact scheme");
  static constexpr std::pair<std::string_view, Sensor> sensors[] = {
      {"dilatation", Sensor::theta_compression}, {"strain", Sensor::strain}};
  table.real("cfl", options.cfl,
             {.unit = "1",
              .min = 0.0,
              .max = 1.2,
              .above_min = true,
              .help = "Courant number on the sum over directions",
              .advice = "start from 1.2"});
  table.real(
      "cfl_direction", options.cfl_direction,
      {.unit = "1",
       .min = 0.0,
       .max = 1.2,
       .above_min = true,
       .help =
           "Courant number along any one direction; with muscl or a fresh charge on the sum too",
       .advice = "start from 0.9"});
  table.flag("filter", options.filter, "8th-order implicit filter after each step");
  table.flag("filter_per_time", options.filter_per_time,
             "as much filtering per time at any step as at the default Courant numbers; false: "
             "whole in each step");
  table.real("filter_alpha", options.filter_alpha,
             {.unit = "1", .min = 0.3, .max = 0.495, .help = "filter parameter"});
  table.flag("artificial_diffusivity", options.artificial_diffusivity,
             "localised artificial diffusivity");
  static constexpr std::pair<std::string_view, DiffusivityForm> forms[] = {
      {"recommended", DiffusivityForm::recommended}, {"paper", DiffusivityForm::paper}};
  table.choice("diffusivity_form", options.diffusivity_form, forms,
               {.help = "paper: stress and heat flux with all artificial parts through the compact "
                        "scheme; with it "
                        "sensor = strain unless said"});
  if (options.diffusivity_form == DiffusivityForm::paper) options.sensor = Sensor::strain;
  table.choice(
      "sensor", options.sensor, sensors,
      {.help = "what switches the bulk term: dilatation in compression, or strain (the paper's)"});
  table.real("c_beta", options.C_beta,
             {.unit = "1", .min = 0.0, .max = 5.0, .help = "artificial bulk viscosity"});
  table.real("c_mu", options.C_mu,
             {.unit = "1", .min = 0.0, .max = 1.0, .help = "artificial shear viscosity"});
  table.real("c_kappa", options.C_kappa,
             {.unit = "1", .min = 0.0, .max = 1.0, .help = "artificial conductivity"});
  table.real("premark_ratio", options.premark_ratio,
             {.unit = "1",
              .min = 1.5,
              .help = "pressure ratio of neighbours that takes first-order fluxes"});
  table.real("premark_ratio_fresh", options.premark_ratio_fresh,
             {.unit = "1", .min = 1.5, .help = "the same while the field's ratio is above 100"});
  table.real("floor_density_kg_m3", options.floor_density,
             {.unit = "kg/m^3", .min = 0.0, .help = "0: stop instead"});
  table.real("floor_pressure_Pa", options.floor_pressure,
             {.unit = "Pa", .min = 0.0, .help = "0: stop instead"});
  table.flag(
      "skip_quiescent", options.active_box,
      "compute only the part of the gas that a disturbance has reached (uniform start only)");
  table.real("skip_tolerance", options.active_tolerance,
             {.unit = "1",
              .min = 0.0,
              .max = 1e-3,
              .help = "relative difference that counts as disturbed"});
  table.integer("skip_margin", options.active_margin,
                {.min = 8, .max = 64, .help = "cells computed beyond the disturbance"});
  table.real("quiet_overpressure", result.quiet_overpressure,
             {.unit = "1",
              .min = 0.0,
              .max = 1e-3,
              .help = "loads below this part of ambient pressure are no load"});
  if (options.active_box && incident && !table.listing())
    table.fault("skip_quiescent",
                "a wave from outside (flow.charge) needs the whole grid; leave it out or false");
  if (options.active_box && result.initial.kind != InitialKind::uniform && !table.listing())
    table.fault("skip_quiescent", "only a uniform start has gas at rest to skip");
  if (options.active_box && stirred && !table.listing())
    table.fault("skip_quiescent",
                "bodies that move by a law or a piston stir gas that would be skipped");
  read_precision(table, result.precision);
  if (is_single) {
    options.active_tolerance = std::max(options.active_tolerance, least_active_tolerance);
    result.quiet_overpressure = std::max(result.quiet_overpressure, least_active_tolerance);
  }
  table.text("instruction_set", options.instruction_set,
             {.help = "baseline, avx2, avx512; empty: the best"});
}

void read_probes_and_output(Section& flow, FlowCase& result) {
  std::set<std::string> names;
  flow.tables("probe", "point read-out at every step", [&](Section& table, std::size_t) {
    Probe probe;
    table.text("name", probe.name, {.required = true, .help = "column name"});
    table.real3("position_m", probe.position, {.unit = "m", .required = true, .help = "place"});
    if (table.listing()) return;
    if (!names.insert(probe.name).second)
      table.fault("name", fmt::format("'{}' is used twice", probe.name));
    for (std::size_t a = 0; a < 3; ++a)
      if (result.axes[a].present &&
          (probe.position[a] < result.axes[a].min || probe.position[a] > result.axes[a].max))
        table.fault("position_m",
                    fmt::format("{} = {} m lies outside the grid, accepted [{}, {}]", "xyz"[a],
                                probe.position[a], result.axes[a].min, result.axes[a].max));
    result.probes.push_back(std::move(probe));
  });
  flow.tables("surface_probe", "overpressure on a body, at the vertex nearest to a point",
              [&](Section& table, std::size_t) {
                SurfaceProbe probe;
                table.text("name", probe.name, {.required = true, .help = "name in the summary"});
                table.text("body", probe.body, {.required = true, .help = "which flow.body"});
                table.real3(
                    "position_m", probe.position,
                    {.unit = "m", .required = true, .help = "place on the reference shape"});
                if (table.listing()) return;
                if (std::none_of(result.bodies.begin(), result.bodies.end(),
                                 [&](const BodyCase& body) { return body.name == probe.body; }))
                  table.fault("body", fmt::format("no flow.body is named '{}'", probe.body));
                result.surface_probes.push_back(std::move(probe));
              });
  flow.tables(
      "front_speed", "mean speed of the front between two probes",
      [&](Section& table, std::size_t) {
        FrontSpeed speed;
        table.text("name", speed.name, {.required = true, .help = "name in the summary"});
        table.text("from", speed.from, {.required = true, .help = "first probe"});
        table.text("to", speed.to, {.required = true, .help = "second probe"});
        if (table.listing()) return;
        for (const auto& [key, name] : {std::pair{"from", speed.from}, std::pair{"to", speed.to}})
          if (!names.contains(name))
            table.fault(key, fmt::format("no flow.probe is named '{}'", name));
        result.front_speeds.push_back(std::move(speed));
      });
  auto output = flow.table("output", "what is written");
  output.real("every_s", result.output.every, {.unit = "s", .min = 0.0, .help = "fields, 0: none"});
  output.real("interface_every_s", result.output.interface_every,
              {.unit = "s", .min = 0.0, .help = "surfaces of bodies, 0: none"});
  check_interval(output, "every_s", result.output.every, result.common.end_time);
  check_interval(output, "interface_every_s", result.output.interface_every,
                 result.common.end_time);
}

}  // namespace

FlowCase read_flow_case(CaseReader& reader) {
  FlowCase result;
  result.common = read_case_common(reader);
  result.solids = reader.solids();
  if (result.solids.empty()) result.solids.emplace_back();
  auto flow = reader.section("flow", "the gas");
  read_gas(flow, result.options);
  auto grid = flow.table("grid", "non-uniform grid");
  read_geometry(grid, result);
  read_axis(grid, "x", result.axes[0]);
  read_axis(grid, "y", result.axes[1]);
  read_axis(grid, "z", result.axes[2]);
  check_geometry(grid, result);
  if (!result.axes[0].present)
    grid.fault("x", "missing: a 1-D grid lies along x, a 2-D grid in x and y");
  read_boundaries(flow, result);
  read_initial(flow, result);
  read_bursts(flow, result);
  read_charges(flow, result);
  read_bodies(flow, result);
  read_numerics(flow, result);
  read_probes_and_output(flow, result);
  return result;
}

}  // namespace ocublast::flow
