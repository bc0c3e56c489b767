#include "solid_solver/parallel/team.hpp"

namespace ocublast::solid {

Team::Team(std::shared_ptr<const MeshPart> part) : part_(std::move(part)) {
  if (alone()) return;
  std::vector<SharedValues::Item> items;
  for (const auto& node : part_->shared) {
    auto& item = items.emplace_back(SharedValues::Item{.at = node.node});
    for (const auto& holder : node.holders)
      if (item.ranks.empty() || item.ranks.back() != holder.rank) item.ranks.push_back(holder.rank);
  }
  forces_ = std::make_unique<SharedValues>(*part_->ranks, forces_channel, items, 3, 4);
  numbers_ = std::make_unique<SharedValues>(*part_->ranks, numbers_channel, items, 1, 1);
}

double Team::sum(double value) const {
  return alone() ? value : part_->ranks->sum_of_all(value);
}

void Team::sum(std::span<double> values) const {
  if (!alone()) part_->ranks->sum_of_all(values);
}

double Team::least(double value) const {
  return alone() ? value : part_->ranks->min_of_all(value);
}

double Team::most(double value) const {
  return alone() ? value : part_->ranks->max_of_all(value);
}

void Team::most(std::span<double> values) const {
  if (!alone()) part_->ranks->max_of_all(values);
}

bool Team::any(bool value) const {
  return alone() ? value : part_->ranks->any_of_all(value);
}

void Team::together(const std::function<void()>& work) const {
  if (alone())
    work();
  else
    part_->ranks->together(work);
}

std::string Team::text_of(bool mine, const std::string& text) const {
  if (alone()) return text;
  const int rank = part_->ranks->rank();
  const double from = part_->ranks->max_of_all(mine ? rank : -1.0);
  return part_->ranks->broadcast(text, static_cast<int>(from));
}

void Team::broadcast(std::vector<double>& values) const {
  auto n = values.size();
  broadcast(n);
  values.resize(n);
  if (!alone()) part_->ranks->broadcast(std::span<double>(values));
}

void Team::add_nodal(std::span<double> values) {
  if (!alone()) numbers_->add(values);
}

void Team::take_least_nodal(std::span<double> values) {
  if (!alone()) numbers_->take_least(values);
}

}  // namespace ocublast::solid
