#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "coupler/link/participant.hpp"

namespace ocublast::coupler {

/// A participant of a run: the flow, or one of the solids; solid_party(1), (2), ... are further
/// ones.
enum class Party : std::uint32_t { flow = 0, solid = 1 };

[[nodiscard]] constexpr std::size_t index_of(Party party) {
  return static_cast<std::size_t>(party);
}
/// The solid number k = 0, 1, ... in the order of the case.
[[nodiscard]] constexpr Party solid_party(std::size_t k) {
  return static_cast<Party>(1 + k);
}
[[nodiscard]] constexpr link::Role role_of(Party party) {
  return party == Party::flow ? link::Role::flow : link::Role::solid;
}

/// Who takes part in a run. The name of a single solid is empty.
class Roster {
 public:
  Roster() : Roster(std::vector<std::string>{""}) {}
  explicit Roster(std::vector<std::string> solids) : solids_(std::move(solids)) {
    for (std::size_t k = 0; k <= solids_.size(); ++k) all_.push_back(static_cast<Party>(k));
  }
  [[nodiscard]] std::size_t size() const { return all_.size(); }
  [[nodiscard]] std::size_t n_solids() const { return solids_.size(); }
  [[nodiscard]] bool several() const { return solids_.size() > 1; }
  [[nodiscard]] const std::vector<Party>& all() const { return all_; }
  [[nodiscard]] const std::vector<std::string>& solids() const { return solids_; }
  /// The solid's name in the case, empty for the flow and for a single solid.
  [[nodiscard]] std::string name(Party party) const {
    return party == Party::flow ? std::string() : solids_.at(index_of(party) - 1);
  }
  /// For messages: flow, solid, solid 'left'.
  [[nodiscard]] std::string word(Party party) const {
    if (party == Party::flow) return "flow";
    return name(party).empty() ? "solid" : "solid '" + name(party) + "'";
  }
  /// For files: flow, solid, left.
  [[nodiscard]] std::string file_name(Party party) const {
    if (party == Party::flow) return "flow";
    return name(party).empty() ? "solid" : name(party);
  }

 private:
  std::vector<std::string> solids_;
  std::vector<Party> all_;
};

}  // namespace ocublast::coupler
