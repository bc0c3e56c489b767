#include "solid_solver/mesh/mesh_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "solid_solver/mesh/cell_geometry.hpp"

namespace ocublast::solid {
namespace {

/// Lists the first few of many like faults and counts the rest.
class Kind {
 public:
  Kind(std::string title, std::size_t limit) : title_(std::move(title)), limit_(limit) {}
  void add(const std::string& item) {
    if (count_++ < limit_) list_ += (list_.empty() ? "" : "; ") + item;
  }
  void report(std::vector<std::string>& faults) const {
    if (count_ == 0) return;
    const std::string more = count_ > limit_ ? fmt::format("; and {} more", count_ - limit_) : "";
    faults.push_back(fmt::format("{} {}: {}{}", count_, title_, list_, more));
  }
  [[nodiscard]] bool empty() const { return count_ == 0; }

 private:
  std::string title_;
  std::size_t limit_;
  std::size_t count_ = 0;
  std::string list_;
};

std::string place(const std::array<double, 3>& x) {
  return fmt::format("({:.6g}, {:.6g}, {:.6g}) m", x[0], x[1], x[2]);
}

std::string tissue_name(const SolidMesh& mesh, std::int32_t id) {
  const auto i = static_cast<std::size_t>(id);
  return id >= 0 && i < mesh.tissues.size() ? mesh.tissues[i] : fmt::format("tissue {}", id);
}

/// Numbers out of range; nothing else can be checked while there are any.
std::vector<std::string> check_ranges(const SolidMesh& mesh, std::size_t limit) {
  std::vector<std::string> faults;
  const auto n = static_cast<std::int32_t>(mesh.n_nodes());
  const auto check = [&](const std::string& what, std::span<const std::int32_t> values,
                         std::int32_t low, std::int32_t high) {
    Kind kind(fmt::format("entries of {} out of the range {}..{}", what, low, high - 1), limit);
    for (std::size_t i = 0; i < values.size(); ++i)
      if (values[i] < low || values[i] >= high)
        kind.add(fmt::format("entry {} is {}", i, values[i]));
    kind.report(faults);
  };
  const auto n_tissues = static_cast<std::int32_t>(mesh.tissues.size());
  for (const auto& shape : shapes) {
    check(fmt::format("cells/{}", shape.name), mesh.of(shape.shape).nodes, 0, n);
    check(fmt::format("tissue/{}", shape.name), mesh.of(shape.shape).tissue, 0, n_tissues);
  }
  for (const auto& [name, nodes] : mesh.node_sets) check("node_sets/" + name, nodes, 0, n);
  for (const auto& [name, facets] : mesh.face_sets) {
    std::vector<std::int32_t> corners;
    std::vector<std::int32_t> last;
    for (const auto& f : facets) {
      corners.insert(corners.end(), f.begin(), f.begin() + 2);
      last.insert(last.end(), f.begin() + 2, f.end());
    }
    check("face_sets/" + name, corners, 0, n);
    check("face_sets/" + name, last, -1, n);
  }
  for (const auto& shape : shapes)
    if (mesh.of(shape.shape).tissue.size() != mesh.count(shape.shape))
      faults.push_back(fmt::format("{} tissue ids for {} cells {}",
                                   mesh.of(shape.shape).tissue.size(), mesh.count(shape.shape),
                                   shape.name));
  if (!mesh.fibres.empty() && mesh.fibres.size() != 6 * mesh.n_cells())
    faults.push_back(fmt::format("fibres: {} numbers for {} cells, accepted 6 per cell",
                                 mesh.fibres.size(), mesh.n_cells()));
  Kind lost("nodes whose position is not a number", limit);
  for (std::size_t i = 0; i < mesh.nodes.size(); ++i)
    if (!std::isfinite(mesh.nodes[i])) lost.add(fmt::format("node {}", i / 3));
  lost.report(faults);
  return faults;
}

void check_jacobians(const SolidMesh& mesh, std::size_t limit, std::vector<std::string>& faults) {
  Kind kind("inverted or zero-volume cells (turn their node order or mend the mesh)", limit);
  for (std::size_t number = 0; number < mesh.n_cells(); ++number) {
    const auto cell = mesh.cell(number);
    const double jacobian =
        compute_cell_volume(cell.shape, cell_positions(mesh, cell.nodes).nodes()).smallest_jacobian;
    if (jacobian > 0.0) continue;
    kind.add(fmt::format("{} {} in {} at {}, Jacobian {:.3g} m^3", info(cell.shape).name,
                         cell.index, tissue_name(mesh, cell.tissue),
                         place(cell_centre(mesh, number)), jacobian));
  }
  kind.report(faults);
}

void check_nodes(const SolidMesh& mesh, std::size_t limit, std::vector<std::string>& faults) {
  std::vector<bool> used(mesh.n_nodes(), false);
  for (const auto& cells : mesh.cells)
    for (const auto n : cells.nodes) used[static_cast<std::size_t>(n)] = true;
  const auto at = [&](std::size_t n) {
    return std::array<double, 3>{mesh.nodes[3 * n], mesh.nodes[3 * n + 1], mesh.nodes[3 * n + 2]};
  };
  Kind unused("nodes that no cell uses (they have no mass)", limit);
  for (std::size_t n = 0; n < used.size(); ++n)
    if (!used[n]) unused.add(fmt::format("node {} at {}", n, place(at(n))));
  unused.report(faults);
  std::vector<std::size_t> order(mesh.n_nodes());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return at(a) < at(b); });
  Kind twice("pairs of nodes at one place (merge them: they are not connected)", limit);
  for (std::size_t i = 1; i < order.size(); ++i)
    if (at(order[i]) == at(order[i - 1]))
      twice.add(fmt::format("nodes {} and {} at {}", order[i - 1], order[i], place(at(order[i]))));
  twice.report(faults);
}

}  // namespace

