// Runs a named problem on as many ranks as mpirun starts and writes the whole body's motion and the
// figures that a run reports, in full precision: solid_ranks_probe PROBLEM FILE (see
// solid_ranks.cpp).

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <map>
#include <string>

#include "coupler/base/errors.hpp"
#include "solid_solver/parallel/distribute.hpp"
#include "solid_solver/parallel/wet_share.hpp"
#include "solid_solver/parallel/whole_state.hpp"
#include "tests/support/solid_runs.hpp"

namespace ocublast::solid::test {
namespace {

constexpr BlockSize size{.cells = {6, 6, 6}, .size = {0.06, 0.06, 0.06}, .distortion = 0.1};
constexpr double end = 4e-3;  ///< s; waves cross the block some ten times in it

Schedule pulse(double peak) {
  return {{0.0, 0.25 * end, 0.5 * end, end}, {0.5 * peak, peak, 0.0, 0.0}};
}

/// Two tissues, cut at mid height, the upper one stiffer.
void part_tissues(SolidMesh& mesh, Shape shape) {
  mesh.tissues = {"lower", "upper"};
  auto& cells = mesh.of(shape);
  const std::size_t n = info(shape).n_nodes;
  for (std::size_t c = 0; c < cells.tissue.size(); ++c) {
    double height = 0.0;
    for (std::size_t a = 0; a < n; ++a)
      height += mesh.nodes[3 * static_cast<std::size_t>(cells.nodes[n * c + a]) + 2] /
                static_cast<double>(n);
    cells.tissue[c] = height > 0.5 * size.size[2] ? 1 : 0;
  }
}

/// Facets of hexes as those of the tets they were cut into (every face along the same diagonals).
void cut_facets(SolidMesh& mesh) {
  std::map<std::array<std::int32_t, 3>, int> faces;
  for (const auto shape : {Shape::tet4, Shape::tet10}) {
    const std::size_t n = info(shape).n_nodes;
    for (std::size_t c = 0; c < mesh.count(shape); ++c)
      for (std::size_t skip = 0; skip < 4; ++skip) {
        std::array<std::int32_t, 3> face{};
        for (std::size_t a = 0; a < 3; ++a)
          face[a] = mesh.of(shape).nodes[n * c + (skip + 1 + a) % 4];
        std::sort(face.begin(), face.end());
        faces[face] = 1;
      }
  }
  for (auto& [name, facets] : mesh.face_sets) {
    std::vector<Facet> cut;
    for (const auto& f : facets) {
      auto face = std::array{f[0], f[1], f[2]};
      std::sort(face.begin(), face.end());
      const std::size_t k = faces.contains(face) ? 0 : 1;  // along 0-2 or along 1-3
      cut.push_back({f[k], f[k + 1], f[k + 2], -1});
      cut.push_back({f[k], f[k + 2], f[(k + 3) % 4], -1});
    }
    facets = std::move(cut);
  }
}

SolidSetup make_block_setup(Shape shape, const std::string& element) {
  auto mesh = make_block_of(shape, size);
  part_tissues(mesh, shape);
  if (shape == Shape::tet4 || shape == Shape::tet10) cut_facets(mesh);
  auto setup = make_setup(std::move(mesh), make_neo_hookean(1e6, 0.49, 1000.0), element);
  setup.materials.push_back(make_neo_hookean(5e6, 0.45, 1200.0));
  setup.material_of_tissue = {0, 1};
  setup.assembly.viscosity = {};
  setup.fixed.push_back(fixed_set(*setup.mesh, "z0", {true, true, true}));
  setup.pressures.push_back({setup.mesh->face_sets.at("x1"), pulse(5e4)});
  setup.pressures.push_back({setup.mesh->face_sets.at("z1"), pulse(2e4)});
  return setup;
}

/// Everything that acts on nodes; half the body remembers.
SolidSetup make_loaded() {
  auto setup = make_block_setup(Shape::hex8, "hex8_one_point");
  const auto& sets = setup.mesh->node_sets;
  setup.materials[1].prony_ratios = {0.3};
  setup.materials[1].prony_times = {1e-4};
  setup.springs.push_back({.nodes = sets.at("x0"),
                           .stiffness = std::vector<double>(sets.at("x0").size(), 500.0),
                           .damping = std::vector<double>(sets.at("x0").size(), 0.05)});
  setup.body_loads.push_back({.acceleration = {0.0, 0.0, -9.81}, .factor = {{0.0}, {1.0}}});
  setup.node_loads.push_back(
      {.nodes = sets.at("y1"),
       .share = std::vector<double>(sets.at("y1").size(),
                                    1.0 / static_cast<double>(sets.at("y1").size())),
       .force = {0.0, 20.0, 0.0},
       .factor = {{0.0}, {1.0}}});
  setup.walls.push_back({.nodes = sets.at("x0"),
                         .point = {-1e-5, 0.0, 0.0},
                         .normal = {1.0, 0.0, 0.0},
                         .friction = 0.3});
  setup.planes.push_back({.nodes = sets.at("y0"), .normal = {0.0, 1.0, 0.0}});
  setup.mass_damping = 50.0;
  return setup;
}

/// A block of tets on a block of hexes: tied, or 10 um apart and falling on it.
SolidSetup make_pair(double gap) {
  auto mesh = make_block({.cells = {6, 6, 3}, .size = {0.06, 0.06, 0.03}});
  auto upper = to_tets(make_block({.cells = {4, 4, 3}, .size = {0.06, 0.06, 0.03}}));
  cut_facets(upper);
  const auto shift = static_cast<std::int32_t>(mesh.n_nodes());
  for (std::size_t n = 0; n < upper.n_nodes(); ++n)
    mesh.nodes.insert(mesh.nodes.end(), {upper.nodes[3 * n], upper.nodes[3 * n + 1],
                                         upper.nodes[3 * n + 2] + 0.03 + gap});
  for (const auto n : upper.of(Shape::tet4).nodes) mesh.of(Shape::tet4).nodes.push_back(n + shift);
  mesh.of(Shape::tet4).tissue = upper.of(Shape::tet4).tissue;
  for (const char* set : {"z0", "z1"}) {
    auto& nodes = mesh.node_sets[std::string("upper_") + set];
    for (const auto n : upper.node_sets.at(set)) nodes.push_back(n + shift);
    auto& facets = mesh.face_sets[std::string("upper_") + set];
    for (const auto& f : upper.face_sets.at(set))
      facets.push_back({f[0] + shift, f[1] + shift, f[2] + shift, -1});
  }
  auto setup = make_setup(std::move(mesh), make_neo_hookean(1e6, 0.45, 1000.0));
  setup.assembly.viscosity = {};
  setup.fixed.push_back(fixed_set(*setup.mesh, "z0", {true, true, true}));
  setup.pressures.push_back({setup.mesh->face_sets.at("upper_z1"), pulse(5e4)});
  return setup;
}

SolidSetup make_problem(const std::string& name) {
  if (name == "hex8_q1p0" || name.starts_with("coupled"))
    return make_block_setup(Shape::hex8, "hex8_q1p0");
  if (name == "hex8_one_point") return make_block_setup(Shape::hex8, "hex8_one_point");
  if (name == "tet4_anp") return make_block_setup(Shape::tet4, "tet4_anp");
  if (name == "tet10") return make_block_setup(Shape::tet10, "tet10");
  if (name == "loaded") return make_loaded();
  if (name == "equilibrium") {
    auto setup = make_block_setup(Shape::hex8, "hex8_q1p0");
    setup.pressures.front().pressure = {{0.0}, {2e3}};
    setup.pressures.back().pressure = {{0.0, 0.25 * end, 0.5 * end}, {0.0, 2e4, 0.0}};
    return setup;
  }
  if (name == "tie") {
    auto setup = make_pair(0.0);
    setup.ties.push_back({.nodes = setup.mesh->node_sets.at("upper_z0"),
                          .facets = setup.mesh->face_sets.at("z1"),
                          .reach = 1e-4});
    return setup;
  }
  if (name == "contact") {
    auto setup = make_pair(1e-5);
    setup.contacts.push_back({.first = setup.mesh->face_sets.at("upper_z0"),
                              .second = setup.mesh->face_sets.at("z1"),
                              .friction = 0.2});
    return setup;
  }
  throw CaseError("no problem " + name);
}

/// Windows of coupling: loads that jump and loads that are linear, 10 of them.
enum class Given { pressures, forces };
std::vector<double> run_coupled_windows(SolidRun& solid, WetShare& share, std::size_t n_vertices,
                                        Given given) {
  std::vector<double> figures;
  const bool forces = given == Given::forces;
  const double peak = forces ? 2.0 : 3e4;  // N at a node, Pa
  std::vector<double> load(forces ? 3 * n_vertices : n_vertices);
  for (int w = 0; w < 10; ++w) {
    for (std::size_t v = 0; v < load.size(); ++v)
      load[v] = w < 7 ? peak * std::sin(0.4 * (w + 1) + 1e-2 * static_cast<double>(v)) : 0.0;
    Window window{.t_begin = solid.state().time,
                  .t_end = end * (w + 1) / 10,
                  .shape = w % 2 == 0 ? InterfaceLoad::linear : InterfaceLoad::constant};
    if (forces)
      window.force = share.scatter_forces(load);
    else
      window.overpressure = share.scatter_pressure(load);
    const auto result = solid.advance(window);
    figures.insert(figures.end(),
                   {result.interface_work, result.interface_impulse[0], result.interface_impulse[1],
                    result.interface_impulse[2], solid.mass_per_area(end / 10)});
  }
  return figures;
}

/// Faults of copies of a node that differ in a bit.
std::size_t count_unlike_copies(const SolidRun& solid, const Ranks& ranks) {
  std::vector<std::int64_t> numbers;
  std::vector<double> values;
  for (std::size_t n = 0; n < solid.mesh().n_nodes(); ++n) {
    numbers.push_back(static_cast<std::int64_t>(solid.team().number(n)));
    for (std::size_t i = 0; i < 3; ++i)
      values.insert(values.end(),
                    {solid.state().displacement[4 * n + i], solid.state().velocity[4 * n + i]});
    values.push_back(solid.nodal_mass()[n]);
  }
  const auto all_numbers = ranks.gather(std::span<const std::int64_t>(numbers));
  const auto all_values = ranks.gather(std::span<const double>(values));
  std::map<std::int64_t, const double*> first;
  std::size_t unlike = 0;
  for (std::size_t r = 0; r < all_numbers.size(); ++r)
    for (std::size_t k = 0; k < all_numbers[r].size(); ++k) {
      const auto [entry, added] = first.try_emplace(all_numbers[r][k], &all_values[r][7 * k]);
      if (!added && std::memcmp(entry->second, &all_values[r][7 * k], 7 * sizeof(double)) != 0)
        ++unlike;
    }
  return unlike;
}

int run_problem(const std::string& name, const std::string& file, const Ranks& ranks) {
  auto setup = make_problem(name);
  if (name.starts_with("coupled")) setup.interface = setup.mesh->face_sets.at("wet");
  const auto whole = setup.mesh;
  const double imbalance = distribute(setup, ranks);
  SolidRun solid(std::move(setup));
  std::vector<double> figures{solid.stable_step(), solid.smallest_element().step};
  if (name == "equilibrium") figures.push_back(static_cast<double>(solid.relax(1e-4, 20000).steps));
  if (name.starts_with("coupled")) {
    WetShare share(whole.get(), "wet", solid);
    const auto n = make_wet_surface(*whole, "wet").nodes.size();
    const auto more =
        run_coupled_windows(solid, share, n, name == "coupled" ? Given::pressures : Given::forces);
    figures.insert(figures.end(), more.begin(), more.end());
  } else {
    for (int w = 1; w <= 4; ++w)
      solid.advance({.t_begin = solid.state().time, .t_end = end * w / 4});
  }
  CellResults cells;
  solid.assembly().evaluate(solid.state().displacement, cells);
  const auto e = solid.compute_energies(cells);
  figures.insert(figures.end(), {e.kinetic, e.internal, e.hourglass, e.relaxation, e.viscous,
                                 e.spring, e.damping, e.external, e.initial});
  for (const double p : solid.momenta()) figures.push_back(p);
  WholeState state(whole, solid);
  const auto view = state.gather(solid, cells);
  const auto unlike = count_unlike_copies(solid, ranks);
  if (!ranks.root()) return 0;
  std::ofstream out(file, std::ios::binary);
  const auto write = [&](std::span<const double> values) {
    const std::uint64_t n = values.size();
    out.write(reinterpret_cast<const char*>(&n), sizeof n);
    out.write(reinterpret_cast<const char*>(values.data()), static_cast<std::streamsize>(8 * n));
  };
  write(figures);
  write(view.displacement);
  write(view.velocity);
  write(view.cells);
  std::printf("%s: %d ranks, %.0f steps, imbalance %.3f, %zu unlike copies, energy error %.2g\n",
              name.c_str(), ranks.size(), solid.sums().steps, imbalance, unlike, e.error);
  return unlike == 0 ? 0 : 1;
}

}  // namespace
}  // namespace ocublast::solid::test

int main(int, char** argv) {
  return ocublast::run_on_ranks("solid_ranks_probe", [&](const ocublast::Ranks& ranks) {
    return ocublast::solid::test::run_problem(argv[1], argv[2], ranks);
  });
}
