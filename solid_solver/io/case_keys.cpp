#include "solid_solver/io/case_keys.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "coupler/base/errors.hpp"
#include "solid_solver/io/case_materials.hpp"
#include "solid_solver/io/mesh_file.hpp"
#include "solid_solver/mesh/mesh_check.hpp"

namespace ocublast::solid {
namespace {

constexpr std::pair<std::string_view, StepControl::Rule> rule_words[] = {
    {"lanczos", StepControl::Rule::lanczos}, {"element", StepControl::Rule::element}};
constexpr std::pair<std::string_view, std::size_t> axis_words[] = {{"x", 0}, {"y", 1}, {"z", 2}};

const std::vector<std::string> all_fields{"displacement",    "velocity", "pressure",
                                          "von_mises",       "stress",   "principal_stress",
                                          "principal_strain"};

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
  section.real("viscosity_linear", setup.assembly.viscosity.linear,
               {.unit = "1", .min = 0.0, .max = 1.0, .help = "bulk viscosity c1"});
  section.real("viscosity_quadratic", setup.assembly.viscosity.quadratic,
               {.unit = "1", .min = 0.0, .max = 10.0, .help = "bulk viscosity c0"});
}

void read_output(Section section, const CaseCommon& common, OutputKeys& output) {
  output.every = common.end_time / 10.0;
  output.history_every = common.end_time / 1000.0;
  output.fields = all_fields;
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
  section.texts("fields", output.fields, {.help = "fields written"});
  for (const auto& field : output.fields)
    if (std::find(all_fields.begin(), all_fields.end(), field) == all_fields.end())
      section.fault("fields",
                    fmt::format("no field '{}', accepted {}", field, fmt::join(all_fields, ", ")));
}

/// Resolves names against the mesh and notes what is missing.
class Names {
 public:
  explicit Names(const SolidMesh& mesh) : mesh_(mesh) {}
  [[nodiscard]] std::vector<std::int32_t> nodes(Section& section, std::string_view key,
                                                const std::string& name) const {
    const auto found = mesh_.node_sets.find(name);
    if (found != mesh_.node_sets.end()) return found->second;
    if (mesh_.n_cells() > 0 && !name.empty())
      note(section, key, "node set", name, names_of(mesh_.node_sets));
    return {};
  }
  [[nodiscard]] std::vector<Facet> facets(Section& section, std::string_view key,
                                          const std::string& name) const {
    const auto found = mesh_.face_sets.find(name);
    if (found != mesh_.face_sets.end()) return found->second;
    if (mesh_.n_cells() > 0 && !name.empty())
      note(section, key, "face set", name, names_of(mesh_.face_sets));
    return {};
  }
  [[nodiscard]] const SolidMesh& mesh() const { return mesh_; }

