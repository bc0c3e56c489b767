#include "flow_solver/immersed/wall_thickness.hpp"

#include <cmath>

namespace ocublast::flow {
namespace {

constexpr double farthest = 0.6;     // cells
constexpr double renew_after = 0.1;  // cells

/// Distance [m] from x along unit direction d to triangle (a, b, c), HUGE_VAL: missed.
/// Moeller and Trumbore (1997), doi:10.1080/10867651.1997.10487468.
double ray_distance(const Vec3& x, const Vec3& d, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 ab = b - a;
  const Vec3 ac = c - a;
  const Vec3 p = cross(d, ac);
  const double det = dot(ab, p);
  if (det == 0.0) return HUGE_VAL;
  const Vec3 s = x - a;
  const double u = dot(s, p) / det;
  const Vec3 q = cross(s, ab);
  const double v = dot(d, q) / det;
  if (u < 0.0 || v < 0.0 || u + v > 1.0) return HUGE_VAL;
  return dot(ac, q) / det;
}

bool has_moved(const std::vector<double>& from, const std::vector<double>& to, double distance) {
  if (from.size() != to.size()) return true;
  for (std::size_t n = 0; n < to.size(); ++n) {
    if (std::abs(to[n] - from[n]) > distance) return true;
  }
  return false;
}

double measure(const BodyState& s, std::int32_t f, double reach) {
  const Corners& v = s.topology.facet[f];
  const Vec3 x = (1.0 / 3.0) * (s.vertex(v[0]) + s.vertex(v[1]) + s.vertex(v[2]));
  const Vec3 inward = -1.0 * s.geometry.normal[f];
  Box range;
  range.include(x);
  range.include(x + reach * inward);
  double nearest = HUGE_VAL;
  s.tree.visit(range, [&](std::int32_t g) {
    // Seen from inside, the far wall's normal points the way the ray goes.
    if (g == f || dot(s.geometry.normal[g], inward) <= 0.0) return;
    const Corners& w = s.topology.facet[g];
    const double t = ray_distance(x, inward, s.vertex(w[0]), s.vertex(w[1]), s.vertex(w[2]));
    if (t > 0.0 && t <= reach && t < nearest) nearest = t;
  });
  return nearest;
}

}  // namespace

void WallThickness::update(const BodyState& body, double h) {
  if (!has_moved(measured_at_, body.position, renew_after * h)) return;
  measured_at_ = body.position;
  thickness_.resize(body.n_facets());
  const auto n = static_cast<std::int32_t>(body.n_facets());
#pragma omp parallel for schedule(static) if (n > 1000)
  for (std::int32_t f = 0; f < n; ++f) thickness_[f] = measure(body, f, farthest * h);
}

}  // namespace ocublast::flow
