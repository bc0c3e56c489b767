#include "flow_solver/ranks/halo.hpp"

#include <algorithm>
#include <utility>

namespace ocublast::flow::inline OCU_PRECISION {

Halo::Halo(const RankPart& part, HaloSpec spec) : part_(&part), spec_(std::move(spec)) {
  std::vector<RankExchange::Message> sends, receives;
  for (int axis = 0; axis < 3; ++axis) {
    if (((spec_.axes >> axis) & 1u) == 0) continue;
    Face* pair[2] = {nullptr, nullptr};
    for (const bool low : {true, false}) {
      const int peer = part.neighbour(axis, low);
      if (peer < 0) continue;
      auto face = std::make_unique<Face>(Face{axis, low, peer, {}, {}});
      std::size_t size = 0;
      for_rows(*face, {}, 0,
               [&](std::ptrdiff_t, int count) { size += static_cast<std::size_t>(count); });
      face->out.resize(size);
      face->in.resize(size);
      sends.push_back({peer, face->out});
      pair[low ? 0 : 1] = face.get();
      faces_.push_back(std::move(face));
    }
    // With two parts of a periodic axis both neighbours are one: what it sends from its low end
    // first belongs to the high end here.
    for (const int side : {1, 0}) {
      if (pair[side] != nullptr) receives.push_back({pair[side]->peer, pair[side]->in});
    }
  }
  if (!faces_.empty())
    exchange_ = std::make_unique<RankExchange>(*part.ranks, spec_.channel, sends, receives);
}

/// Calls copy(offset of the first value, values in a row along x) for the layers from layer0 on,
/// along the face's axis.
template <class Copy>
void Halo::for_rows(const Face& face, const Block& block, int layer0, const Copy& copy) const {
  int from[3], to[3];
  for (int a = 0; a < 3; ++a) {
    const Axis& axis = part_->grid.axis[static_cast<std::size_t>(a)];
    const int ghosts = spec_.corners && a < face.axis ? axis.ghosts() : 0;
    from[a] = -ghosts;
    to[a] = axis.n + ghosts;
  }
  from[face.axis] = layer0;
  to[face.axis] = layer0 + spec_.depth;
  for (int k = from[2]; k < to[2]; ++k) {
    for (int j = from[1]; j < to[1]; ++j) {
      for (const int f : spec_.fields)
        copy(from[0] + j * block.sj + k * block.sk + f * block.sf, to[0] - from[0]);
    }
  }
}

void Halo::start(const Block& block) {
  if (!exchange_) return;
  for (const auto& face : faces_) {
    const int n = part_->grid.axis[static_cast<std::size_t>(face->axis)].n;
    Real* to = face->out.data();
    for_rows(*face, block, face->low ? 0 : n - spec_.depth,
             [&](std::ptrdiff_t at, int count) { to = std::copy_n(block.data + at, count, to); });
  }
  exchange_->start();
}

Traffic Halo::traffic() const {
  Traffic t;
  for (const auto& face : faces_) t += {1.0, static_cast<double>(face->out.size() * sizeof(Real))};
  return t;
}

void Halo::wait() {
  if (exchange_) exchange_->finish();
}

void Halo::finish(const Block& block) {
  if (!exchange_) return;
  exchange_->finish();
  for (const auto& face : faces_) {
    const int n = part_->grid.axis[static_cast<std::size_t>(face->axis)].n;
    const Real* from = face->in.data();
    for_rows(*face, block, face->low ? -spec_.depth : n, [&](std::ptrdiff_t at, int count) {
      std::copy_n(from, count, block.data + at);
      from += count;
    });
  }
}

}  // namespace ocublast::flow
