#include "flow_solver/io/make_bodies.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "coupler/base/errors.hpp"
#include "flow_solver/io/body_surface.hpp"
#include "flow_solver/io/piston_body.hpp"

namespace ocublast::flow::inline OCU_PRECISION {
namespace {

void require_inside_grid(const FlowCase& flow_case, const Body& body) {
  for (std::size_t a = 0; a < 3; ++a) {
    const auto& axis = flow_case.axes[a];
    if (!axis.present) continue;
    double low = body.surface.vertices.at(a);
    double high = low;
    for (std::size_t v = a; v < body.surface.vertices.size(); v += 3) {
      low = std::min(low, body.surface.vertices[v]);
      high = std::max(high, body.surface.vertices[v]);
    }
    // Cells of a layer grow, and a wall in them would be as coarse as they are.
    const bool in_layer =
        (axis.low.cells > 0 && low < axis.min) || (axis.high.cells > 0 && high > axis.max);
    if (in_layer)
      throw CaseError(
          fmt::format("flow.body '{}': spans {} = [{:.6g}, {:.6g}] m and touches the stretched "
                      "layer outside [{:.6g}, {:.6g}] m; "
                      "widen flow.grid.{} beyond the body, or leave the layer out on that side",
                      body.name, "xyz"[a], low, high, axis.min, axis.max, "xyz"[a]));
    const bool outside = high < axis.min || low > axis.max;
    const bool moving_across = body.moves && (low < axis.min || high > axis.max);
    if (outside || moving_across)
      throw CaseError(fmt::format(
          "flow.body '{}': spans {} = [{:.6g}, {:.6g}] m, the grid has [{:.6g}, {:.6g}] m; {}",
          body.name, "xyz"[a], low, high, axis.min, axis.max,
          outside ? "it lies outside: move the body or the grid"
                  : "a moving body must stay inside"));
  }
}

}  // namespace

void require_charges_in_gas(const FlowCase& flow_case, const Grid& grid,
                            std::span<const std::uint8_t> tags) {
  for (const BurstCase& burst : flow_case.bursts) {
    std::size_t node[3] = {0, 0, 0};
    for (std::size_t a = 0; a < 3; ++a) {
      const Axis& axis = grid.axis[a];
      if (!axis.present) continue;
      for (int i = 1; i < axis.n; ++i)
        if (std::abs(axis.x(i) - burst.center[a]) <
            std::abs(axis.x(static_cast<int>(node[a])) - burst.center[a]))
          node[a] = static_cast<std::size_t>(i);
    }
    const auto n0 = static_cast<std::size_t>(grid.axis[0].n),
               n1 = static_cast<std::size_t>(grid.axis[1].n);
    if (tags[(node[2] * n1 + node[1]) * n0 + node[0]] == tag_fluid) continue;
    throw CaseError(fmt::format(
        "flow.burst '{}': its centre ({:.6g}, {:.6g}, {:.6g}) m lies inside a body; move the "
        "charge into the gas",
        burst.name, burst.center[0], burst.center[1], burst.center[2]));
  }
}

std::size_t solid_number(const FlowCase& flow_case, const BodyCase& body) {
  const auto at = std::find(flow_case.solids.begin(), flow_case.solids.end(), body.solid);
  return static_cast<std::size_t>(at - flow_case.solids.begin());
}

std::vector<Body> make_bodies(const FlowCase& flow_case,
                              std::span<const link::InterfaceMesh> coupled) {
  std::vector<Body> bodies;
  for (const auto& spec : flow_case.bodies) {
    Body body{.name = spec.name,
              .surface = {},
              .slip = spec.slip,
              .wall_temperature = spec.wall_temperature,
              .moves = spec.motion != BodyMotion::fixed};
    if (spec.piston) {
      body.surface = make_piston_slab(*spec.piston, make_grid(flow_case.axes));
      bodies.push_back(std::move(body));
      continue;
    }
    if (spec.motion != BodyMotion::coupled)
      body.surface = read_body_surface(spec.surface);
    else if (!coupled.empty()) {
      const auto& mesh = coupled[solid_number(flow_case, spec)];
      body.surface = {
          .vertices = mesh.vertices, .triangles = mesh.triangles, .n_quads = mesh.n_quads};
    } else {
      continue;  // known when the solid has sent it
    }
    require_inside_grid(flow_case, body);
    bodies.push_back(std::move(body));
  }
  return bodies;
}

}  // namespace ocublast::flow
