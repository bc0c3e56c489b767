#include <algorithm>

#include "solid_solver/mesh/cell_geometry.hpp"
#include "solid_solver/step.hpp"

// What a run is made of: masses, constraints, loads and forces from the set-up.

namespace ocublast::solid {
namespace {

std::size_t index(std::int32_t n) {
  return static_cast<std::size_t>(n);
}

/// Per node the smallest element length (m) and passage time (s) there.
struct NodeScales {
  std::vector<double> length;
  std::vector<double> transit;
};
NodeScales node_scales(Assembly& assembly) {
  const auto& mesh = assembly.mesh();
  NodeScales scales{.length = std::vector<double>(mesh.n_nodes(), 1e300),
                    .transit = std::vector<double>(mesh.n_nodes(), 1e300)};
  for (std::size_t number = 0; number < mesh.n_cells(); ++number) {
    const auto cell = mesh.cell(number);
    const double length =
        assembly.element_of(cell).geometry.length(cell_positions(mesh, cell.nodes).nodes());
    const double transit = length / assembly.material_of_cell(number).sound_speed();
    for (const auto n : cell.nodes) {
      scales.length[index(n)] = std::min(scales.length[index(n)], length);
      scales.transit[index(n)] = std::min(scales.transit[index(n)], transit);
    }
  }
  assembly.team().take_least_nodal(scales.length);
  assembly.team().take_least_nodal(scales.transit);
  return scales;
}

}  // namespace

void SolidRun::build_constraints() {
  mass_ = assembly_->nodal_mass();
  for (const auto& t : setup_.ties)
    constraints_.push_back(std::make_unique<TiedNodes>(mesh(), t.nodes, t.facets, t.reach));
  for (const auto& p : setup_.planes)
    constraints_.push_back(std::make_unique<SlidingPlane>(p.nodes, p.normal));
  for (const auto& c : constraints_) c->move_mass(mass_);
}

void SolidRun::build_inverse_mass() {
  inverse_mass_.assign(4 * mass_.size(), 0.0);
  for (std::size_t n = 0; n < mass_.size(); ++n)
    for (std::size_t i = 0; i < (assembly_->planar_nodes()[n] ? 2u : 3u); ++i)
      if (mass_[n] > 0.0) inverse_mass_[4 * n + i] = 1.0 / mass_[n];
  for (const auto& f : setup_.fixed)
    for (const auto n : f.nodes)
      for (std::size_t i = 0; i < 3; ++i)
        if (f.directions[i]) inverse_mass_[4 * index(n) + i] = 0.0;
  for (const auto& p : setup_.prescribed)
    for (const auto n : p.nodes) inverse_mass_[4 * index(n) + p.direction] = 0.0;
}

void SolidRun::build_loads() {
  bool rings = false;
  for (const auto& block : assembly_->blocks()) rings = rings || block.type().axisymmetric;
  const auto edges =
      team().any(rings) ? FollowerPressure::Edges::rings : FollowerPressure::Edges::strips;
  const auto add_load = [&](const std::vector<Facet>& facets, Schedule schedule, bool coupled) {
    Load load{.surface = FollowerPressure(mesh(), facets, edges),
              .schedule = std::move(schedule),
              .coupled = coupled};
    const std::size_t n = load.surface.nodes().size();
    load.pressure.assign(n, 0.0);
    load.forces.assign(3 * n, 0.0);
    load.last_end.assign(n, 0.0);
    loads_.push_back(std::move(load));
  };
  for (const auto& p : setup_.pressures) {
    add_load(p.facets, p.pressure, false);
    if (p.by_facet)
      loads_.back().by_facet = std::make_unique<FacetPressure>(mesh(), p.facets, edges, p.of_facet,
                                                               loads_.back().surface.nodes());
  }
  coupled_ = team().any(!setup_.interface.empty());
  if (coupled_) add_load(setup_.interface, {}, true);
}

void SolidRun::build_forces() {
  for (const auto& load : setup_.body_loads)
    forces_.push_back(std::make_unique<DeadLoad>(load, assembly_->nodal_mass()));
  for (const auto& load : setup_.node_loads) forces_.push_back(std::make_unique<DeadLoad>(load));
  for (const auto& set : setup_.springs) forces_.push_back(std::make_unique<Springs>(set));
  if (!setup_.walls.empty() || !setup_.contacts.empty()) build_contacts();
  if (setup_.mass_damping > 0.0)
    forces_.push_back(std::make_unique<MassDamping>(setup_.mass_damping, mass_));
}

void SolidRun::build_contacts() {
  const auto scales = node_scales(*assembly_);
  const auto stiffness = [&](std::size_t n, double penalty) {
    return penalty * mass_[n] / (scales.transit[n] * scales.transit[n]);
  };
  for (auto wall : setup_.walls) {
    for (const auto n : wall.nodes) wall.stiffness.push_back(stiffness(index(n), wall.penalty));
    forces_.push_back(std::make_unique<RigidWall>(std::move(wall), mesh().nodes));
  }
  for (auto contact : setup_.contacts) {
    for (std::size_t n = 0; n < mass_.size(); ++n)
      contact.stiffness.push_back(stiffness(n, contact.penalty));
    double least = 1e300;
    for (const auto* facets : {&contact.first, &contact.second})
      for (const auto& f : *facets)
        for (const auto n : f)
          if (n >= 0) least = std::min(least, scales.length[index(n)]);
    if (contact.reach <= 0.0) contact.reach = least;
    forces_.push_back(std::make_unique<SurfaceContact>(std::move(contact), mesh().nodes));
  }
}

}  // namespace ocublast::solid
