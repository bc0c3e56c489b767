#pragma once

#include <array>
#include <cstdint>

#include "flow_solver/immersed/bodies.hpp"

namespace ocublast::flow {

/// Where a point behind a wall has its nearest wall point, and the wall's normal there.
struct Foot {
  Vec3 point;                      ///< m, on the surface
  Vec3 normal;                     ///< unit, into the gas
  double depth = 0.0;              ///< m, of the point below the surface; negative: in front of it
  std::array<double, 3> weight{};  ///< barycentric, of the facet's corners
  /// 1/m, symmetric part of the gradient of the smooth normal: xx, yy, zz, xy, yz, zx. Positive
  /// along a convex direction, zero on facets with sharp edges all round.
  std::array<double, 6> curvature{};
  std::int32_t body = -1;
  std::int32_t facet = -1;
};

/// Facets whose normal has less than this share along the crossed facet's normal belong to another
/// side of the body.
inline constexpr double same_side_cosine = 0.2;

/// Nearest foot of x among the exposed facets on the side of the crossed facet that have x behind
/// them. The crossed facet itself always qualifies: x lies behind it, at most |x - crossing| away.
/// `near`: a foot that may be close (of the next ghost, of the last topology), null: none; it only
/// shortens the search. `alone` tells whether no facet of another side is nearer, and no second one
/// equally near, so that other walls around x find the same (is_foot_of).
[[nodiscard]] Foot find_foot(const Bodies& bodies, const Vec3& x, const Vec3& crossing,
                             std::int32_t body, std::int32_t facet, const Foot* near,
                             bool* alone = nullptr);

/// Would find_foot from this wall find the foot of x that stands alone for another wall?
[[nodiscard]] bool is_foot_of(const Bodies& bodies, const Foot& foot, const Vec3& x,
                              const Vec3& crossing, std::int32_t body, std::int32_t facet);

/// The foot of x after its facet moved: on the same facet or, past its edge, on a neighbour.
/// `side` is the crossed facet's normal.
[[nodiscard]] Foot follow_foot(const Bodies& bodies, const Vec3& x, const Foot& foot,
                               const Vec3& side);

/// Nearest exposed point of all bodies to x, whatever its side, within `reach` (m); body -1: none.
[[nodiscard]] Foot nearest_foot(const Bodies& bodies, const Vec3& x, double reach);

/// The foot of a point on the facet itself, with the facet's own normal.
[[nodiscard]] Foot foot_on_facet(const BodyState& body, std::int32_t facet, const Vec3& point);

/// Value at the foot of a vertex field [n_vertices, 3] of its body.
[[nodiscard]] Vec3 at_foot(const BodyState& body, const Foot& foot,
                           const std::vector<double>& vertex_field);

/// A point this share of a facet's size outside the surface decides whether the surface is exposed.
inline constexpr double off_surface = 1e-6;

/// Is the surface point x of a body, with the normal of its facet there, covered by another body?
[[nodiscard]] bool is_covered(const Bodies& bodies, std::int32_t body, std::int32_t facet,
                              const Vec3& x);

}  // namespace ocublast::flow
