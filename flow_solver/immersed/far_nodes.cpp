#include "flow_solver/immersed/far_nodes.hpp"

#include <algorithm>

namespace ocublast::flow::inline OCU_PRECISION {
namespace {

constexpr int channel_far = 30;  ///< of RankExchange, apart from the flow's own (rank_flow.cpp)

NodeBox both(const NodeBox& a, const NodeBox& b) {
  NodeBox box{};
  for (int d = 0; d < 3; ++d) {
    box.lo[d] = std::max(a.lo[d], b.lo[d]);
    box.hi[d] = std::max(box.lo[d], std::min(a.hi[d], b.hi[d]));
  }
  return box;
}

NodeBox wider(NodeBox box, int by) {
  for (int d = 0; d < 3; ++d) {
    box.lo[d] -= by;
    box.hi[d] += by;
  }
  return box;
}

bool is_empty(const NodeBox& box) {
  return box.lo[0] >= box.hi[0] || box.lo[1] >= box.hi[1] || box.lo[2] >= box.hi[2];
}

bool same(const NodeBox& a, const NodeBox& b) {
  return std::equal(a.lo, a.lo + 3, b.lo) && std::equal(a.hi, a.hi + 3, b.hi);
}

}  // namespace

FarNodes::FarNodes(const Grid& grid, const Ranks& ranks, std::span<const NodeBox> blocks)
    : ranks_(&ranks), blocks_(blocks.begin(), blocks.end()) {
  for (std::size_t a = 0; a < 3; ++a) {
    n_[a] = grid.axis[a].n;
    ghosts_[a] = grid.axis[a].ghosts();
  }
  own_ = blocks_[static_cast<std::size_t>(ranks.rank())];
  own_with_ghosts_ = with_ghosts(own_);
}

NodeBox FarNodes::with_ghosts(const NodeBox& block) const {
  NodeBox box = block;
  for (std::size_t a = 0; a < 3; ++a) {
    if (box.lo[a] == 0) box.lo[a] -= ghosts_[a];
    if (box.hi[a] == n_[a]) box.hi[a] += ghosts_[a];
  }
  return box;
}

int FarNodes::owner(const std::array<std::int32_t, 3>& node) const {
  const auto at = std::find_if(blocks_.begin(), blocks_.end(), [&](const NodeBox& b) {
    return holds(b, node[0], node[1], node[2]);
  });
  return static_cast<int>(at - blocks_.begin());
}

/// What a rank needs beside its own nodes: one box around what it needs for each body.
NodeBox FarNodes::wanted(int rank, std::span<const NodeBox> bodies) const {
  const NodeBox reach = wider(blocks_[static_cast<std::size_t>(rank)], far_reach);
  NodeBox all{};
  for (const NodeBox& body : bodies) {
    const NodeBox part = both(reach, wider(body, far_reach));
    if (is_empty(part)) continue;
    if (is_empty(all)) all = part;
    for (int d = 0; d < 3; ++d) {
      all.lo[d] = std::min(all.lo[d], part.lo[d]);
      all.hi[d] = std::max(all.hi[d], part.hi[d]);
    }
  }
  return all;
}

void FarNodes::plan(std::span<const NodeBox> bodies) {
  const bool as_before =
      exchange_ && std::equal(bodies.begin(), bodies.end(), planned_.begin(), planned_.end(), same);
  if (as_before) return;
  planned_.assign(bodies.begin(), bodies.end());
  pieces_.clear();
  outgoing_.clear();
  const int own = ranks_->rank();
  const auto make = [&](int to, int from, int peer, std::vector<Piece>& list) {
    const NodeBox box =
        both(with_ghosts(blocks_[static_cast<std::size_t>(from)]), wanted(to, bodies));
    if (is_empty(box)) return;
    std::size_t size = n_fields;
    for (int d = 0; d < 3; ++d) size *= static_cast<std::size_t>(box.hi[d] - box.lo[d]);
    list.push_back({box, peer, std::vector<Real>(size)});
  };
  for (int r = 0; r < ranks_->size(); ++r) {
    if (r == own) continue;
    make(own, r, r, pieces_);
    make(r, own, r, outgoing_);
  }
  std::vector<RankExchange::Message> sends, receives;
  for (Piece& p : outgoing_) sends.push_back({p.peer, p.data});
  for (Piece& p : pieces_) receives.push_back({p.peer, p.data});
  exchange_ = std::make_unique<RankExchange>(*ranks_, channel_far, sends, receives);
}

void FarNodes::fetch(FieldsView<const Real> W) {
  const int fields = W.artificial_pressure ? n_fields : n_fields - 1;
  for (Piece& p : outgoing_) {
    for (int k = p.box.lo[2]; k < p.box.hi[2]; ++k) {
      for (int j = p.box.lo[1]; j < p.box.hi[1]; ++j) {
        Real* to = p.data.data() + p.offset(p.box.lo[0], j, k);
        for (int f = 0; f < fields; ++f)
          std::copy_n(&W(f, p.box.lo[0], j, k), p.row(), to + f * p.row());
      }
    }
  }
  exchange_->start();
  exchange_->finish();
}

}  // namespace ocublast::flow
