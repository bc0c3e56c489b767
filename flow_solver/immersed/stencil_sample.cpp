// What a stencil reads of the fields, apart from its making: fields come in two precisions.

#include <algorithm>
#include <cmath>

#include "flow_solver/immersed/wall_fit.hpp"

namespace ocublast::flow {

namespace {

/// A node's part in a sample.
void add(Sample& s, double weight, const GasNodes::Place& node, const Gas& gas) {
  const auto [at, stride] = node;
  const double T = at[prim_T * stride];
  s.T += weight * T;
  s.p += weight * pressure(gas, at[0], T);
  for (int a = 0; a < 3; ++a) s.u[a] += weight * at[(prim_u + a) * stride];
}

double transport_at(const GasNodes::Place& node, bool artificial, const Vec3& velocity,
                    const Vec3& normal, const Gas& gas) {
  const auto [at, stride] = node;
  const double gamma = gas.heat_capacity_ratio;
  const Vec3 u{{at[prim_u * stride], at[prim_v * stride], at[prim_w * stride]}};
  const double rho = at[0], u_n = dot(u - velocity, normal);
  double transport = rho * u_n * u_n;
  if (artificial) transport += at[artificial_pressure_field * stride];
  // Pressure of the shock that stops gas of this speed at once, Toro (2009) eq. 4.5 solved for p.
  const double towards = std::max(-u_n, 0.0), slope = .25 * (gamma + 1.0) * towards;
  const double c2 = gamma * gas.gas_constant * at[prim_T * stride];
  const double stopped = rho * towards * (slope + std::sqrt(slope * slope + c2));
  return std::min(transport, stopped);
}

/// Calls use(weight, node) for the nodes of a stencil; the others may hold nothing meaningful.
template <class Use>
void for_corners(const Stencil& stencil, const GasNodes& W, const Use& use) {
  for (unsigned corner = 0; corner < 8; ++corner) {
    if (stencil.weight[corner] == 0.0) continue;
    use(stencil.weight[corner], W(stencil.base[0] + static_cast<int>(corner & 1U),
                                  stencil.base[1] + static_cast<int>(corner >> 1 & 1U),
                                  stencil.base[2] + static_cast<int>(corner >> 2)));
  }
}

/// Share of the momentum transport in the pressure at which half of a fit's curvature is left. A
/// shock of Mach 1.2 has 0.12 behind it, gas beside a body that moves at 0.3 of the speed of sound
/// below 1e-3. At 0.1 walls hit at Mach 10 overshoot by 5.3 %, here by 6.4 %, but the impulse of a
/// shock of Mach 3 on a wall misses a quarter more.
constexpr double shock_share = 0.3;
/// Largest parts of the mean pressure that slopes along the wall and the curvature may make: in a
/// wedge the nodes may lie all to one side of the point.
constexpr double largest_slope = 0.5;
constexpr double largest_curvature = 0.25;

}  // namespace

Sample sample(const Stencil& stencil, const GasNodes& W, const Gas& gas) noexcept {
  Sample s;
  if (W.far == nullptr) {
    // Without branches: a corner that has no weight is read at one that has.
    const FieldsView<const Real>& v = W.W;
    const Real* base = &v(0, stencil.base[0], stencil.base[1], stencil.base[2]);
    std::ptrdiff_t safe = 0;
    const auto offset = [&](unsigned c) {
      return static_cast<std::ptrdiff_t>(c & 1U) + (c >> 1 & 1U ? v.stride_j : 0) +
             (c >> 2 ? v.stride_k : 0);
    };
    for (unsigned c = 8; c-- > 0;) safe = stencil.weight[c] != 0.0 ? offset(c) : safe;
    for (unsigned c = 0; c < 8; ++c) {
      const double weight = stencil.weight[c];
      add(s, weight, {base + (weight != 0.0 ? offset(c) : safe), v.stride_f}, gas);
    }
    return s;
  }
  for_corners(stencil, W, [&](double weight, const auto& node) { add(s, weight, node, gas); });
  return s;
}

FitSample sample(const WallFit& fit, const GasNodes& W, const Vec3& velocity, const Vec3& normal,
                 const Gas& gas) noexcept {
  FitSample s;
  double linear = 0.0, curved = 0.0, linear_distance = 0.0, curved_distance = 0.0;
  for (std::size_t i = 0; i < fit.n; ++i) {
    const WallFit::Node& node = fit.node[i];
    const GasNodes::Place place = W(node.at[0], node.at[1], node.at[2]);
    const double transport = transport_at(place, W.W.artificial_pressure, velocity, normal, gas);
    const double p = pressure(gas, place.at[0], place.at[prim_T * place.stride]);
    add(s.gas, node.mean, place, gas);
    s.beside += node.mean * transport;
    s.distance += node.mean * node.distance;
    linear += (node.linear - node.mean) * (p + transport);
    curved += (node.curved - node.linear) * (p + transport);
    linear_distance += (node.linear - node.mean) * node.distance;
    curved_distance += (node.curved - node.linear) * node.distance;
  }
  const double shock = s.beside / (shock_share * s.gas.p);
  const double smooth = 1.0 / (1.0 + shock * shock);
  const double most_linear = largest_slope * s.gas.p, most_curved = largest_curvature * s.gas.p;
  s.beside += std::clamp(linear, -most_linear, most_linear) +
              smooth * std::clamp(curved, -most_curved, most_curved);
  s.distance += linear_distance + smooth * curved_distance;
  return s;
}

double momentum_transport(const Stencil& stencil, const GasNodes& W, const Vec3& velocity,
                          const Vec3& normal, const Gas& gas) noexcept {
  double sum = 0.0;
  for_corners(stencil, W, [&](double weight, const auto& node) {
    sum += weight * transport_at(node, W.W.artificial_pressure, velocity, normal, gas);
  });
  return sum;
}

}  // namespace ocublast::flow
