#include "solid_solver/boundary/contact.hpp"

#include <algorithm>
#include <cmath>

namespace ocublast::solid {
namespace {

std::size_t index(std::int32_t n) {
  return static_cast<std::size_t>(n);
}

/// Friction force on a node that moves by `slide` (tangential, m) under the normal force (N);
/// updates the spring and returns the work dissipated (J) by the trapezoidal rule.
double advance_friction(double* state, const Vec3& slide, const Vec3& normal, double stiffness,
                        double limit, Vec3& force) {
  Vec3 spring{state[0] + slide[0], state[1] + slide[1], state[2] + slide[2]};
  const double across = dot(spring, normal);  // the plane may have turned
  for (std::size_t i = 0; i < 3; ++i) spring[i] -= across * normal[i];
  const double pull = stiffness * norm(spring);
  const double scale = pull > limit ? limit / pull : 1.0;
  double work = 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    state[i] = scale * spring[i];
    force[i] = -stiffness * state[i];
    work -= 0.5 * (state[3 + i] + force[i]) * slide[i];
    state[3 + i] = force[i];
  }
  return work;
}

void release(double* state) {
  std::fill(state, state + 6, 0.0);
}

}  // namespace

RigidWall::RigidWall(WallKeys keys, std::span<const double> reference)
    : keys_(std::move(keys)), friction_(6 * keys_.nodes.size(), 0.0) {
  const double length = norm(keys_.normal);
  for (double& n : keys_.normal) n /= length;
  for (const auto n : keys_.nodes)
    for (std::size_t i = 0; i < 3; ++i) reference_.push_back(reference[3 * index(n) + i]);
}

ForceWork RigidWall::apply(const StepMotion& motion, std::span<double> residual) {
  ForceWork work;
  for (std::size_t k = 0; k < keys_.nodes.size(); ++k) {
    const std::size_t at = 4 * index(keys_.nodes[k]);
    double depth = 0.0;
    for (std::size_t i = 0; i < 3; ++i)
      depth +=
          keys_.normal[i] * (keys_.point[i] - reference_[3 * k + i] - motion.displacement[at + i]);
    if (depth <= 0.0) {
      release(&friction_[6 * k]);
      continue;
    }
    const double push = keys_.stiffness[k] * depth;
    const bool counts = motion.counts(index(keys_.nodes[k]));
    if (counts) work.stored += 0.5 * push * depth;
    Vec3 force{};
    if (keys_.friction > 0.0) {
      Vec3 slide{};
      double across = 0.0;
      for (std::size_t i = 0; i < 3; ++i) across += keys_.normal[i] * motion.velocity[at + i];
      for (std::size_t i = 0; i < 3; ++i)
        slide[i] = (motion.velocity[at + i] - across * keys_.normal[i]) * motion.dt;
      const double rubbed = advance_friction(&friction_[6 * k], slide, keys_.normal,
                                             keys_.stiffness[k], keys_.friction * push, force);
      if (counts) work.dissipated += rubbed;
    }
    for (std::size_t i = 0; i < 3; ++i) residual[at + i] -= push * keys_.normal[i] + force[i];
  }
  return work;
}

void RigidWall::add_stiffness(std::span<const double> x, std::span<double> y) const {
  for (std::size_t k = 0; k < keys_.nodes.size(); ++k)
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t at = 4 * index(keys_.nodes[k]) + i;
      y[at] += keys_.stiffness[k] * x[at];
    }
}

SurfaceContact::SurfaceContact(ContactKeys keys, std::span<const double> reference)
    : keys_(std::move(keys)),
      reference_(reference.begin(), reference.end()),
      positions_(reference_) {
  passes_.push_back({.nodes = FacetSearch(keys_.first),
                     .facets = FacetSearch(keys_.second),
                     .sign = 1.0,
                     .first_state = 0});
  passes_.push_back({.nodes = FacetSearch(keys_.second),
                     .facets = FacetSearch(keys_.first),
                     .sign = -1.0,
                     .first_state = passes_[0].nodes.nodes().size()});
  friction_.assign(6 * (passes_[0].nodes.nodes().size() + passes_[1].nodes.nodes().size()), 0.0);
}

