#include "flow_solver/io/charge_start.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "coupler/base/errors.hpp"
#include "flow_solver/immersed/vec3.hpp"
#include "flow_solver/io/charge_case.hpp"

namespace ocublast::flow::inline OCU_PRECISION {
namespace {

using Point = std::array<double, 3>;

// The front stops this part of the way to a wall, or this number of cells before an open face: what
// runs ahead of a captured front must not be cut off.
constexpr double part_of_room = 0.95;
constexpr double cells_before_face = 3.0;

/// Square of the distance of x from a triangle (Ericson 2005, Real-Time Collision
/// Detection, 5.1.5).
double triangle_distance2(const Vec3& x, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 ab = b - a, ac = c - a, ax = x - a;
  const double d1 = dot(ab, ax), d2 = dot(ac, ax);
  if (d1 <= 0.0 && d2 <= 0.0) return norm2(ax);
  const Vec3 bx = x - b;
  const double d3 = dot(ab, bx), d4 = dot(ac, bx);
  if (d3 >= 0.0 && d4 <= d3) return norm2(bx);
  const Vec3 cx = x - c;
  const double d5 = dot(ab, cx), d6 = dot(ac, cx);
  if (d6 >= 0.0 && d5 <= d6) return norm2(cx);
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) return norm2(ax - (d1 / (d1 - d3)) * ab);
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) return norm2(ax - (d2 / (d2 - d6)) * ac);
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0)
    return norm2(bx - ((d4 - d3) / ((d4 - d3) + (d5 - d6))) * (c - b));
  const double scale = 1.0 / (va + vb + vc);
  return norm2(ax - (vb * scale) * ab - (vc * scale) * ac);
}

/// Solid angle of a triangle seen from the origin (van Oosterom and Strackee 1983).
double solid_angle(const Vec3& a, const Vec3& b, const Vec3& c) {
  const double la = norm(a), lb = norm(b), lc = norm(c);
  return 2.0 * std::atan2(dot(a, cross(b, c)),
                          la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
}

struct Run {
  const ChargeCase* charge;
  bool outside = false;
  double delay = 0.0;   ///< s
  double radius = 0.0;  ///< m, of the front at the start
  std::shared_ptr<SteppedWave> stepped;
  std::shared_ptr<RadialWave> prescribed;
  double prescribed_time = 0.0;  ///< s, of its front at `radius`
};

double distance_to_box(const Grid& grid, const Point& x) {
  double sum = 0.0;
  for (std::size_t a = 0; a < 3; ++a) {
    if (!grid.axis[a].present) continue;
    const double d = std::max({grid.axis[a].min - x[a], x[a] - grid.axis[a].max, 0.0});
    sum += d * d;
  }
  return std::sqrt(sum);
}

double farthest_corner(const Grid& grid, const Point& x) {
  double sum = 0.0;
  for (std::size_t a = 0; a < 3; ++a) {
    if (!grid.axis[a].present) continue;
    const double d = std::max(std::abs(grid.axis[a].min - x[a]), std::abs(grid.axis[a].max - x[a]));
    sum += d * d;
  }
  return std::sqrt(sum);
}

double largest_cell(const Grid& grid) {
  double h = 0.0;
  for (const Axis& axis : grid.axis)
    if (axis.present)
      h = std::max(h, *std::max_element(axis.jacobian.begin(), axis.jacobian.end()));
  return h;
}

/// Distance that the front of a charge inside the grid may run before it must be on the grid.
double room_inside(const FlowCase& flow_case, const Grid& grid, std::span<const Body> bodies,
                   const ChargeCase& charge) {
  double room = 1e300;
  for (std::size_t face = 0; face < 6; ++face) {
    const std::size_t a = face / 2;
    const Axis& axis = grid.axis[a];
    if (!axis.present || through_charge(flow_case, face, charge)) continue;
    const bool low = face % 2 == 0;
    const double distance = low ? charge.center[a] - axis.min : axis.max - charge.center[a];
    room = std::min(room, distance - cells_before_face * axis.h(low ? 0 : axis.n - 1));
  }
  for (const Body& body : bodies) {
    const double distance = signed_distance(body.surface, charge.center);
    if (distance <= 0.0)
      throw CaseError(
          fmt::format("flow.charge '{}': center_m lies in flow.body '{}'; move one of them",
                      charge.name, body.name));
    room = std::min(room, part_of_room * distance);
  }
  return room;
}

/// Radius [m] that the source itself has.
double source_radius(const ChargeCase& charge) {
  if (charge.source == ChargeSource::ball) return charge.radius;
  if (charge.source == ChargeSource::calibrated) return tnt_ball(charge.mass, charge.burst).radius;
  const double mass = mirrored_tnt_mass(charge.mass, charge.burst);
  return std::cbrt(3.0 * mass / (4.0 * std::numbers::pi * Jwl{}.density));
}

Run make_run(const FlowCase& flow_case, const Grid& grid, std::span<const Body> bodies,
             const ChargeCase& charge) {
  Run run{.charge = &charge, .outside = is_outside(flow_case, charge)};
  const double room = run.outside ? distance_to_box(grid, charge.center) - 0.5 * largest_cell(grid)
                                  : room_inside(flow_case, grid, bodies, charge);
  run.radius = charge.start_radius > 0.0 ? charge.start_radius : room;
  const double source = source_radius(charge);
  if (run.radius > room + 1e-9)
    throw CaseError(fmt::format(
        "flow.charge '{}': start_radius_m is {} m, the front meets a wall or the grid's end "
        "at {:.6g} m; accepted up to there",
        charge.name, run.radius, room));
  if (charge.source != ChargeSource::kingery_bulmash && source > 0.9 * run.radius)
    throw CaseError(
        fmt::format("flow.charge '{}': its source has a radius of {:.4g} m and needs room for its "
                    "front beyond, free are {:.4g} "
                    "m to the next wall or face{}",
                    charge.name, source, run.radius,
                    charge.source == ChargeSource::calibrated
                        ? "; nearer than Z = 0.4 m/kg^(1/3) take source = \"jwl\""
                        : "; move the charge or enlarge the grid"));
  const Gas& gas = flow_case.options.gas;
  const double p0 = flow_case.common.ambient_pressure;
  const State ambient{.rho = density(gas, p0, flow_case.common.ambient_temperature), .p = p0};
  // What is inside the front at the start, or all that the grid will ever see of it.
  const double r_max = run.outside ? 1.02 * farthest_corner(grid, charge.center) : 1.1 * run.radius;
  switch (charge.source) {
    case ChargeSource::calibrated:
      run.delay = tnt_delay(charge.mass, charge.burst);
      run.stepped =
          std::make_shared<BallWave>(gas, ambient, tnt_ball(charge.mass, charge.burst), r_max);
      break;
    case ChargeSource::ball:
      run.stepped = std::make_shared<BallWave>(
          gas, ambient,
          BallStart{.energy = charge.energy, .radius = charge.radius, .mass = charge.mass}, r_max);
      break;
    case ChargeSource::jwl:
      run.stepped = std::make_shared<JwlWave>(gas, ambient, Jwl{},
                                              mirrored_tnt_mass(charge.mass, charge.burst), r_max);
      break;
    case ChargeSource::kingery_bulmash:
      run.prescribed = std::make_shared<PrescribedWave>(gas, ambient, charge.burst, charge.mass,
                                                        run.radius, r_max);
      run.prescribed_time = blast_wave_form(charge.burst, charge.mass, run.radius, false).arrival;
      break;
  }
  return run;
}

/// Steps all waves side by side until one front is where it must come to the grid; that time.
double run_to_start(std::vector<Run>& runs) {
  double limit = 1e300;
  for (const Run& run : runs)
    if (run.prescribed) limit = std::min(limit, run.prescribed_time);
  for (;;) {
    Run* earliest = nullptr;
    for (Run& run : runs) {
      if (!run.stepped) continue;
      if (earliest == nullptr ||
          run.stepped->time() + run.delay < earliest->stepped->time() + earliest->delay)
        earliest = &run;
    }
    if (earliest == nullptr) return limit;
    const double now = earliest->stepped->time();
    if (now + earliest->delay >= limit) return limit;
    if (earliest->stepped->front_radius(now) >= earliest->radius) return now + earliest->delay;
    earliest->stepped->cover(now, std::nextafter(now, 1e300));
  }
}

}  // namespace

