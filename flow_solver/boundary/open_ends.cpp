#include "flow_solver/boundary/open_ends.hpp"

#include <algorithm>
#include <cmath>

namespace ocublast::flow::inline OCU_PRECISION {

NodeState node_state(const Gas& gas, const State& s) {
  return {.rho = s.rho, .u = {s.u, s.v, s.w}, .T = s.p / (s.rho * gas.gas_constant)};
}

NodeState characteristic_state(const Gas& gas, const NodeState& s, const NodeState& far, int axis,
                               double sign) {
  if (s.T == far.T && s.rho == far.rho && s.u[0] == far.u[0] && s.u[1] == far.u[1] &&
      s.u[2] == far.u[2])
    return far;  // undisturbed
  const double gamma = gas.heat_capacity_ratio;
  const double c = sound_speed(gas, s.T), c_far = sound_speed(gas, far.T);
  const double un = sign * s.u[axis], un_far = sign * far.u[axis];
  if (un >= c) return s;
  if (un <= -c) return far;
  const double outgoing = un + 2.0 * c / (gamma - 1.0);
  const double incoming = un_far - 2.0 * c_far / (gamma - 1.0);
  const double un_b = 0.5 * (outgoing + incoming);
  const double c_b = 0.25 * (gamma - 1.0) * (outgoing - incoming);
  if (!(c_b > 0.0)) return s;
  const NodeState& donor = un_b > 0.0 ? s : far;
  NodeState b = donor;
  b.u[axis] = sign * un_b;
  b.T = c_b * c_b / (gamma * gas.gas_constant);
  const double ratio = b.T / donor.T;
  // Isentropic: rho ~ T^(1/(gamma-1)); for gamma = 1.4 the power is 5/2, without a call to pow.
  const bool diatomic = std::abs(gamma - 1.4) < 1e-12;
  b.rho = donor.rho *
          (diatomic ? ratio * ratio * std::sqrt(ratio) : std::pow(ratio, 1.0 / (gamma - 1.0)));
  return b;
}

NodeState inflow_state(const Gas& gas, const NodeState& s, const NodeState& far, int axis,
                       double sign) {
  const double un_far = sign * far.u[axis];
  if (un_far <= -sound_speed(gas, far.T)) return far;
  const double c = sound_speed(gas, s.T);
  const double p = pressure(gas, s.rho, s.T) + s.rho * c * (sign * s.u[axis] - un_far);
  // A wave strong enough to ask for a negative pressure leaves no gas to come in: keep a trace.
  constexpr double least = 1e-3;
  NodeState b = far;
  b.rho = density(gas, std::max(p, least * pressure(gas, s.rho, s.T)), far.T);
  return b;
}

NodeState reservoir_state(const Gas& gas, const NodeState& s, const NodeState& total, int axis,
                          double sign) {
  const double gamma = gas.heat_capacity_ratio, gm1 = gamma - 1.0;
  const double c0 = sound_speed(gas, total.T);
  const double outgoing = sign * s.u[axis] + 2.0 * sound_speed(gas, s.T) / gm1;
  // c^2 + (gamma - 1)/2 un^2 = c0^2 with un = outgoing - 2 c/(gamma - 1): the root with c largest.
  const double a = (gamma + 1.0) / gm1;
  const double under_root = outgoing * outgoing - a * (0.5 * gm1 * outgoing * outgoing - c0 * c0);
  const double c_sonic = c0 * std::sqrt(2.0 / (gamma + 1.0));
  double c = under_root > 0.0 ? (outgoing + std::sqrt(under_root)) / a : c_sonic;
  if (outgoing - 2.0 * c / gm1 > 0.0) return characteristic_state(gas, s, total, axis, sign);
  c = std::max(c, c_sonic);
  const double T = c * c / (gamma * gas.gas_constant);
  const double speed = std::sqrt(std::max(0.0, 2.0 * (c0 * c0 - c * c) / gm1));
  NodeState b{.rho = total.rho * std::pow(T / total.T, 1.0 / gm1), .u = {}, .T = T};
  b.u[axis] = -sign * speed;
  return b;
}

}  // namespace ocublast::flow
