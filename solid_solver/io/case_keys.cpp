#include "solid_solver/io/case_keys.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "coupler/base/errors.hpp"
#include "solid_solver/io/case_materials.hpp"
#include "solid_solver/io/case_supports.hpp"
#include "solid_solver/io/mesh_file.hpp"
#include "solid_solver/mesh/mesh_check.hpp"

namespace ocublast::solid {
namespace {

constexpr std::pair<std::string_view, StepControl::Rule> rule_words[] = {
    {"lanczos", StepControl::Rule::lanczos}, {"element", StepControl::Rule::element}};

const std::vector<std::string> default_fields{"displacement",    "velocity", "pressure",
                                              "von_mises",       "stress",   "principal_stress",
                                              "principal_strain"};

std::vector<std::string> all_fields() {
  auto fields = default_fields;
  for (const char* more : {"acceleration", "deviatoric_norm", "volume_ratio", "energy_density",
                           "principal_stresses", "principal_strains"})
    fields.emplace_back(more);
  return fields;
}

void read_integrator(Section section, SolidSetup& setup) {
  auto& c = setup.control;
  section.choice(
      "step_rule", c.rule,
      std::span<const std::pair<std::string_view, StepControl::Rule>>(rule_words),
      {.help = "lanczos: largest frequency of the assembled operator; element: length / c"});
  section.real("safety", c.safety,
               {.unit = "1",
                .min = 0.0,
                .max = 1.0,
                .above_min = true,
                .help = "part of the critical step of the Lanczos estimate"});
  section.real("element_factor", c.element_factor,
               {.unit = "1",
                .min = 0.0,
                .max = 1.0,
                .above_min = true,
                .help = "part of the elements' own steps, rule element"});
  section.integer("lanczos_products", c.lanczos_products,
                  {.min = 5, .max = 200, .help = "products at least"});
  section.integer("check_every_steps", c.check_every,
                  {.min = 1, .help = "steps between looks at the shrunken mesh"});
  section.real("energy_error_limit", c.energy_error_limit,
               {.unit = "1",
                .min = 0.0,
                .above_min = true,
                .help = "energy error over the peak energy that stops the run"});
  section.flag("sleep", c.sleep, "skip windows in which nothing can move");
  section.real("hourglass", setup.assembly.hourglass.coefficient,
               {.unit = "1",
                .min = 0.0,
                .max = 10.0,
                .above_min = true,
                .help = "hourglass stiffness of one-point elements over the physical one"});
  section.real("mass_damping_1_s", setup.mass_damping,
               {.unit = "1/s", .min = 0.0, .help = "damping force over momentum"});
  section.real("viscosity_linear", setup.assembly.viscosity.linear,
               {.unit = "1", .min = 0.0, .max = 1.0, .help = "bulk viscosity c1"});
  section.real("viscosity_quadratic", setup.assembly.viscosity.quadratic,
               {.unit = "1", .min = 0.0, .max = 10.0, .help = "bulk viscosity c0"});
}

void read_output(Section section, const CaseCommon& common, OutputKeys& output) {
  output.every = common.end_time / 10.0;
  output.history_every = common.end_time / 1000.0;
  output.fields = default_fields;
  section.real("every_s", output.every,
               {.unit = "s",
                .min = 0.0,
                .above_min = true,
                .help = "between field outputs; default a tenth of the run"});
  section.real("history_every_s", output.history_every,
               {.unit = "s",
                .min = 0.0,
                .above_min = true,
                .help = "between rows of the tables; default a thousandth"});
  section.real("running_mean_s", output.running_mean,
               {.unit = "s",
                .min = 0.0,
                .above_min = true,
                .help = "width of the running mean of pressures"});
  section.real("checkpoint_every_s", output.checkpoint_every,
               {.unit = "s", .min = 0.0, .help = "between checkpoints of a run alone; 0: none"});
  check_interval(section, "every_s", output.every, common.end_time);
  check_interval(section, "history_every_s", output.history_every, common.end_time);
  check_interval(section, "checkpoint_every_s", output.checkpoint_every, common.end_time);
  const auto known = all_fields();
  section.texts("fields", output.fields,
                {.help = fmt::format("fields written, of {}", fmt::join(known, ", "))});
  for (const auto& field : output.fields)
    if (std::find(known.begin(), known.end(), field) == known.end())
      section.fault("fields",
                    fmt::format("no field '{}', accepted {}", field, fmt::join(known, ", ")));
}

void read_initial(Section& solid, const SetNames& names, SolidCase& result) {
  solid.tables("initial_velocity", "velocity at the start", [&](Section& entry, std::size_t) {
    SolidCase::InitialVelocity v;
    const std::string set = read_name(entry, "nodes", false, "node set; all nodes where absent");
    entry.real3("velocity_m_s", v.velocity, {.unit = "m/s", .required = true, .help = "velocity"});
    v.nodes = names.nodes(entry, "nodes", set);
    if (set.empty())
      for (std::size_t n = 0; n < names.mesh().n_nodes(); ++n)
        v.nodes.push_back(static_cast<std::int32_t>(n));
    result.initial_velocities.push_back(std::move(v));
  });
}

void read_groups(Section& solid, const SolidMesh& mesh, SolidSetup& setup) {
  const auto elements = make_elements();
  std::vector<std::pair<std::string_view, std::size_t>> words;
  for (std::size_t e = 0; e < elements.size(); ++e) words.emplace_back(elements[e].name, e);
  setup.assembly.element_of_tissue.assign(mesh.tissues.size(), "");
  solid.tables(
      "group", "element of tissues; default hex8_q1p0, tet4_anp, tet10, wedge6, quad4_plane_strain",
      [&](Section& entry, std::size_t) {
        std::vector<std::string> tissues;
        std::size_t element = 0;
        entry.texts("tissues", tissues, {.required = true, .help = "tissues of the mesh"});
        entry.choice("element", element,
                     std::span<const std::pair<std::string_view, std::size_t>>(words),
                     {.required = true, .help = "element type"});
        for (const auto& name : tissues) {
          const auto found = std::find(mesh.tissues.begin(), mesh.tissues.end(), name);
          if (mesh.tissues.empty()) continue;
          if (found == mesh.tissues.end()) {
            entry.fault("tissues", fmt::format("the mesh has no tissue '{}'; it has {}", name,
                                               fmt::join(mesh.tissues, ", ")));
            continue;
          }
          const auto id = static_cast<std::int32_t>(found - mesh.tissues.begin());
          const auto& type = elements[element];
          const auto& own = mesh.of(type.shape).tissue;
          if (std::find(own.begin(), own.end(), id) == own.end())
            entry.fault("element", fmt::format("tissue '{}' has no cells {}; {} does not apply",
                                               name, info(type.shape).name, type.name));
          setup.assembly.element_of_tissue[static_cast<std::size_t>(id)] = type.name;
        }
      });
}

void read_equilibrium(Section section, EquilibriumKeys& keys) {
  section.flag("equilibrium", keys.wanted,
               "start from the equilibrium of the loads at t = 0 (pressure of the eye, gravity)");
  section.real("tolerance", keys.tolerance,
               {.unit = "1",
                .min = 0.0,
                .max = 1.0,
                .above_min = true,
                .help = "residual over loads that counts as equilibrium"});
  section.integer("steps", keys.most_steps, {.min = 1, .help = "steps of relaxation at most"});
}

void read_histories(Section& solid, const SetNames& names, SolidCase& result) {
  solid.tables("history", "tables of a tissue, of the cell nearest to a place, of a node set",
               [&](Section& entry, std::size_t) {
                 HistoryKeys h;
                 entry.text("name", h.name,
                            {.required = true, .help = "name in tables and summary"});
                 entry.text("tissue", h.tissue, {.help = "least, mean and largest over a tissue"});
                 entry.reals("position_m", h.position,
                             {.unit = "m", .help = "place in the reference state"});
                 entry.text("nodes", h.nodes, {.help = "mean motion of a node set"});
                 if (!entry.listing()) {
                   if (h.tissue.empty() + h.position.empty() + h.nodes.empty() != 2)
                     entry.fault("", "give one of tissue, position_m, nodes");
                   if (!h.position.empty() && h.position.size() != 3)
                     entry.fault("position_m", "needs three numbers");
                   const auto& tissues = names.mesh().tissues;
                   if (!h.tissue.empty() && !tissues.empty() &&
                       std::find(tissues.begin(), tissues.end(), h.tissue) == tissues.end())
                     entry.fault("tissue", fmt::format("the mesh has no tissue '{}'; it has {}",
                                                       h.tissue, fmt::join(tissues, ", ")));
                   static_cast<void>(names.nodes(entry, "nodes", h.nodes));
                 }
                 result.histories.push_back(std::move(h));
               });
}

void read_interface(Section& solid, const SetNames& names, SolidCase& result) {
  auto section = solid.table("interface", "the surface coupled to the flow");
  result.interface = result.coupled ? "wet" : "";
  section.text("faces", result.interface,
               {.help = "face set, closed; default wet in a coupled case"});
  section.real(
      "quiet_overpressure_Pa", result.setup.control.quiet_overpressure,
      {.unit = "Pa", .min = 0.0, .help = "loads up to this leave a body at rest asleep; 0: exact"});
  if (section.listing() || result.interface.empty() || names.mesh().n_cells() == 0) return;
  result.setup.interface = names.facets(section, "faces", result.interface);
  if (result.setup.interface.empty()) return;
  for (const auto& fault : check_closed_surface(names.mesh(), result.interface))
    section.fault("faces", fault);
}

std::shared_ptr<const SolidMesh> read_checked_mesh(Section& solid) {
  std::filesystem::path file;
  solid.file("mesh", file, {.required = true, .help = "mesh file (HDF5, made by cases/mesh)"});
  auto mesh = std::make_shared<SolidMesh>();
  if (solid.listing() || file.empty() || !std::filesystem::is_regular_file(file)) return mesh;
  try {
    *mesh = read_mesh(file);
    for (const auto& fault : check_mesh(*mesh))
      solid.fault("mesh", fmt::format("{}: {}", file.string(), fault));
    // Cells of bad shape do not keep the rest of the case from being checked against the mesh.
    if (!numbers_in_range(*mesh)) *mesh = {};
  } catch (const CaseError& error) {
    solid.fault("mesh", error.what());
    *mesh = {};
  }
  return mesh;
}

}  // namespace

SolidCase read_solid_case(CaseReader& reader) {
  SolidCase result;
  result.common = read_case_common(reader);
  result.coupled = reader.has("coupling");
  auto solid = reader.section("solid", "the deformable body");
  result.setup.mesh = read_checked_mesh(solid);
  const auto& mesh = *result.setup.mesh;
  const bool have_mesh = mesh.n_cells() > 0;
  const SetNames names(mesh);
  auto materials = read_materials(solid);
  if (have_mesh) result.setup.material_of_tissue = assign_materials(solid, materials, mesh.tissues);
  result.setup.materials = std::move(materials.materials);
  if (have_mesh) check_fibres(solid, result.setup.materials, result.setup.material_of_tissue, mesh);
  read_integrator(solid.table("integrator", "time stepping"), result.setup);
  read_output(solid.table("output", "what is written"), result.common, result.output);
  read_groups(solid, mesh, result.setup);
  read_supports(solid, names, result.setup);
  read_loads(solid, names, result.setup);
  read_initial(solid, names, result);
  read_equilibrium(solid.table("initial", "the state at the start"), result.equilibrium);
  read_histories(solid, names, result);
  read_interface(solid, names, result);
  if (have_mesh) check_supports(solid, result.setup);
  result.whole_mesh = result.setup.mesh;
  return result;
}

}  // namespace ocublast::solid
