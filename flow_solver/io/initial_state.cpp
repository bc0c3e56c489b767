#include "flow_solver/io/run.hpp"
#include "flow_solver/sources/burst.hpp"
#include "flow_solver/sources/interface.hpp"

namespace ocublast::flow {
namespace {

State to_state(const GasState& gas, const Gas& law) {
  return {.rho = density(law, gas.pressure, gas.temperature), .u = gas.velocity[0],
          .v = gas.velocity[1], .w = gas.velocity[2], .p = gas.pressure};
}

}  // namespace

std::vector<double> apply_initial_state(const FlowCase& flow_case, Flow& flow) {
  const Grid& grid = flow.grid();
  const Gas& gas = flow_case.options.gas;
  const State left = to_state(flow_case.initial.left, gas);
  const State right = to_state(flow_case.initial.right, gas);
  const auto a = static_cast<std::size_t>(flow_case.initial.axis);
  const double p0 = flow_case.common.ambient_pressure;
  const double rho0 = density(gas, p0, flow_case.common.ambient_temperature);

  std::vector<BurstOnGrid> bursts;
  std::vector<double> energies;
  for (const auto& b : flow_case.bursts) {
    bursts.push_back(make_burst(grid, gas, {.center = b.center, .radius = b.radius, .energy = b.energy,
                                            .pressure = b.pressure, .temperature = b.temperature},
                                p0, rho0));
    energies.push_back(bursts.back().energy);
  }
  flow.set_state_by_index([&](int i, int j, int k) {
    State state = left;
    if (flow_case.initial.kind == InitialKind::riemann) {
      const int node = a == 0 ? i : (a == 1 ? j : k);
      state = interface_state(left, right, grid.axis[a].x(node) - flow_case.initial.position,
                              grid.axis[a].h(node));
    }
    const std::size_t cell =
        static_cast<std::size_t>(i) +
        static_cast<std::size_t>(grid.axis[0].n) *
            (static_cast<std::size_t>(j) + static_cast<std::size_t>(grid.axis[1].n) * static_cast<std::size_t>(k));
    for (const auto& burst : bursts)
      if (burst.fraction[cell] > 0.0) state = mix_burst(state, burst, burst.fraction[cell]);
    return state;
  });
  return energies;
}

}  // namespace ocublast::flow