bool numbers_in_range(const SolidMesh& mesh) {
  return mesh.n_nodes() > 0 && mesh.n_cells() > 0 && check_ranges(mesh, 1).empty();
}

std::vector<std::string> check_mesh(const SolidMesh& mesh, std::size_t limit) {
  if (mesh.n_nodes() == 0 || mesh.n_cells() == 0)
    return {"no cells: give nodes and cells/hex8, tet4, tet10, wedge6 or quad4"};
  auto faults = check_ranges(mesh, limit);
  if (!faults.empty()) return faults;
  check_jacobians(mesh, limit, faults);
  check_nodes(mesh, limit, faults);
  return faults;
}

std::vector<std::string> check_closed_surface(const SolidMesh& mesh, const std::string& face_set,
                                              std::size_t limit) {
  const auto& facets = mesh.face_sets.at(face_set);
  std::map<std::pair<std::int32_t, std::int32_t>, int> edges;
  double volume = 0.0;
  const auto at = [&](std::int32_t n, std::size_t i) {
    return mesh.nodes[3 * static_cast<std::size_t>(n) + i];
  };
  for (const auto& f : facets) {
    const std::size_t corners = f[3] < 0 ? 3 : 4;
    for (std::size_t c = 0; c < corners; ++c) ++edges[{f[c], f[(c + 1) % corners]}];
    for (std::size_t c = 2; c < corners; ++c) {
      const std::int32_t a = f[0];
      const std::int32_t b = f[c - 1];
      const std::int32_t d = f[c];
      volume += (at(a, 0) * (at(b, 1) * at(d, 2) - at(b, 2) * at(d, 1)) +
                 at(a, 1) * (at(b, 2) * at(d, 0) - at(b, 0) * at(d, 2)) +
                 at(a, 2) * (at(b, 0) * at(d, 1) - at(b, 1) * at(d, 0))) /
                6.0;
    }
  }
  Kind turned("edges run through twice in one direction (facets of face_sets/" + face_set +
                  " are turned or repeated)",
              limit);
  Kind open("edges of one facet only (face_sets/" + face_set + " is not closed)", limit);
  for (const auto& [edge, count] : edges) {
    const auto where =
        fmt::format("nodes {}-{} near ({:.4g}, {:.4g}, {:.4g}) m", edge.first, edge.second,
                    at(edge.first, 0), at(edge.first, 1), at(edge.first, 2));
    if (count > 1) turned.add(where);
    if (!edges.contains({edge.second, edge.first})) open.add(where);
  }
  std::vector<std::string> faults;
  turned.report(faults);
  open.report(faults);
  if (faults.empty() && volume <= 0.0)
    faults.push_back(
        fmt::format("face_sets/{} encloses {:.4g} m^3: its facets point inward; turn their "
                    "node order",
                    face_set, volume));
  return faults;
}

}  // namespace ocublast::solid
