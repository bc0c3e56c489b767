#include "coupler/exchange.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "coupler/base/errors.hpp"

namespace ocublast::coupler {

using link::Header;
using link::Kind;
namespace field = link::field;

namespace {

/// Stands for "no limit" where a wait is watched over by heartbeats alone.
constexpr double no_limit = 1e9;

/// Slots for the orders to the flow, which has read one when it answers.
constexpr unsigned unrecorded_slots = 2;

/// Slots of this size that a sender may fill before the recording must have written the oldest.
std::size_t unwritten_slots(std::size_t slot_bytes) {
  return link::memory_slots(slot_bytes) - 2;
}

bool all_zero(std::span<const double> values) {
  return std::all_of(values.begin(), values.end(), [](double v) { return v == 0.0; });
}

}  // namespace

Exchange::Exchange(Partners& partners, Server& server, const Settings& settings,
                   std::vector<Interface> interfaces, bool sends_force, TrafficWriter* traffic)
    : partners_(partners),
      server_(server),
      settings_(settings),
      interfaces_(std::move(interfaces)),
      components_(sends_force ? 3 : 1),
      traffic_(traffic),
      asked_(server.roster().size()),
      answers_(server.roster().size()),
      in_memory_(server.roster().size()),
      unwritten_(server.roster().size()) {
  for (Interface& i : interfaces_) {
    i.first_flow = n_flow_;
    i.first_solid = n_solid_;
    n_flow_ += i.n_flow;
    n_solid_ += i.n_solid;
    mapped_ = mapped_ || i.map;
  }
  const std::size_t bytes = 6 * n_flow_ * sizeof(double);
  if (server.reads_memory(Party::flow))
    motion_memory_ = link::SharedMemory(
        bytes, traffic == nullptr ? unrecorded_slots : link::memory_slots(bytes));
  if (mapped_) motion_.resize(6 * n_solid_);
  unwritten_[index_of(Party::flow)] =
      unwritten_slots((components_ * n_flow_ + 4 * interfaces_.size()) * sizeof(double));
  for (std::size_t k = 0; k < interfaces_.size(); ++k)
    unwritten_[index_of(solid_party(k))] =
        unwritten_slots(9 * interfaces_[k].n_solid * sizeof(double));
}

std::span<double> Exchange::motion_room() {
  return mapped_ ? std::span(motion_) : motion_to_send();
}

void Exchange::set_wall(std::span<const double> position) {
  if (!mapped_) return;
  wall_.assign(position.begin(), position.end());
  wall_flow_.resize(3 * n_flow_);
  const std::span<const double> from(wall_);
  const std::span<double> to(wall_flow_);
  for (const Interface& i : interfaces_) {
    const auto mine = from.subspan(3 * i.first_solid, 3 * i.n_solid);
    const auto its = to.subspan(3 * i.first_flow, 3 * i.n_flow);
    if (i.map)
      i.map->map_position(mine, its);
    else
      std::copy(mine.begin(), mine.end(), its.begin());
  }
}

/// What is in the room, on the flow's meshes into the order.
void Exchange::map_motion() {
  const auto out = motion_to_send();
  const std::span<const double> motion(motion_);
  set_wall(motion.first(3 * n_solid_));
  std::copy(wall_flow_.begin(), wall_flow_.end(), out.begin());
  for (const Interface& i : interfaces_) {
    const auto mine = motion.subspan(3 * (n_solid_ + i.first_solid), 3 * i.n_solid);
    const auto its = out.subspan(3 * (n_flow_ + i.first_flow), 3 * i.n_flow);
    if (i.map)
      i.map->map_vectors(mine, its);
    else
      std::copy(mine.begin(), mine.end(), its.begin());
  }
}

std::span<double> Exchange::motion_to_send() {
  const std::size_t n = 6 * n_flow_;
  if (motion_memory_) {
    if (traffic_ != nullptr && motions_in_memory_.size() > unwritten_slots(n * sizeof(double))) {
      traffic_->wait_written(motions_in_memory_.front());
      motions_in_memory_.pop_front();
    }
    return {reinterpret_cast<double*>(motion_memory_.slot(motions_).data()), n};
  }
  if (motion_frame_.size() != n * sizeof(double)) motion_frame_.rebuild(n * sizeof(double));
  return {static_cast<double*>(motion_frame_.data()), n};
}

Header Exchange::make_step(Party party, const Ask& ask) const {
  const bool flow = party == Party::flow;
  Header step;
  step.kind = Kind::step;
  step.window = ask.window.number;
  step.t_begin = ask.window.t_begin;
  step.t_end = ask.window.t_end;
  step.steps = flow ? ask.window.steps_flow : ask.window.steps_solid;
  step.iteration = ask.iteration;
  step.wants_acceleration = ask.wants_acceleration && !flow;
  step.load_shape = settings_.load_shape;
  step.wall_path = settings_.wall_path;
  step.n_vertices = flow ? n_flow_ : interfaces_[index_of(party) - 1].n_solid;
  step.idle = true;
  return step;
}

/// The participant is about to fill its next slot: what lies there must have been recorded.
void Exchange::spare_memory(Party party) {
  auto& records = in_memory_[index_of(party)];
  while (records.size() > unwritten_[index_of(party)]) {
    traffic_->wait_written(records.front());
    records.pop_front();
  }
}

void Exchange::post(Party party, Header step, zmq::message_t& frame,
                    std::span<const std::byte> memory, std::optional<std::uint64_t> same_as) {
  if (traffic_ != nullptr) spare_memory(party);
  asked_[index_of(party)] = step;
  zmq::message_t kept;  // sending empties the frame
  if (traffic_ != nullptr) kept.copy(frame);
  if (step.memory.pid != 0) step.payload_bytes = memory.size();
  const std::string sent = server_.send(party, step, frame);
  partners_.set_computing(party, true);
  if (traffic_ == nullptr) return;
  const Direction direction{party, false};
  if (step.memory.pid == 0) {
    traffic_->append(direction, sent, kept, same_as);
    return;
  }
  const auto record = traffic_->append(direction, link::decode(sent), memory, same_as);
  if (same_as) return;
  if (party == Party::flow)
    motions_in_memory_.push_back(record);
  else
    in_memory_[index_of(Party::flow)].back() = record;  // a part of the flow's answer
}

void Exchange::post_motion(const Ask& ask) {
  if (mapped_) map_motion();
  Header step = make_step(Party::flow, ask);
  step.idle = false;
  step.fields = field::position | field::velocity;
  if (motion_memory_) {
    const auto memory = motion_memory_.slot(motions_);
    step.memory = motion_memory_.place(motions_++);
    zmq::message_t nothing;
    post(Party::flow, std::move(step), nothing, memory, {});
  } else {
    zmq::message_t frame = std::move(motion_frame_);
    motion_frame_ = {};
    post(Party::flow, std::move(step), frame, {}, {});
  }
}

void Exchange::post_rest(const Ask& ask) {
  zmq::message_t nothing;
  post(Party::flow, make_step(Party::flow, ask), nothing, {}, {});
}

void Exchange::post_load(const Ask& ask, const Answer& flow) {
  if (mapped_ || interfaces_.size() > 1) {
    post_parts(ask, load_of(flow), &flow);
    return;
  }
  zero_loads_ = 0;
  Header step = make_step(Party::solid, ask);
  step.idle = false;
  step.fields = components_ == 3 ? field::force : field::overpressure;
  zmq::message_t frame;
  const auto bytes = flow.message->payload();
  if (flow.header().memory.pid == 0) {
    frame.copy(flow.message->frames.payload);
    step.payload_checksum = flow.header().payload_checksum;
  } else if (server_.reads_memory(Party::solid)) {
    step.memory = flow.header().memory;
  } else {
    frame.rebuild(bytes.data(), bytes.size());
  }
  const auto memory = step.memory.pid != 0 ? bytes : std::span<const std::byte>();
  post(Party::solid, std::move(step), frame, memory, flow.record);
}

void Exchange::post_load(const Ask& ask, std::span<const double> load) {
  post_parts(ask, load, nullptr);
}

/// To each solid its part; to those whose load was and stays zero, that it is.
void Exchange::post_parts(const Ask& ask, std::span<const double> load, const Answer* flow) {
  zero_loads_ = 0;
  for (std::size_t k = 0; k < interfaces_.size(); ++k) {
    const auto part =
        load.subspan(components_ * interfaces_[k].first_flow, components_ * interfaces_[k].n_flow);
    const std::uint64_t bit = std::uint64_t{1} << k;
    const bool zero = all_zero(part);
    if (zero) zero_loads_ |= bit;
    zmq::message_t nothing;
    if (zero && (ask.zero_before & bit) != 0)
      post(solid_party(k), make_step(solid_party(k), ask), nothing, {}, {});
    else
      post_part(k, ask, part, flow);
  }
}

/// Load as it is or, mapped, forces where the solid takes them, else its vertices' overpressure.
void Exchange::post_part(std::size_t k, const Ask& ask, std::span<const double> load,
                         const Answer* flow) {
  const Interface& i = interfaces_[k];
  const Party party = solid_party(k);
  Header step = make_step(party, ask);
  step.idle = false;
  step.fields = components_ == 3 || (i.map && i.takes_force) ? field::force : field::overpressure;
  zmq::message_t frame;
  if (!i.map && flow != nullptr && flow->header().memory.pid != 0 && server_.reads_memory(party)) {
    step.memory = flow->header().memory;
    step.memory.offset += components_ * i.first_flow * sizeof(double);
    post(party, std::move(step), frame, std::as_bytes(load), {});
    return;
  }
  const std::size_t n = (step.fields == field::force ? 3 : 1) * i.n_solid;
  frame.rebuild(n * sizeof(double));
  const std::span<double> values(static_cast<double*>(frame.data()), n);
  if (!i.map) {
    std::copy(load.begin(), load.end(), values.begin());
  } else if (i.takes_force) {
    i.map->map_force(load, std::span(wall_flow_).subspan(3 * i.first_flow, 3 * i.n_flow),
                     std::span(wall_).subspan(3 * i.first_solid, 3 * i.n_solid), values);
  } else {
    i.map->map_pressure(load, values);
  }
  post(party, std::move(step), frame, {}, {});
}

void Exchange::post_no_load(const Ask& ask) {
  zero_loads_ = ~std::uint64_t{0};
  zmq::message_t nothing;
  for (std::size_t k = 0; k < interfaces_.size(); ++k)
    post(solid_party(k), make_step(solid_party(k), ask), nothing, {}, {});
}

void Exchange::check(Incoming& result) const {
  const Party party = result.party;
  const bool flow = party == Party::flow;
  const Header& h = result.header;
  const Header& asked = *asked_[index_of(party)];
  if (h.window != asked.window || h.t_begin != asked.t_begin || h.t_end != asked.t_end ||
      h.iteration != asked.iteration)
    throw PartnerFault(
        party, fmt::format("answered window {} ({} s to {} s, iteration {}), asked was "
                           "window {} ({} s to {} s, iteration {})",
                           h.window, h.t_begin, h.t_end, h.iteration, asked.window, asked.t_begin,
                           asked.t_end, asked.iteration));
  std::uint32_t expected = !flow              ? field::position | field::velocity
                           : components_ == 3 ? field::force
                                              : field::overpressure;
  if (asked.wants_acceleration) expected |= field::acceleration;
  if (h.idle) expected = 0;
  // A flow may leave the balances of several interfaces out: then they are not reported one by one.
  const bool balanced =
      flow && !h.idle && interfaces_.size() > 1 && h.n_interfaces == interfaces_.size();
  if (h.fields != expected && !(balanced && h.fields == (expected | field::balance)))
    throw PartnerFault(party, fmt::format("RESULT of window {} holds fields {:#x}, expected {:#x}",
                                          h.window, h.fields, expected));
  if (h.fields != 0 && h.n_vertices != asked.n_vertices)
    throw PartnerFault(party, fmt::format("RESULT of window {} has {} vertices, the interface "
                                          "mesh {}",
                                          h.window, h.n_vertices, asked.n_vertices));
}

/// Length, checksum and finiteness; false where only finiteness is left, and left to the caller.
bool Exchange::check_values(Incoming& result) const {
  const Header& h = result.header;
  const auto bytes = result.payload();
  if (checks_later_ && interfaces_.size() == 1 && h.memory.pid != 0 &&
      bytes.size() == h.payload_bytes && h.payload_checksum == 0)
    return false;
  try {
    link::check_payload(h, bytes);
  } catch (const LinkError& error) {
    throw PartnerFault(result.party, error.what());
  }
  return true;
}

void Exchange::check_finite(const Answer& answer) const {
  if (answer.checked) return;
  try {
    link::check_payload(answer.header(), answer.message->payload());
  } catch (const LinkError& error) {
    throw PartnerFault(answer.message->party, error.what());
  }
}

void Exchange::accept(Incoming message) {
  const Party party = message.party;
  const auto i = index_of(party);
  if (message.header.kind != Kind::result || !asked_[i] || answers_[i])
    throw PartnerFault(
        party, fmt::format("sent {} while RESULT was awaited", link::to_word(message.header.kind)));
  check(message);
  const bool checked = check_values(message);
  asked_[i].reset();
  partners_.set_computing(party, false);
  auto kept = std::make_shared<Incoming>(std::move(message));
  Answer answer{.totals = kept->header,
                .owner = kept,
                .view = link::view_payload(kept->header, kept->payload()),
                .message = kept,
                .record = {},
                .each = {},
                .checked = checked};
  if (traffic_ != nullptr) {
    const Direction direction{party, true};
    if (kept->header.memory.pid == 0) {
      answer.record = traffic_->append(direction, kept->frames.header_view(), kept->frames.payload);
    } else {
      answer.record = traffic_->append(direction, kept->header, kept->payload());
      in_memory_[i].push_back(*answer.record);
    }
  }
  answers_[i] = std::move(answer);
}

Answer Exchange::collect(Party party) {
  const double limit = settings_.step_limit > 0.0 ? settings_.step_limit : no_limit;
  auto& answer = answers_[index_of(party)];
  while (!answer) accept(partners_.await(party, "RESULT", limit));
  Answer out = std::move(*answer);
  answer.reset();
  return out;
}

Answer Exchange::collect_flow() {
  return collect(Party::flow);
}

Answer Exchange::collect_solids(const CouplingState& state) {
  if (interfaces_.size() == 1) return collect(Party::solid);
  std::vector<Answer> answers;
  for (std::size_t k = 0; k < interfaces_.size(); ++k) answers.push_back(collect(solid_party(k)));
  return combine(std::move(answers), state);
}

Answer Exchange::combine(std::vector<Answer> answers, const CouplingState& state) const {
  Answer all;
  Header& sum = all.totals = answers.front().header();
  sum.memory = {};
  bool accelerated = false;
  for (std::size_t k = 0; k < answers.size(); ++k) {
    const Header& h = answers[k].header();
    all.each.push_back(h);
    accelerated = accelerated || !answers[k].view.acceleration.empty();
    if (k == 0) continue;
    sum.idle = sum.idle && h.idle;
    sum.steps = std::max(sum.steps, h.steps);
    sum.stable_step = std::min(sum.stable_step, h.stable_step);
    sum.work += h.work;
    for (std::size_t a = 0; a < 3; ++a) sum.impulse[a] += h.impulse[a];
    if (h.mass_per_area > 0.0)
      sum.mass_per_area =
          sum.mass_per_area > 0.0 ? std::min(sum.mass_per_area, h.mass_per_area) : h.mass_per_area;
    sum.compute_seconds =
        std::max(sum.compute_seconds, h.compute_seconds);  // they compute side by side
    if (!h.status.empty()) sum.status += (sum.status.empty() ? "" : "; ") + h.status;
  }
  if (sum.idle) return all;
  const std::size_t n = 3 * n_solid_;
  auto values = std::make_shared<std::vector<double>>((accelerated ? 3 : 2) * n, 0.0);
  const std::span<double> whole(*values);
  for (std::size_t k = 0; k < answers.size(); ++k) {
    const std::size_t at = 3 * interfaces_[k].first_solid, count = 3 * interfaces_[k].n_solid;
    const auto& view = answers[k].view;
    const auto position =
        answers[k].header().idle ? state.position.values.subspan(at, count) : view.position;
    std::copy(position.begin(), position.end(), whole.begin() + static_cast<long>(at));
    std::copy(view.velocity.begin(), view.velocity.end(),
              whole.begin() + static_cast<long>(n + at));
    if (accelerated)
      std::copy(view.acceleration.begin(), view.acceleration.end(),
                whole.begin() + static_cast<long>(2 * n + at));
  }
  all.view.position = whole.first(n);
  all.view.velocity = whole.subspan(n, n);
  if (accelerated) all.view.acceleration = whole.last(n);
  all.owner = values;
  return all;
}

}  // namespace ocublast::coupler
