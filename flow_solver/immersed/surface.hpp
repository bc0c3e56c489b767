#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "flow_solver/immersed/immersed_boundary.hpp"
#include "flow_solver/immersed/vec3.hpp"

namespace ocublast::flow {

using Corners = std::array<std::int32_t, 3>;

/// What does not change when a closed triangulated surface moves.
struct SurfaceTopology {
  std::vector<Corners> facet;      ///< vertices, counter-clockwise seen from the gas
  std::vector<Corners> neighbour;  ///< facet across the edge from corner e to corner e + 1
  /// Smooth vertex of each corner: corners of one vertex share one as long as they are reached over
  /// edges flatter than the smoothing angle, so that a normal is never averaged across a sharp
  /// edge.
  std::vector<Corners> smooth_vertex;
  std::vector<std::uint8_t> sharp;  ///< bit e: the edge from corner e to e + 1 is sharp
  std::int32_t n_smooth_vertices = 0;
  std::vector<std::int32_t>
      around_first;  ///< [n_vertices + 1] start of a vertex's facets in `around`
  std::vector<std::int32_t> around;
  /// Of a facet that is half of a quad: the quad's corner it lacks (-1: no quad), and its own
  /// corner opposite the cut, 0 to 2.
  struct QuadHalf {
    std::int32_t fourth = -1;
    std::int32_t apex = 0;
  };
  std::vector<QuadHalf> quad_half;  ///< per facet
};

/// What follows from the positions of the vertices.
struct FacetGeometry {
  std::vector<Vec3> normal;         ///< unit, into the gas, per facet
  std::vector<double> area;         ///< m^2, per facet
  std::vector<Vec3> smooth_normal;  ///< unit, per smooth vertex
};

/// Faults of a body's surface, one text each: indices out of range, values that are not finite,
/// facets without area, edges that two facets run through the same way (one of them is inverted),
/// open edges, no volume. Empty when the surface is closed and consistently oriented.
[[nodiscard]] std::vector<std::string> find_surface_faults(const Body& body);

/// Turns all triangles round when the enclosed volume is negative.
void orient_outward(BodySurface& surface);

/// Volume [m^3] enclosed, positive when the triangles are oriented outward.
[[nodiscard]] double enclosed_volume(const BodySurface& surface);

/// Adjacency and smoothing groups of a surface without faults. Edges whose facets meet at less than
/// `smooth_below_degrees` are smooth.
[[nodiscard]] SurfaceTopology make_surface_topology(const BodySurface& surface,
                                                    double smooth_below_degrees);

/// Normals and areas for vertices at `position` [n_vertices, 3], m. Vertex normals with the weights
/// of Max (1999), doi:10.1080/10867651.1999.10487501: exact for vertices on a sphere.
void compute_facet_geometry(const SurfaceTopology& topology, std::span<const double> position,
                            FacetGeometry& geometry);

}  // namespace ocublast::flow
