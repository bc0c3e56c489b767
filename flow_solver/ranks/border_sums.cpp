#include "flow_solver/ranks/border_sums.hpp"

#include <algorithm>

namespace ocublast::flow::inline OCU_PRECISION {
namespace {

constexpr std::size_t vector_size = 5 * tile_width;  ///< components and lanes of a face

}  // namespace

BorderSums::BorderSums(const RankPart& part, int axis, LineSolve solve, const WholeLine& line,
                       int groups, int channel)
    : known_(known_faces(solve, line.scheme)), groups_(static_cast<std::size_t>(groups)) {
  const auto a = static_cast<std::size_t>(axis);
  const std::vector<int>& begin = part.blocks.begin[a];
  const int parts = part.blocks.parts[a], own = part.block[a];
  const bool periodic = line.low == LineEnd::periodic;
  const auto rank_at = [&](int p) {
    std::array<int, 3> block = part.block;
    block[a] = p;
    return part.blocks.rank_of(block);
  };
  const auto weights_of = [&](int border, int p) {
    const auto b = static_cast<std::size_t>(p);
    return make_border_weights(line, solve, begin[static_cast<std::size_t>(border)], begin[b],
                               begin[b + 1]);
  };
  const std::size_t half = groups_ * static_cast<std::size_t>(known_) * vector_size;
  std::vector<RankExchange::Message> sends, receives;
  // Border q lies below part q; a periodic line has one more, numbered 0, below its first node.
  // Messages between two ranks follow each other by the number of the border on both sides.
  for (int q = periodic ? 0 : 1; q < parts; ++q) {
    const int below = (q + parts - 1) % parts;
    const Border* mine = nullptr;
    BorderWeights weights = weights_of(q, own);
    if (weights.first < weights.last) {
      auto border = std::make_unique<Border>(Border{std::move(weights), {}, {}, {}});
      border->weight = stored(border->weights.weight);
      border->ratio = stored(border->weights.ratio);
      border->sum.resize(groups_ * static_cast<std::size_t>(2 * known_ - 1) * vector_size);
      mine = border.get();
      sums_.push_back({.first = mine->weights.first,
                       .last = mine->weights.last,
                       .faces = mine->weights.faces,
                       .near_first = mine->weights.near_first,
                       .near_last = mine->weights.near_last,
                       .weight = mine->weight.data(),
                       .ratio = mine->ratio.data(),
                       .out = border->sum.data()});
      border_of_sum_.push_back(q);
      for (const int to : {below, q}) {
        if (to == own) continue;
        outgoing_.push_back(
            std::make_unique<Outgoing>(Outgoing{mine, to == q, std::vector<Real>(half)}));
        sends.push_back({rank_at(to), outgoing_.back()->data});
      }
      borders_.push_back(std::move(border));
    }
    if (below != own && q != own) continue;
    auto& end = q == own ? low_ : high_;
    end = std::make_unique<End>();
    end->total.resize(half);
    for (int p = 0; p < parts; ++p) {
      const bool contributes = p == own ? mine != nullptr : weights_of(q, p).weight.size() > 0;
      if (!contributes) continue;
      end->own.push_back(p == own ? mine : nullptr);
      end->parts.emplace_back(p == own ? 0 : half);
      if (p != own) receives.push_back({rank_at(p), end->parts.back()});
    }
  }
  exchange_ = std::make_unique<RankExchange>(*part.ranks, channel, sends, receives);
}

/// The known faces of one side: those from the border on, or up to it.
void BorderSums::copy_half(const Border& border, bool low_end, Real* to) const {
  const auto faces = static_cast<std::size_t>(2 * known_ - 1),
             half = static_cast<std::size_t>(known_);
  const Real* from = border.sum.data() + (low_end ? (half - 1) * vector_size : 0);
  for (std::size_t g = 0; g < groups_; ++g) {
    to = std::copy_n(from + g * faces * vector_size, half * vector_size, to);
  }
}

void BorderSums::start() {
  for (const auto& out : outgoing_) copy_half(*out->border, out->low_end, out->data.data());
  exchange_->start();
}

void BorderSums::finish() {
  exchange_->finish();
  for (End* end : {low_.get(), high_.get()}) {
    if (end == nullptr) continue;
    std::vector<Real>& total = end->total;
    for (std::size_t p = 0; p < end->parts.size(); ++p) {
      if (end->own[p] != nullptr) {
        end->parts[p].resize(total.size());
        copy_half(*end->own[p], end == low_.get(), end->parts[p].data());
      }
      const std::vector<Real>& add = end->parts[p];
      if (p == 0)
        total = add;
      else
        std::transform(total.begin(), total.end(), add.begin(), total.begin(), std::plus<>());
    }
  }
}

Traffic BorderSums::traffic() const {
  Traffic t;
  for (const auto& out : outgoing_)
    t += {1.0, static_cast<double>(out->data.size() * sizeof(Real))};
  return t;
}

}  // namespace ocublast::flow