 private:
  template <class Map>
  static std::vector<std::string> names_of(const Map& map) {
    std::vector<std::string> names;
    for (const auto& [name, unused] : map) names.push_back(name);
    return names;
  }
  static void note(Section& section, std::string_view key, const char* kind,
                   const std::string& name, const std::vector<std::string>& there) {
    section.fault(key,
                  fmt::format("the mesh has no {} '{}'; it has {}", kind, name,
                              there.empty() ? "none" : fmt::format("{}", fmt::join(there, ", "))));
  }
  const SolidMesh& mesh_;
};

std::string read_name(Section& section, const char* key, bool required, const char* help) {
  std::string name;
  section.text(key, name, {.required = required, .help = help});
  return name;
}

Schedule read_schedule(Section& section, const char* values_key, const char* unit,
                       const char* help) {
  Schedule schedule;
  section.reals("times_s", schedule.times,
                {.unit = "s", .required = true, .help = "times of the schedule, ascending"});
  section.reals(values_key, schedule.values, {.unit = unit, .required = true, .help = help});
  if (section.listing()) return schedule;
  if (schedule.times.size() != schedule.values.size())
    section.fault("times_s", fmt::format("{} times for {} values", schedule.times.size(),
                                         schedule.values.size()));
  if (!std::is_sorted(schedule.times.begin(), schedule.times.end()))
    section.fault("times_s", "not ascending");
  if (schedule.times.size() != schedule.values.size()) schedule = {};
  return schedule;
}

void read_fixed(Section& solid, const Names& names, SolidSetup& setup) {
  solid.tables("fixed", "nodes held in place", [&](Section& entry, std::size_t) {
    FixedNodes fixed{
        .nodes = names.nodes(entry, "nodes", read_name(entry, "nodes", true, "node set")),
        .directions = {false, false, false}};
    std::vector<std::string> directions{"x", "y", "z"};
    entry.texts("directions", directions, {.help = "directions held, of x, y, z"});
    for (const auto& d : directions) {
      const auto at = std::string_view("xyz").find(d);
      if (d.size() != 1 || at == std::string_view::npos)
        entry.fault("directions", fmt::format("'{}' is no direction, accepted x, y, z", d));
      else
        fixed.directions[at] = true;
    }
    setup.fixed.push_back(std::move(fixed));
  });
}

void read_prescribed(Section& solid, const Names& names, SolidSetup& setup) {
  solid.tables("prescribed", "nodes moved by a schedule", [&](Section& entry, std::size_t) {
    PrescribedNodes p{.nodes =
                          names.nodes(entry, "nodes", read_name(entry, "nodes", true, "node set"))};
    entry.choice("direction", p.direction,
                 std::span<const std::pair<std::string_view, std::size_t>>(axis_words),
                 {.required = true, .help = "x, y or z"});
    const bool velocity = entry.has("velocities_m_s") && !entry.listing();
    if (velocity && entry.has("displacements_m"))
      entry.fault("velocities_m_s", "given together with displacements_m; give one of them");
    p.quantity =
        velocity ? PrescribedNodes::Quantity::velocity : PrescribedNodes::Quantity::displacement;
    p.schedule = velocity
                     ? read_schedule(entry, "velocities_m_s", "m/s", "velocities at the times")
                     : read_schedule(entry, "displacements_m", "m", "displacements at the times");
    if (entry.listing())
      static_cast<void>(
          read_schedule(entry, "velocities_m_s", "m/s", "instead: velocities at the times"));
    setup.prescribed.push_back(std::move(p));
  });
}

void read_springs(Section& solid, const Names& names, SolidSetup& setup) {
  solid.tables("spring", "springs and dashpots to ground", [&](Section& entry, std::size_t) {
    const std::string faces =
        read_name(entry, "faces", false, "face set: stiffness per reference area");
    const std::string nodes = read_name(entry, "nodes", false, "node set: stiffness per node");
    double per_area[2] = {0.0, 0.0};
    double per_node[2] = {0.0, 0.0};
    entry.real("stiffness_Pa_m", per_area[0], {.unit = "Pa/m", .min = 0.0, .help = "with faces"});
    entry.real("damping_Pa_s_m", per_area[1], {.unit = "Pa s/m", .min = 0.0, .help = "with faces"});
    entry.real("stiffness_N_m", per_node[0], {.unit = "N/m", .min = 0.0, .help = "with nodes"});
    entry.real("damping_N_s_m", per_node[1], {.unit = "N s/m", .min = 0.0, .help = "with nodes"});
    if (entry.listing()) return;
    if (faces.empty() == nodes.empty()) {
      entry.fault("", "give either faces or nodes");
      return;
    }
    if (!faces.empty() && (entry.has("stiffness_N_m") || entry.has("damping_N_s_m")))
      entry.fault("stiffness_N_m",
                  "is per node; with faces give stiffness_Pa_m and damping_Pa_s_m");
    if (!nodes.empty() && (entry.has("stiffness_Pa_m") || entry.has("damping_Pa_s_m")))
      entry.fault("stiffness_Pa_m", "is per area; with nodes give stiffness_N_m and damping_N_s_m");
    SpringSet set;
    if (!faces.empty()) {
      const FollowerPressure surface(names.mesh(), names.facets(entry, "faces", faces));
      set.nodes = surface.nodes();
      for (const double area : surface.nodal_areas()) {
        set.stiffness.push_back(per_area[0] * area);
        set.damping.push_back(per_area[1] * area);
      }
    } else {
      set.nodes = names.nodes(entry, "nodes", nodes);
      set.stiffness.assign(set.nodes.size(), per_node[0]);
      set.damping.assign(set.nodes.size(), per_node[1]);
    }
    setup.springs.push_back(std::move(set));
  });
}

void read_pressures(Section& solid, const Names& names, SolidSetup& setup) {
  solid.tables(
      "pressure", "uniform pressure that follows a surface", [&](Section& entry, std::size_t) {
        PressureLoad load{
            .facets = names.facets(entry, "faces", read_name(entry, "faces", true, "face set"))};
        load.pressure =
            read_schedule(entry, "overpressures_Pa", "Pa", "pressure less ambient at the times");
        setup.pressures.push_back(std::move(load));
      });
}

void read_initial(Section& solid, const Names& names, SolidCase& result) {
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

void read_histories(Section& solid, const Names& names, SolidCase& result) {
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

void read_interface(Section& solid, const Names& names, SolidCase& result) {
  auto section = solid.table("interface", "the surface coupled to the flow");
  result.interface = result.coupled ? "wet" : "";
  section.text("faces", result.interface,
               {.help = "face set, closed; default wet in a coupled case"});
  if (section.listing() || result.interface.empty() || names.mesh().n_cells() == 0) return;
  result.setup.interface = names.facets(section, "faces", result.interface);
  if (result.setup.interface.empty()) return;
  for (const auto& fault : check_closed_surface(names.mesh(), result.interface))
    section.fault("faces", fault);
}

/// Two prescriptions of one node and direction contradict each other.
void check_supports(Section& solid, const SolidSetup& setup) {
  std::vector<int> count(3 * setup.mesh->n_nodes(), 0);
  std::string places;
  int conflicts = 0;
  const auto mark = [&](std::int32_t n, std::size_t i) {
    if (++count[3 * static_cast<std::size_t>(n) + i] == 2 && ++conflicts <= 5)
      places += fmt::format("{}node {} in {}", places.empty() ? "" : ", ", n, "xyz"[i]);
  };
  for (const auto& p : setup.prescribed)
    for (const auto n : p.nodes) mark(n, p.direction);
  for (const auto& f : setup.fixed)
    for (std::size_t i = 0; i < 3; ++i)
      if (f.directions[i])
        for (const auto n : f.nodes) {
          auto& c = count[3 * static_cast<std::size_t>(n) + i];
          if (c > 0 && c < 100) mark(n, i);
          c = std::max(c, 100);  // held twice is held
        }
  if (conflicts > 0)
    solid.fault("prescribed",
                fmt::format("{} nodes are moved by two entries: {}", conflicts, places));
}

std::shared_ptr<const SolidMesh> read_checked_mesh(Section& solid) {
  std::filesystem::path file;
  solid.file("mesh", file, {.required = true, .help = "mesh file (HDF5, made by cases/mesh)"});
  auto mesh = std::make_shared<SolidMesh>();
  if (solid.listing() || file.empty() || !std::filesystem::is_regular_file(file)) return mesh;
  try {
    *mesh = read_mesh(file);
    const auto faults = check_mesh(*mesh);
    for (const auto& fault : faults)
      solid.fault("mesh", fmt::format("{}: {}", file.string(), fault));
    if (!faults.empty()) *mesh = {};
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
  const Names names(mesh);
  auto materials = read_materials(solid);
  if (have_mesh) result.setup.material_of_tissue = assign_materials(solid, materials, mesh.tissues);
  result.setup.materials = std::move(materials.materials);
  read_integrator(solid.table("integrator", "time stepping"), result.setup);
  read_output(solid.table("output", "what is written"), result.common, result.output);
  read_groups(solid, mesh, result.setup);
  read_fixed(solid, names, result.setup);
  read_prescribed(solid, names, result.setup);
  read_springs(solid, names, result.setup);
  read_pressures(solid, names, result.setup);
  read_initial(solid, names, result);
  read_histories(solid, names, result);
  read_interface(solid, names, result);
  if (have_mesh) check_supports(solid, result.setup);
  return result;
}

}  // namespace ocublast::solid
