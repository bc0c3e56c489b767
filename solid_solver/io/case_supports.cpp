#include "solid_solver/io/case_supports.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "solid_solver/io/facet_table.hpp"

namespace ocublast::solid {
namespace {

constexpr std::pair<std::string_view, std::size_t> axis_words[] = {{"x", 0}, {"y", 1}, {"z", 2}};

template <class Map>
void note_missing(Section& section, std::string_view key, const char* kind, const std::string& name,
                  const Map& there) {
  std::vector<std::string> names;
  for (const auto& [known, unused] : there) names.push_back(known);
  section.fault(key,
                fmt::format("the mesh has no {} '{}'; it has {}", kind, name,
                            names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "))));
}

void read_fixed(Section& solid, const SetNames& names, SolidSetup& setup) {
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

void read_prescribed(Section& solid, const SetNames& names, SolidSetup& setup) {
  using enum PrescribedNodes::Quantity;
  struct Way {
    PrescribedNodes::Quantity quantity;
    const char* key;
    const char* unit;
    const char* help;
  };
  constexpr Way ways[] = {
      {displacement, "displacements_m", "m", "displacements at the times"},
      {velocity, "velocities_m_s", "m/s", "instead: velocities at the times"},
      {acceleration, "accelerations_m_s2", "m/s^2", "instead: accelerations at the times"}};
  solid.tables("prescribed", "nodes moved by a schedule", [&](Section& entry, std::size_t) {
    PrescribedNodes p{.nodes =
                          names.nodes(entry, "nodes", read_name(entry, "nodes", true, "node set"))};
    entry.choice("direction", p.direction,
                 std::span<const std::pair<std::string_view, std::size_t>>(axis_words),
                 {.required = true, .help = "x, y or z"});
    p.quantity = PrescribedNodes::Quantity::displacement;
    int given = 0;
    for (const auto& way : ways) given += !entry.listing() && entry.has(way.key);
    if (given > 1)
      entry.fault("", "give one of displacements_m, velocities_m_s, accelerations_m_s2");
    for (const auto& way : ways) {
      const bool wanted = entry.has(way.key) || (given == 0 && way.key == ways[0].key);
      if (!entry.listing() && !wanted) continue;
      p.quantity = way.quantity;
      p.schedule = read_schedule(entry, way.key, way.unit, way.help);
    }
    setup.prescribed.push_back(std::move(p));
  });
}

void read_symmetry(Section& solid, const SetNames& names, SolidSetup& setup) {
  solid.tables("symmetry", "nodes that stay in a plane", [&](Section& entry, std::size_t) {
    PlaneKeys plane{.nodes =
                        names.nodes(entry, "nodes", read_name(entry, "nodes", true, "node set"))};
    entry.real3("normal", plane.normal,
                {.unit = "1", .required = true, .help = "normal of the plane"});
    if (!entry.listing() && plane.normal == std::array<double, 3>{})
      entry.fault("normal", "is zero");
    setup.planes.push_back(std::move(plane));
  });
}

void read_ties(Section& solid, const SetNames& names, SolidSetup& setup) {
  solid.tables("tie", "nodes tied to the facets near them", [&](Section& entry, std::size_t) {
    TieKeys tie{
        .nodes = names.nodes(entry, "nodes", read_name(entry, "nodes", true, "node set")),
        .facets = names.facets(entry, "faces", read_name(entry, "faces", true, "face set"))};
    entry.real("reach_m", tie.reach,
               {.unit = "m",
                .min = 0.0,
                .above_min = true,
                .required = true,
                .help = "largest distance of a node that is tied"});
    if (!entry.listing() && !tie.nodes.empty() && !tie.facets.empty() && tie.reach > 0.0) {
      const TiedNodes tied(names.mesh(), tie.nodes, tie.facets, tie.reach);
      if (tied.n_tied() == 0)
        entry.fault("reach_m", fmt::format("no node lies within {} m of the faces", tie.reach));
    }
    setup.ties.push_back(std::move(tie));
  });
}

void read_friction(Section& entry, double& friction, double& penalty) {
  entry.real("friction", friction, {.unit = "1", .min = 0.0, .help = "Coulomb coefficient"});
  entry.real("penalty", penalty,
             {.unit = "1",
              .min = 0.0,
              .above_min = true,
              .help = "contact stiffness over that of the elements there, m (c/L)^2"});
}

void read_walls(Section& solid, const SetNames& names, SolidSetup& setup) {
  solid.tables("wall", "a rigid plane that nodes cannot pass", [&](Section& entry, std::size_t) {
    WallKeys wall{.nodes =
                      names.nodes(entry, "nodes", read_name(entry, "nodes", true, "node set"))};
    entry.real3("point_m", wall.point,
                {.unit = "m", .required = true, .help = "a point of the plane"});
    entry.real3("normal", wall.normal,
                {.unit = "1", .required = true, .help = "normal, towards the body"});
    if (!entry.listing() && wall.normal == std::array<double, 3>{})
      entry.fault("normal", "is zero");
    read_friction(entry, wall.friction, wall.penalty);
    setup.walls.push_back(std::move(wall));
  });
}

void read_contacts(Section& solid, const SetNames& names, SolidSetup& setup) {
  solid.tables("contact", "two surfaces that push each other", [&](Section& entry, std::size_t) {
    ContactKeys contact{
        .first = names.facets(entry, "faces", read_name(entry, "faces", true, "face set")),
        .second = names.facets(entry, "against",
                               read_name(entry, "against", true, "the other face set"))};
    read_friction(entry, contact.friction, contact.penalty);
    entry.real("reach_m", contact.reach,
               {.unit = "m",
                .min = 0.0,
                .help = "depth beyond which a node counts as elsewhere; 0: an element's length"});
    setup.contacts.push_back(std::move(contact));
  });
}

void read_springs(Section& solid, const SetNames& names, SolidSetup& setup) {
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

void read_pressures(Section& solid, const SetNames& names, SolidSetup& setup) {
  solid.tables("pressure", "pressure that follows a surface", [&](Section& entry, std::size_t) {
    PressureLoad load{
        .facets = names.facets(entry, "faces", read_name(entry, "faces", true, "face set"))};
    std::filesystem::path table;
    load.by_facet = !entry.listing() && entry.has("table");
    if (entry.listing() || load.by_facet)
      entry.file("table", table,
                 {.help = "instead of times and overpressures: CSV file of a line of titles, "
                          "then time_s and an overpressure (Pa) for each facet of the set"});
    if (!load.by_facet)
      load.pressure =
          read_schedule(entry, "overpressures_Pa", "Pa", "pressure less ambient at the times");
    if (load.by_facet && !load.facets.empty() && std::filesystem::is_regular_file(table)) {
      std::vector<std::string> faults;
      load.of_facet = read_schedules(table, load.facets.size(), faults);
      for (const auto& fault : faults) entry.fault("table", fault);
    }
    setup.pressures.push_back(std::move(load));
  });
}

Schedule read_factor(Section& entry) {
  Schedule factor;
  entry.reals("times_s", factor.times,
              {.unit = "s", .help = "times of the factors, ascending; default: always 1"});
  entry.reals("factors", factor.values, {.unit = "1", .help = "factors at the times"});
  if (factor.times.empty() && factor.values.empty()) return {{0.0}, {1.0}};
  if (factor.times.size() != factor.values.size()) {
    entry.fault("times_s",
                fmt::format("{} times for {} values", factor.times.size(), factor.values.size()));
    return {};
  }
  if (!std::is_sorted(factor.times.begin(), factor.times.end()))
    entry.fault("times_s", "not ascending");
  return factor;
}

void read_dead_loads(Section& solid, const SetNames& names, SolidSetup& setup) {
  solid.tables("gravity", "acceleration of the whole body", [&](Section& entry, std::size_t) {
    BodyLoad load;
    entry.real3("acceleration_m_s2", load.acceleration,
                {.unit = "m/s^2", .required = true, .help = "acceleration"});
    load.factor = read_factor(entry);
    setup.body_loads.push_back(std::move(load));
  });
  solid.tables("force", "a force of fixed direction", [&](Section& entry, std::size_t) {
    NodeLoad load{.nodes =
                      names.nodes(entry, "nodes", read_name(entry, "nodes", true, "node set"))};
    entry.real3("force_N", load.force,
                {.unit = "N", .required = true, .help = "in all, shared evenly by the nodes"});
    load.share.assign(load.nodes.size(), 1.0 / static_cast<double>(load.nodes.size()));
    load.factor = read_factor(entry);
    setup.node_loads.push_back(std::move(load));
  });
}

}  // namespace

std::vector<std::int32_t> SetNames::nodes(Section& section, std::string_view key,
                                          const std::string& name) const {
  const auto found = mesh_.node_sets.find(name);
  if (found != mesh_.node_sets.end()) return found->second;
  if (mesh_.n_cells() > 0 && !name.empty())
    note_missing(section, key, "node set", name, mesh_.node_sets);
  return {};
}

std::vector<Facet> SetNames::facets(Section& section, std::string_view key,
                                    const std::string& name) const {
  const auto found = mesh_.face_sets.find(name);
  if (found != mesh_.face_sets.end()) return found->second;
  if (mesh_.n_cells() > 0 && !name.empty())
    note_missing(section, key, "face set", name, mesh_.face_sets);
  return {};
}

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

void read_supports(Section& solid, const SetNames& names, SolidSetup& setup) {
  read_fixed(solid, names, setup);
  read_prescribed(solid, names, setup);
  read_symmetry(solid, names, setup);
  read_ties(solid, names, setup);
  read_springs(solid, names, setup);
  read_walls(solid, names, setup);
  read_contacts(solid, names, setup);
}

void read_loads(Section& solid, const SetNames& names, SolidSetup& setup) {
  read_pressures(solid, names, setup);
  read_dead_loads(solid, names, setup);
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
  // A tied node moves with its facet; moving it as well contradicts that.
  for (const auto& t : setup.ties)
    for (const auto n : TiedNodes(*setup.mesh, t.nodes, t.facets, t.reach).tied())
      for (std::size_t i = 0; i < 3; ++i)
        if (count[3 * static_cast<std::size_t>(n) + i] > 0 && ++conflicts <= 5)
          places += fmt::format("{}node {} in {} (tied)", places.empty() ? "" : ", ", n, "xyz"[i]);
  if (conflicts > 0)
    solid.fault("prescribed",
                fmt::format("{} nodes are moved by two entries: {}", conflicts, places));
}

}  // namespace ocublast::solid
