#include "solid_solver/parallel/shared_values.hpp"

#include <algorithm>
#include <map>

namespace ocublast::solid {

SharedValues::SharedValues(const Ranks& ranks, int channel, std::span<const Item> items,
                           std::size_t width, std::size_t stride)
    : width_(width), stride_(stride) {
  std::map<int, std::vector<std::size_t>> with;  // rows by neighbour, in the order of the items
  for (const auto& item : items)
    for (const int r : item.ranks)
      if (r != ranks.rank()) with[r].push_back(static_cast<std::size_t>(item.at));
  std::map<int, std::size_t> next;  // place in in_ of a neighbour's next item
  for (const auto& [rank, rows] : with) {
    next[rank] = rows_.size() * width_;
    rows_.insert(rows_.end(), rows.begin(), rows.end());
  }
  out_.resize(rows_.size() * width_);
  in_.resize(out_.size());
  std::vector<RankExchange::Message> sends;
  std::vector<RankExchange::Message> receives;
  for (const auto& [rank, rows] : with) {
    const std::size_t length = rows.size() * width_;
    sends.push_back({rank, std::span<double>(out_).subspan(next[rank], length)});
    receives.push_back({rank, std::span<double>(in_).subspan(next[rank], length)});
  }
  for (const auto& item : items) {
    items_.push_back(static_cast<std::size_t>(item.at));
    first_.push_back(sources_.size());
    for (const int r : item.ranks) {
      sources_.push_back(r == ranks.rank() ? npos : next[r]);
      if (r != ranks.rank()) next[r] += width_;
    }
  }
  first_.push_back(sources_.size());
  exchange_ = std::make_unique<RankExchange>(ranks, channel, sends, receives);
}

void SharedValues::start(std::span<const double> field) {
  double* to = out_.data();
  for (const auto row : rows_)
    for (std::size_t i = 0; i < width_; ++i) *to++ = field[row * stride_ + i];
  exchange_->start();
}

template <class Combine>
void SharedValues::combine(std::span<double> field, Combine combine) {
  exchange_->finish();
  for (std::size_t k = 0; k < items_.size(); ++k) {
    double* own = &field[items_[k] * stride_];
    for (std::size_t i = 0; i < width_; ++i) {
      const auto part = [&](std::size_t s) {
        return sources_[s] == npos ? own[i] : in_[sources_[s] + i];
      };
      double value = part(first_[k]);
      for (std::size_t s = first_[k] + 1; s < first_[k + 1]; ++s) value = combine(value, part(s));
      own[i] = value;
    }
  }
}

void SharedValues::finish(std::span<double> field) {
  combine(field, [](double a, double b) { return a + b; });
}

void SharedValues::take_least(std::span<double> field) {
  start(field);
  combine(field, [](double a, double b) { return std::min(a, b); });
}

}  // namespace ocublast::solid
