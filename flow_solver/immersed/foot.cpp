#include "flow_solver/immersed/foot.hpp"

#include <algorithm>
#include <cmath>

namespace ocublast::flow {
namespace {

/// A barycentric weight below this puts the foot on the opposite edge.
constexpr double on_edge = 1e-9;
/// Rounding of "x lies behind the facet", of the distance: feet on edges are nearest to two facets.
constexpr double behind_rounding = 1e-9;

bool on_sharp_edge(const SurfaceTopology& topology, std::int32_t f,
                   const std::array<double, 3>& weight) {
  for (std::size_t e = 0; e < 3; ++e) {
    const bool touches = weight[(e + 2) % 3] < on_edge;  // edge e joins corners e and e + 1
    if (touches && (topology.sharp[f] >> e & 1U) != 0) return true;
  }
  return false;
}

/// Gradient over a facet of the normal interpolated between its corners.
std::array<double, 6> normal_gradient(const BodyState& s, std::int32_t f) {
  const Corners& v = s.topology.facet[f];
  const Corners& smooth = s.topology.smooth_vertex[f];
  const double per_area = 0.5 / s.geometry.area[f];
  std::array<double, 6> g{};
  for (std::size_t c = 0; c < 3; ++c) {
    const Vec3 opposite = s.vertex(v[(c + 2) % 3]) - s.vertex(v[(c + 1) % 3]);
    const Vec3 slope = per_area * cross(s.geometry.normal[f], opposite);
    const Vec3& n = s.geometry.smooth_normal[smooth[c]];
    for (std::size_t a = 0; a < 3; ++a) {
      g[a] += n.c[a] * slope.c[a];
      const std::size_t b = (a + 1) % 3;
      g[3 + a] += 0.5 * (n.c[a] * slope.c[b] + n.c[b] * slope.c[a]);
    }
  }
  return g;
}

/// Completes a foot from its facet and point: normal and depth of x.
Foot make_foot(const Bodies& bodies, const Vec3& x, std::int32_t b, std::int32_t f,
               const TrianglePoint& at, const Vec3* side, const Foot* before = nullptr) {
  const BodyState& s = bodies[b];
  Foot foot{.point = at.point, .weight = at.weight, .body = b, .facet = f};
  const Vec3 up = at.point - x;
  const double distance = norm(up);
  const Vec3& facet_normal = s.geometry.normal[f];
  foot.depth = dot(up, facet_normal) >= 0.0 ? distance : -distance;
  if (on_sharp_edge(s.topology, f, at.weight)) {
    // In a re-entrant edge the way to the foot is the normal of both walls' bisecting fan; on the
    // rim of a plate it would tilt towards the other side, there the facet's own normal serves.
    const double scale = std::sqrt(s.geometry.area[f]);
    const Vec3 direction = foot.depth > off_surface * scale ? (1.0 / distance) * up : facet_normal;
    const bool usable = dot(direction, side != nullptr ? *side : facet_normal) > same_side_cosine;
    foot.normal = usable ? direction : facet_normal;
    foot.depth = dot(up, foot.normal);
    return foot;
  }
  const Corners& smooth = s.topology.smooth_vertex[f];
  Vec3 n = at.weight[0] * s.geometry.smooth_normal[smooth[0]];
  n = n + at.weight[1] * s.geometry.smooth_normal[smooth[1]];
  n = n + at.weight[2] * s.geometry.smooth_normal[smooth[2]];
  foot.normal = unit(n);
  // A facet that moved on has the curvature it had until its foot is searched anew.
  foot.curvature =
      before != nullptr && before->facet == f ? before->curvature : normal_gradient(s, f);
  return foot;
}

TrianglePoint on_facet(const BodyState& s, std::int32_t f, const Vec3& x) {
  const Corners& v = s.topology.facet[f];
  return nearest_on_triangle(x, s.vertex(v[0]), s.vertex(v[1]), s.vertex(v[2]));
}

}  // namespace

bool is_covered(const Bodies& bodies, std::int32_t body, std::int32_t facet, const Vec3& x) {
  if (bodies.size() < 2) return false;
  const FacetGeometry& geometry = bodies[body].geometry;
  const double lift = off_surface * std::sqrt(geometry.area[facet]);
  return bodies.inside_any(x + lift * geometry.normal[facet], body);
}

bool is_foot_of(const Bodies& bodies, const Foot& foot, const Vec3& x, const Vec3& crossing,
                std::int32_t body, std::int32_t facet) {
  const Vec3& n = bodies[foot.body].geometry.normal[foot.facet];
  return dot(n, bodies[body].geometry.normal[facet]) > same_side_cosine &&
         norm2(foot.point - x) < norm2(x - crossing);
}

Foot find_foot(const Bodies& bodies, const Vec3& x, const Vec3& crossing, std::int32_t body,
               std::int32_t facet, const Foot* near, bool* alone) {
  const Vec3 side = bodies[body].geometry.normal[facet];
  double best2 = norm2(x - crossing) * (1.0 + on_edge);
  TrianglePoint best;
  std::int32_t best_body = -1;
  std::int32_t best_facet = -1;
  double other_side2 = HUGE_VAL;
  const auto qualifies = [&](std::int32_t b, std::int32_t g, const Vec3& point) {
    const BodyState& s = bodies[b];
    const Vec3& n_g = s.geometry.normal[g];
    if (s.buried[g] != 0) return false;
    if (dot(n_g, side) <= same_side_cosine) {
      other_side2 = std::min(other_side2, norm2(point - x));
      return false;
    }
    return dot(x - point, n_g) <= behind_rounding * norm(x - point) &&
           !is_covered(bodies, b, g, point);
  };
  if (near != nullptr && near->body >= 0) {
    const TrianglePoint there = on_facet(bodies[near->body], near->facet, x);
    const double d2 = norm2(there.point - x);
    if (d2 < best2 && qualifies(near->body, near->facet, there.point)) {
      best2 = d2;
      best = there;
      best_body = near->body;
      best_facet = near->facet;
    }
  }
  for (std::size_t n = 0; n < bodies.size(); ++n) {
    // The crossed body first: its foot bounds the search in the others.
    const auto b = static_cast<std::int32_t>(
        n == 0 ? body : (static_cast<std::int32_t>(n) <= body ? n - 1 : n));
    const BodyState& s = bodies[b];
    if (s.tree.box().distance2(x) >= best2) continue;
    const std::int32_t f = s.tree.nearest(
        x, best2, best, [&](std::int32_t g, const Vec3& point) { return qualifies(b, g, point); });
    if (f >= 0) {
      best_body = b;
      best_facet = f;
    }
  }
  if (alone != nullptr) {
    // On an edge two facets are equally near.
    *alone = best_body >= 0 && other_side2 > best2 &&
             *std::min_element(best.weight.begin(), best.weight.end()) > on_edge;
  }
  if (best_body >= 0) return make_foot(bodies, x, best_body, best_facet, best, &side);
  // Nothing nearer than the crossing itself: the crossed facet's plane.
  Foot foot{.point = crossing,
            .normal = side,
            .weight = on_facet(bodies[body], facet, crossing).weight,
            .body = body,
            .facet = facet};
  foot.depth = dot(crossing - x, side);
  foot.point = x + foot.depth * side;
  return foot;
}

Foot follow_foot(const Bodies& bodies, const Vec3& x, const Foot& foot, const Vec3& side) {
  const BodyState& s = bodies[foot.body];
  std::int32_t f = foot.facet;
  TrianglePoint best = on_facet(s, f, x);
  double best2 = norm2(best.point - x);
  constexpr int most_hops = 2;  // a stage moves the wall by a fraction of a facet
  for (int hop = 0; hop < most_hops; ++hop) {
    std::int32_t next = -1;
    for (std::size_t e = 0; e < 3; ++e) {
      const std::int32_t g = s.topology.neighbour[f][e];
      if (best.weight[(e + 2) % 3] > on_edge || s.buried[g] != 0 ||
          dot(s.geometry.normal[g], side) <= same_side_cosine) {
        continue;
      }
      const TrianglePoint there = on_facet(s, g, x);
      const double d2 = norm2(there.point - x);
      if (d2 >= best2) continue;
      best2 = d2;
      best = there;
      next = g;
    }
    if (next < 0) break;
    f = next;
  }
  return make_foot(bodies, x, foot.body, f, best, &side, &foot);
}

Foot nearest_foot(const Bodies& bodies, const Vec3& x, double reach) {
  double best2 = reach * reach;
  TrianglePoint best;
  Foot foot;
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    const BodyState& s = bodies[b];
    const auto number = static_cast<std::int32_t>(b);
    const std::int32_t f = s.tree.nearest(x, best2, best, [&](std::int32_t g, const Vec3& point) {
      return s.buried[g] == 0 && !is_covered(bodies, number, g, point);
    });
    if (f < 0) continue;
    foot.body = number;
    foot.facet = f;
  }
  return foot.body < 0 ? foot : make_foot(bodies, x, foot.body, foot.facet, best, nullptr);
}

Foot foot_on_facet(const BodyState& body, std::int32_t facet, const Vec3& point) {
  Foot foot{.point = point,
            .normal = body.geometry.normal[facet],
            .weight = on_facet(body, facet, point).weight};
  foot.curvature = normal_gradient(body, facet);
  foot.facet = facet;
  return foot;
}

Vec3 at_foot(const BodyState& body, const Foot& foot, const std::vector<double>& vertex_field) {
  const Corners& v = body.topology.facet[foot.facet];
  return foot.weight[0] * row(vertex_field, v[0]) + foot.weight[1] * row(vertex_field, v[1]) +
         foot.weight[2] * row(vertex_field, v[2]);
}

}  // namespace ocublast::flow