double signed_distance(const BodySurface& surface, const Point& x) {
  const Vec3 at{{x[0], x[1], x[2]}};
  double nearest = 1e300, angle = 0.0;
  for (std::size_t t = 0; t + 2 < surface.triangles.size(); t += 3) {
    Vec3 corner[3];
    for (std::size_t c = 0; c < 3; ++c)
      corner[c] = row(surface.vertices, static_cast<std::int32_t>(surface.triangles[t + c]));
    nearest = std::min(nearest, triangle_distance2(at, corner[0], corner[1], corner[2]));
    angle += solid_angle(corner[0] - at, corner[1] - at, corner[2] - at);
  }
  const bool inside = std::abs(angle) > 2.0 * std::numbers::pi;
  return (inside ? -1.0 : 1.0) * std::sqrt(nearest);
}

ChargeStart start_charges(const FlowCase& flow_case, const Grid& grid,
                          std::span<const Body> bodies) {
  ChargeStart start;
  if (flow_case.charges.empty()) return start;
  std::vector<Run> runs;
  for (const ChargeCase& charge : flow_case.charges)
    runs.push_back(make_run(flow_case, grid, bodies, charge));
  start.after_detonation = run_to_start(runs);
  std::vector<PlacedWave> outside;
  for (Run& run : runs) {
    if (run.outside) {
      std::shared_ptr<RadialWave> wave = run.prescribed;
      if (run.stepped) wave = run.stepped;
      outside.push_back({run.charge->center, wave, run.delay});
      continue;
    }
    start.names.push_back(run.charge->name);
    start.mapped.push_back(make_wave_on_grid(grid, *run.stepped, run.charge->center));
    start.mapped.back().report.time += run.delay;
  }
  if (!outside.empty()) {
    const double p0 = flow_case.common.ambient_pressure;
    const State ambient{
        .rho = density(flow_case.options.gas, p0, flow_case.common.ambient_temperature), .p = p0};
    start.incident =
        std::make_shared<IncidentWaves>(ambient, std::move(outside), start.after_detonation);
  }
  return start;
}

}  // namespace ocublast::flow
