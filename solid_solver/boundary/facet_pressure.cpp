#include "solid_solver/boundary/facet_pressure.hpp"

#include <algorithm>

namespace ocublast::solid {

FacetPressure::FacetPressure(const SolidMesh& mesh, const std::vector<Facet>& facets,
                             FollowerPressure::Edges edges, std::vector<Schedule> pressures,
                             const std::vector<std::int32_t>& nodes)
    : pressures_(std::move(pressures)) {
  for (const auto& facet : facets) {
    Piece piece{.surface = FollowerPressure(mesh, {facet}, edges), .places = {}};
    for (const auto n : piece.surface.nodes())
      piece.places.push_back(static_cast<std::size_t>(
          std::lower_bound(nodes.begin(), nodes.end(), n) - nodes.begin()));
    pieces_.push_back(std::move(piece));
  }
}

void FacetPressure::compute_forces(std::span<const double> displacement, double t,
                                   std::span<double> forces) const {
  std::fill(forces.begin(), forces.end(), 0.0);
  std::array<double, 4> pressure{};
  std::array<double, 12> force{};
  for (std::size_t f = 0; f < pieces_.size(); ++f) {
    const double p = pressures_[f].value(t);
    if (p == 0.0) continue;
    const auto& [surface, places] = pieces_[f];
    const std::size_t n = places.size();
    pressure.fill(p);
    surface.compute_forces(displacement, {pressure.data(), n}, {force.data(), 3 * n});
    for (std::size_t a = 0; a < n; ++a)
      for (std::size_t i = 0; i < 3; ++i) forces[3 * places[a] + i] += force[3 * a + i];
  }
}

bool FacetPressure::quiet(double begin, double end) const {
  return std::all_of(pressures_.begin(), pressures_.end(),
                     [&](const Schedule& s) { return s.zero_in(begin, end); });
}

}  // namespace ocublast::solid
