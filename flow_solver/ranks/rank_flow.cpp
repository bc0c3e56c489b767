#include "flow_solver/ranks/rank_flow.hpp"

#include <algorithm>
#include <utility>

#include "flow_solver/flow_core.hpp"

namespace ocublast::flow::inline OCU_PRECISION {
namespace {

// Channels of RankExchange; three of a kind for the axes.
enum Channel : int {
  channel_state = 0,
  channel_conserved = 1,
  channel_bits = 2,
  channel_state_by_axis = 4,
  channel_theta = 10,
  channel_sensors = 13,
  channel_kappa = 16,
  channel_flux = 20,
  channel_filter = 23
};

std::vector<Halo> halo_by_axis(const RankPart& part, int channel, const std::vector<int>& fields,
                               int depth) {
  std::vector<Halo> out;
  for (int a = 0; a < 3; ++a) {
    out.emplace_back(part, HaloSpec{.channel = channel + a,
                                    .axes = 1u << a,
                                    .fields = fields,
                                    .depth = depth,
                                    .corners = true});
  }
  return out;
}

std::vector<int> first_fields(int n) {
  std::vector<int> fields;
  for (int f = 0; f < n; ++f) fields.push_back(f);
  return fields;
}

}  // namespace

RankFlow::RankFlow(RankPart part_in, const LineScheme& scheme, int state_depth, bool strain,
                   bool with_filter)
    : part(std::move(part_in)),
      state(part,
            {.channel = channel_state, .fields = first_fields(n_primitive), .depth = state_depth}),
      state_by_axis(
          halo_by_axis(part, channel_state_by_axis, first_fields(n_primitive), state_depth)),
      conserved(part,
                {.channel = channel_conserved, .fields = first_fields(n_primitive), .depth = 1}),
      theta(halo_by_axis(part, channel_theta, strain ? std::vector{0, 3} : std::vector{0}, 2)),
      sensors(halo_by_axis(part, channel_sensors, strain ? std::vector{1, 2, 4} : std::vector{1, 2},
                           n_ghost)),
      kappa(halo_by_axis(part, channel_kappa, {field_kappa}, 1)) {
  const auto& axis = part.grid.axis;
  const auto groups = [&](std::size_t a) { return (axis[a].n + tile_width - 1) / tile_width; };
  n_groups_ = {axis[2].n * groups(1), axis[2].n * groups(0), axis[1].n * groups(0)};
  std::vector<RankExchange::Message> sends, receives;
  for (int a = 0; a < 3; ++a) {
    const auto at = static_cast<std::size_t>(a);
    if (!part.split(a)) continue;
    const WholeLine line{.n = part.whole.axis[at].n,
                         .low = line_end(part.whole_boundaries[2 * at].kind),
                         .high = line_end(part.whole_boundaries[2 * at + 1].kind),
                         .scheme = scheme};
    flux[at] = std::make_unique<BorderSums>(part, a, LineSolve::flux, line, n_groups_[at],
                                            channel_flux + a);
    cut_flux[at] = std::make_unique<CutBorders>(part, a, LineSolve::flux, line);
    if (with_filter) {
      cut_filter[at] = std::make_unique<CutBorders>(part, a, LineSolve::filter, line);
      filter[at] = std::make_unique<BorderSums>(part, a, LineSolve::filter, line, n_groups_[at],
                                                channel_filter + a);
    }
    BitFace* pair[2] = {nullptr, nullptr};
    for (const bool low : {true, false}) {
      const int peer = part.neighbour(a, low);
      if (peer < 0) continue;
      const auto size = static_cast<std::size_t>(n_groups_[at]);
      auto face = std::make_unique<BitFace>(
          BitFace{a, low, std::vector<LaneBits>(size), std::vector<LaneBits>(size)});
      sends.push_back({peer, face->out});
      received_[at][low ? 0 : 1].resize(size);
      pair[low ? 0 : 1] = face.get();
      bit_faces_.push_back(std::move(face));
    }
    for (const int side : {1, 0}) {
      if (pair[side] != nullptr) receives.push_back({part.neighbour(a, side == 0), pair[side]->in});
    }
  }
  bit_exchange_ = std::make_unique<RankExchange>(*part.ranks, channel_bits, sends, receives);
}

Traffic RankFlow::step_traffic(bool nodal, bool sensors_on) const {
  Traffic all;
  const auto add = [&](const std::vector<Halo>& halos) {
    for (const Halo& h : halos) all += h.traffic();
  };
  for (int time = 0; time < 5; ++time) {  // before the sensors, and in each of the four stages
    if (nodal)
      add(state_by_axis);
    else
      all += state.traffic();
  }
  if (sensors_on) {
    for (const auto* halos : {&theta, &sensors, &kappa}) add(*halos);
  }
  for (std::size_t a = 0; a < 3; ++a) {
    for (int stage = 0; stage < 4 && flux[a]; ++stage) all += flux[a]->traffic();
    if (filter[a]) all += filter[a]->traffic();
  }
  return all;
}

const RankFlow::EndBits& RankFlow::exchange_bits(
    const std::function<bool(int i, int j, int k)>& bit) {
  for (const auto& face : bit_faces_) {
    // Lines of the axis as (b, c): groups of tile_width run along b.
    const int b_axis = face->axis == 0 ? 1 : 0, c_axis = face->axis == 2 ? 1 : 2;
    const int n_b = part.grid.axis[static_cast<std::size_t>(b_axis)].n;
    const int n_c = part.grid.axis[static_cast<std::size_t>(c_axis)].n;
    const int groups = (n_b + tile_width - 1) / tile_width;
    int at[3] = {};
    at[face->axis] = face->low ? 0 : part.grid.axis[static_cast<std::size_t>(face->axis)].n - 1;
    for (int c = 0; c < n_c; ++c) {
      for (int g = 0; g < groups; ++g) {
        unsigned bits = 0;
        for (int l = 0; l < tile_width && g * tile_width + l < n_b; ++l) {
          at[b_axis] = g * tile_width + l;
          at[c_axis] = c;
          if (bit(at[0], at[1], at[2])) bits |= 1u << l;
        }
        face->out[static_cast<std::size_t>(c * groups + g)] = static_cast<LaneBits>(bits);
      }
    }
  }
  bit_exchange_->start();
  bit_exchange_->finish();
  for (const auto& face : bit_faces_) {
    auto& to = received_[static_cast<std::size_t>(face->axis)][face->low ? 0 : 1];
    std::copy(face->in.begin(), face->in.end(), to.begin());
  }
  return received_;
}

}  // namespace ocublast::flow
