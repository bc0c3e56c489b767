#include <fmt/format.h>

#include <cmath>

#include "coupler/base/errors.hpp"
#include "flow_solver/io/run.hpp"
#include "flow_solver/sources/burst.hpp"
#include "flow_solver/sources/interface.hpp"

namespace ocublast::flow::inline OCU_PRECISION {
namespace {

State to_state(const GasState& gas, const Gas& law) {
  return {.rho = density(law, gas.pressure, gas.temperature),
          .u = gas.velocity[0],
          .v = gas.velocity[1],
          .w = gas.velocity[2],
          .p = gas.pressure};
}

/// A ball thinner than a cell is no ball on that grid.
void require_resolved(const Grid& grid, const BurstCase& burst) {
  for (std::size_t a = 0; a < 3; ++a) {
    const Axis& axis = grid.axis[a];
    if (!axis.present) continue;
    int nearest = 0;
    for (int i = 1; i < axis.n; ++i)
      if (std::abs(axis.x(i) - burst.center[a]) < std::abs(axis.x(nearest) - burst.center[a]))
        nearest = i;
    if (burst.radius < axis.h(nearest))
      throw CaseError(fmt::format(
          "flow.burst '{}': radius_m is {} m, a cell there is {:.4g} m in {}; refine the grid, "
          "or let a flow.charge with source = \"ball\" start it in one dimension",
          burst.name, burst.radius, axis.h(nearest), "xyz"[a]));
  }
}

/// State with the changes that waves bring to its cell.
State add_changes(const State& state, const ChargeStart& charges, std::size_t cell,
                  const Gas& gas) {
  const double g1 = gas.heat_capacity_ratio - 1.0;
  double q[5] = {
      state.rho, state.rho * state.u, state.rho * state.v, state.rho * state.w,
      state.p / g1 + 0.5 * state.rho * (state.u * state.u + state.v * state.v + state.w * state.w)};
  for (const WaveOnGrid& wave : charges.mapped)
    for (std::size_t f = 0; f < 5; ++f) q[f] += wave.change[cell][f];
  const double kinetic = 0.5 * (q[1] * q[1] + q[2] * q[2] + q[3] * q[3]) / q[0];
  return {.rho = q[0],
          .u = q[1] / q[0],
          .v = q[2] / q[0],
          .w = q[3] / q[0],
          .p = g1 * (q[4] - kinetic)};
}

std::vector<StartQuantity> quantities_of(const ChargeStart& charges) {
  std::vector<StartQuantity> out;
  for (std::size_t c = 0; c < charges.mapped.size(); ++c) {
    const MappedCharge& m = charges.mapped[c].report;
    const std::string& name = charges.names[c];
    out.push_back({name + "_energy", m.energy, "J"});
    out.push_back({name + "_energy_asked", m.energy_asked, "J"});
    out.push_back({name + "_mass", m.mass, "kg"});
    out.push_back({name + "_mass_asked", m.mass_asked, "kg"});
    out.push_back({name + "_front_radius", m.front, "m"});
  }
  if (!charges.mapped.empty() || charges.incident)
    out.push_back({"start_after_detonation", charges.after_detonation, "s"});
  return out;
}

}  // namespace

std::vector<StartQuantity> apply_initial_state(const FlowCase& flow_case,
                                               const ChargeStart& charges, Flow& flow) {
  const Grid& grid = flow.grid();
  const Gas& gas = flow_case.options.gas;
  const State left = to_state(flow_case.initial.left, gas);
  const State right = to_state(flow_case.initial.right, gas);
  const auto a = static_cast<std::size_t>(flow_case.initial.axis);
  const double p0 = flow_case.common.ambient_pressure;
  const double rho0 = density(gas, p0, flow_case.common.ambient_temperature);

  std::vector<BurstOnGrid> bursts;
  std::vector<StartQuantity> quantities;
  for (const auto& b : flow_case.bursts) {
    require_resolved(grid, b);
    bursts.push_back(make_burst(grid, gas,
                                {.center = b.center,
                                 .radius = b.radius,
                                 .energy = b.energy,
                                 .pressure = b.pressure,
                                 .temperature = b.temperature},
                                p0, rho0));
    quantities.push_back({b.name + "_energy", bursts.back().energy, "J"});
    quantities.push_back({b.name + "_mass", bursts.back().mass, "kg"});
  }
  flow.set_state_by_index([&](int i, int j, int k) {
    State state = left;
    if (flow_case.initial.kind == InitialKind::riemann) {
      const int node = a == 0 ? i : (a == 1 ? j : k);
      state = interface_state(left, right, grid.axis[a].x(node) - flow_case.initial.position,
                              grid.axis[a].h(node), flow_case.initial.interface_width);
    }
    const std::size_t cell =
        static_cast<std::size_t>(i) +
        static_cast<std::size_t>(grid.axis[0].n) *
            (static_cast<std::size_t>(j) +
             static_cast<std::size_t>(grid.axis[1].n) * static_cast<std::size_t>(k));
    for (const auto& burst : bursts)
      if (burst.fraction[cell] > 0.0) state = mix_burst(state, burst, burst.fraction[cell]);
    return charges.mapped.empty() ? state : add_changes(state, charges, cell, gas);
  });
  const auto more = quantities_of(charges);
  quantities.insert(quantities.end(), more.begin(), more.end());
  return quantities;
}

}  // namespace ocublast::flow
