#pragma once

#include <span>
#include <vector>

#include "flow_solver/immersed/ghost_stencil.hpp"

namespace ocublast::flow::inline OCU_PRECISION {

/// Gas state read at a facet.
struct FacetReading {
  Vec3 point;                      ///< m, middle of the exposed part
  std::array<double, 3> weight{};  ///< barycentric, of `point`
  double twist = 0.0;         ///< half of a quad: what its bilinear shapes add, see load_shares
  double exposed = 0.0;       ///< share of the facet in the gas: 0, 1/16, .. 1
  double overpressure = 0.0;  ///< Pa, at `point`
  double impedance = 0.0;     ///< kg/(m^2 s), rho c there
  double added_mass = 0.0;    ///< kg/m^2, of the gas between the wall and what is read
  Vec3 shear;                 ///< Pa, traction on the body along the wall
  double heat = 0.0;          ///< W/m^2 into the body
};

/// What is read, and where.
struct ReadOut {
  FluidNodes nodes;
  const Bodies& bodies;
  GasNodes W;
  const Gas& gas;
  const WallTransport& transport;
};

/// Overpressure on all facets of body b at the middle of the exposed part: linear along the wall
/// through the nodes in front of it (fit_at_wall), each corrected to the wall with the slope of the
/// ghosts' pressure. Shear and heat flux from the parabola through the wall and two points one and
/// two spacings away. A facet counts as covered where another body lies on it, where it lies
/// outside the grid, and where its normal has no part in a present direction.
[[nodiscard]] std::vector<FacetReading> read_facets(const ReadOut& read, std::size_t b,
                                                    double ambient_pressure);

/// Vertices that carry a facet's load, and their shares of it.
struct LoadShares {
  std::array<std::int32_t, 4> vertex{};
  std::array<double, 4> share{};
  int n = 0;
};

/// Shares of the exposed part of facet f: barycentric on a triangle; on half of a quad the mean of
/// the quad's bilinear shapes over that part. With w the barycentric weights of the two ends of the
/// cut, their product moves from both ends to the other two corners: xi (1 - eta) = w_apex + w_1
/// w_2, and so on. Shares of a parallelogram's halves add up to a quarter for each corner, and keep
/// the moment.
[[nodiscard]] LoadShares load_shares(const SurfaceTopology& topology, std::size_t f,
                                     const FacetReading& reading);

/// The same at the vertices, for a structure that takes pressure as linear over each facet. Each
/// facet's force goes to vertices by load_shares; a vertex's pressure is the one whose force there,
/// over its share of the facets around, has the same part along their summed normal. A uniform
/// pressure stays uniform. Where another body covers a part, all change by up to 5 % so that the
/// whole force is that of the readings.
void spread_to_vertices(const Grid& grid, const BodyState& body,
                        const std::vector<FacetReading>& facets, std::span<double> at_vertices);

/// Forces at the vertices [n_vertices, 3], N, for a structure that takes them: each facet's
/// pressure and shear on its exposed part go to vertices by load_shares. Force and power of the
/// vertices are those of integrate_load, however facets are covered.
void spread_forces(const BodyState& body, const std::vector<FacetReading>& facets,
                   std::span<double> at_vertices);

/// Tractions of shear at the vertices [n_vertices, 3], the same mean.
void spread_shear(const Grid& grid, const BodyState& body, const std::vector<FacetReading>& facets,
                  std::span<double> at_vertices);

/// Force, moment, power, impedance of the readings on body b.
[[nodiscard]] BodyLoad integrate_load(const BodyState& body,
                                      const std::vector<FacetReading>& facets);

}  // namespace ocublast::flow
