#include "flow_solver/io/body_motions.hpp"

#include <fmt/format.h>

#include "coupler/base/errors.hpp"
#include "flow_solver/immersed/surface.hpp"

namespace ocublast::flow::inline OCU_PRECISION {
namespace {

MassProperties mass_of(const BodyCase& spec, const BodySurface& surface) {
  const FreeBodyCase& given = spec.free;
  const double volume = enclosed_volume(surface);
  MassProperties mass =
      mass_of_surface(surface, given.density > 0.0 ? given.density : given.mass / std::abs(volume));
  if (given.center_given) mass.center = Vec3{given.center};
  if (given.inertia.size() == 6)
    std::copy(given.inertia.begin(), given.inertia.end(), mass.inertia.begin());
  return mass;
}

/// In an absent direction nothing moves; a rotation needs both directions across its axis.
FreeBodyOptions options_of(const FlowCase& flow_case, const BodyCase& spec) {
  FreeBodyOptions options{.gravity = Vec3{spec.free.gravity},
                          .velocity = Vec3{spec.free.velocity},
                          .angular_velocity = Vec3{spec.free.angular_velocity}};
  for (std::size_t a = 0; a < 3; ++a) {
    options.translates[a] = spec.free.translates[a] && flow_case.axes[a].present;
    options.rotates[a] = spec.free.rotates[a] && flow_case.axes[(a + 1) % 3].present &&
                         flow_case.axes[(a + 2) % 3].present;
  }
  return options;
}

}  // namespace

BodyMotions::BodyMotions(const FlowCase& flow_case, const ImmersedBoundary& bodies) {
  for (std::size_t b = 0; b < bodies.n_bodies(); ++b) {
    const BodyCase& spec = flow_case.bodies[b];
    Motion motion;
    if (spec.motion == BodyMotion::prescribed) motion.path = spec.path;
    if (spec.motion == BodyMotion::free) {
      const BodySurface& surface = bodies.body(b).surface;
      motion.free =
          std::make_unique<FreeBody>(surface, mass_of(spec, surface), options_of(flow_case, spec));
    }
    motions_.push_back(std::move(motion));
  }
}

void BodyMotions::start(std::span<const BodyLoad> loads) {
  for (std::size_t b = 0; b < motions_.size(); ++b)
    if (motions_[b].free) motions_[b].free->start(loads[b]);
}

void BodyMotions::set_paths(ImmersedBoundary& bodies, double t_begin, double t_end) {
  for (std::size_t b = 0; b < motions_.size(); ++b) {
    Motion& motion = motions_[b];
    if (motion.path) {
      place_vertices(bodies.body(b).surface.vertices, Vec3{motion.path->rotation_center},
                     motion.path->at(t_end), x_, v_);
    } else if (motion.free) {
      motion.free->predict(t_end - t_begin, x_, v_);
    } else {
      continue;
    }
    bodies.set_path(b, t_begin, t_end, x_, v_);
  }
}

void BodyMotions::correct(double dt, std::span<const BodyLoad> loads) {
  for (std::size_t b = 0; b < motions_.size(); ++b)
    if (motions_[b].free) motions_[b].free->correct(dt, loads[b]);
}

const FreeBody* BodyMotions::free_body(std::size_t b) const {
  return motions_[b].free.get();
}

std::vector<double> BodyMotions::save() const {
  std::vector<double> saved;
  for (const Motion& motion : motions_) {
    if (!motion.free) continue;
    const auto state = motion.free->save();
    saved.insert(saved.end(), state.begin(), state.end());
  }
  return saved;
}

void BodyMotions::restore(std::span<const double>& saved) {
  for (Motion& motion : motions_) {
    if (!motion.free) continue;
    if (saved.size() < FreeBody::n_saved)
      throw CaseError("checkpoint: the free bodies do not fit this case");
    motion.free->restore(saved.first(FreeBody::n_saved));
    saved = saved.subspan(FreeBody::n_saved);
  }
}

}  // namespace ocublast::flow
