#include "coupler/balance.hpp"

#include <algorithm>
#include <cmath>

namespace ocublast::coupler {

void Balance::add(double flow, double solid, const std::array<double, 3>& by_flow,
                  const std::array<double, 3>& by_solid) {
  work_flow += flow;
  work_solid += solid;
  work_exchanged += std::max(std::abs(flow), std::abs(solid));
  for (std::size_t k = 0; k < 3; ++k) {
    impulse_flow[k] += by_flow[k];
    impulse_solid[k] += by_solid[k];
  }
}

}  // namespace ocublast::coupler
