// What a stencil reads of the fields, apart from its making: fields come in two precisions.

#include <algorithm>
#include <cmath>

#include "flow_solver/immersed/ghost_stencil.hpp"

namespace ocublast::flow {

Sample sample(const Stencil& stencil, const GasNodes& W, const Gas& gas) noexcept {
  Sample s;
  for (unsigned corner = 0; corner < 8; ++corner) {
    const double weight = stencil.weight[corner];
    if (weight == 0.0) continue;  // its node may hold nothing meaningful
    const auto [at, stride] = W(stencil.base[0] + static_cast<int>(corner & 1U),
                                stencil.base[1] + static_cast<int>(corner >> 1 & 1U),
                                stencil.base[2] + static_cast<int>(corner >> 2));
    const double T = at[prim_T * stride];
    s.T += weight * T;
    s.p += weight * pressure(gas, at[0], T);
    for (int a = 0; a < 3; ++a) s.u[a] += weight * at[(prim_u + a) * stride];
  }
  return s;
}

double momentum_transport(const Stencil& stencil, const GasNodes& W, const Vec3& velocity,
                          const Vec3& normal, const Gas& gas) noexcept {
  const double gamma = gas.heat_capacity_ratio;
  double sum = 0.0;
  for (unsigned corner = 0; corner < 8; ++corner) {
    const double weight = stencil.weight[corner];
    if (weight == 0.0) continue;  // its node may hold nothing meaningful
    const auto [at, stride] = W(stencil.base[0] + static_cast<int>(corner & 1U),
                                stencil.base[1] + static_cast<int>(corner >> 1 & 1U),
                                stencil.base[2] + static_cast<int>(corner >> 2));
    const Vec3 u{{at[prim_u * stride], at[prim_v * stride], at[prim_w * stride]}};
    const double rho = at[0], u_n = dot(u - velocity, normal);
    double transport = rho * u_n * u_n;
    if (W.W.artificial_pressure) transport += at[artificial_pressure_field * stride];
    // Pressure of the shock that stops gas of this speed at once, Toro (2009) eq. 4.5 solved for p.
    const double towards = std::max(-u_n, 0.0), slope = .25 * (gamma + 1.0) * towards;
    const double c2 = gamma * gas.gas_constant * at[prim_T * stride];
    const double stopped = rho * towards * (slope + std::sqrt(slope * slope + c2));
    sum += weight * std::min(transport, stopped);
  }
  return sum;
}

}  // namespace ocublast::flow