void SurfaceContact::move(const StepMotion& motion) {
  double farthest = 0.0;
  for (const auto& pass : passes_)
    for (const auto n : pass.nodes.nodes()) {
      double square = 0.0;
      for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t at = 3 * index(n) + i;
        positions_[at] = reference_[at] + motion.displacement[4 * index(n) + i];
        const double way = searched_.empty() ? 0.0 : positions_[at] - searched_[at];
        square += way * way;
      }
      farthest = std::max(farthest, square);
    }
  // Both surfaces may have moved by this: boxes grown by twice the reach still hold every node that
  // is within the reach.
  if (!searched_.empty() && 2.0 * std::sqrt(farthest) < keys_.reach) return;
  searched_ = positions_;
  for (auto& pass : passes_) pass.facets.build(positions_, 2.0 * keys_.reach);
}

SurfaceContact::Hit SurfaceContact::find(const Pass& pass, std::int32_t node) const {
  Hit hit;
  double least = keys_.reach;
  const Vec3 x = place_of(positions_, node);
  const Vec3 old = place_of(searched_, node);  // boxes are where they were at the search
  for (const auto t : pass.facets.near(old)) {
    const auto& corners = pass.facets.triangles()[index(t)];
    const Vec3 a = place_of(positions_, corners[0]);
    const Vec3 b = place_of(positions_, corners[1]);
    const Vec3 c = place_of(positions_, corners[2]);
    const Vec3 w = closest_weights(x, a, b, c);
    Vec3 gap = x;
    for (std::size_t i = 0; i < 3; ++i) gap[i] -= w[0] * a[i] + w[1] * b[i] + w[2] * c[i];
    const double distance = norm(gap);
    if (distance > least) continue;
    const Vec3 area = cross(b - a, c - a);
    const double side = dot(gap, area);
    least = distance;
    hit = {};
    if (side >= 0.0 || distance == 0.0) continue;
    hit.triangle = t;
    hit.depth = distance;
    hit.weights = w;
    for (std::size_t i = 0; i < 3; ++i) hit.normal[i] = -gap[i] / distance;
  }
  return hit;
}

void SurfaceContact::push(const Pass& pass, std::size_t k, const StepMotion& motion,
                          std::span<double> residual, ForceWork& work) {
  const auto node = pass.nodes.nodes()[k];
  double* state = &friction_[6 * (pass.first_state + k)];
  const Hit hit = find(pass, node);
  if (hit.triangle < 0) {
    release(state);
    return;
  }
  ++n_closed_;
  const double stiffness = 0.5 * keys_.stiffness[index(node)];
  const double push = stiffness * hit.depth;
  work.stored += 0.5 * push * hit.depth;
  const auto& corners = pass.facets.triangles()[index(hit.triangle)];
  Vec3 force{};
  if (keys_.friction > 0.0) {
    Vec3 slide{};
    for (std::size_t i = 0; i < 3; ++i) {
      slide[i] = motion.velocity[4 * index(node) + i];
      for (std::size_t c = 0; c < 3; ++c)
        slide[i] -= hit.weights[c] * motion.velocity[4 * index(corners[c]) + i];
    }
    const double across = dot(slide, hit.normal);
    for (std::size_t i = 0; i < 3; ++i) slide[i] = (slide[i] - across * hit.normal[i]) * motion.dt;
    work.dissipated +=
        advance_friction(state, slide, hit.normal, stiffness, keys_.friction * push, force);
  }
  for (std::size_t i = 0; i < 3; ++i) {
    const double f = push * hit.normal[i] + force[i];
    residual[4 * index(node) + i] -= f;
    for (std::size_t c = 0; c < 3; ++c) residual[4 * index(corners[c]) + i] += hit.weights[c] * f;
    total_[i] += pass.sign * f;
  }
}

ForceWork SurfaceContact::apply(const StepMotion& motion, std::span<double> residual) {
  move(motion);
  total_ = {};
  n_closed_ = 0;
  ForceWork work;
  for (const auto& pass : passes_)
    for (std::size_t k = 0; k < pass.nodes.nodes().size(); ++k)
      push(pass, k, motion, residual, work);
  return work;
}

void SurfaceContact::add_stiffness(std::span<const double> x, std::span<double> y) const {
  // A node and its facet, both free: twice the stiffness bounds the pair, in both passes.
  for (const auto& pass : passes_)
    for (const auto n : pass.nodes.nodes())
      for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t at = 4 * index(n) + i;
        y[at] += 2.0 * keys_.stiffness[index(n)] * x[at];
      }
}

}  // namespace ocublast::solid
