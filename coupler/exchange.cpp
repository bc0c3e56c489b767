#include "coupler/exchange.hpp"

#include <algorithm>
#include <cstring>

#include <fmt/format.h>

#include "coupler/base/errors.hpp"

namespace ocublast::coupler {

using link::Header;
using link::Kind;
using link::Role;
namespace field = link::field;

namespace {

/// Stands for "no limit" where a wait is watched over by heartbeats alone.
constexpr double no_limit = 1e9;

/// Slots a sender may fill before the recording must have written the oldest.
constexpr std::size_t unwritten_slots = link::memory_slots - 2;

}  // namespace

link::PayloadView Answer::values() const {
  return link::view_payload(message->header, message->payload());
}

Exchange::Exchange(Partners& partners, Server& server, const Settings& settings, Interface interface,
                   TrafficWriter* traffic)
    : partners_(partners), server_(server), settings_(settings), interface_(std::move(interface)),
      traffic_(traffic) {
  if (server.reads_memory(Role::flow))
    motion_memory_ = link::SharedMemory(6 * interface_.n_flow * sizeof(double), link::memory_slots);
  if (interface_.map) motion_.resize(6 * interface_.n_solid);
}

std::span<double> Exchange::motion_room() { return interface_.map ? std::span(motion_) : motion_to_send(); }

std::span<const double> Exchange::wall() const { return wall_; }

void Exchange::set_wall(std::span<const double> position) {
  if (!interface_.map) return;
  wall_.assign(position.begin(), position.end());
  wall_flow_.resize(3 * interface_.n_flow);
  interface_.map->map_position(wall_, wall_flow_);
}

/// What is in the room, on the flow's mesh into the order.
void Exchange::map_motion() {
  const auto out = motion_to_send();
  const std::span motion(motion_);
  set_wall(motion.first(motion.size() / 2));
  std::copy(wall_flow_.begin(), wall_flow_.end(), out.begin());
  interface_.map->map_vectors(motion.last(motion.size() / 2), out.last(out.size() / 2));
}

std::span<double> Exchange::motion_to_send() {
  const std::size_t n = 6 * interface_.n_flow;
  if (motion_memory_) {
    if (traffic_ != nullptr && motions_in_memory_.size() > unwritten_slots) {
      traffic_->wait_written(motions_in_memory_.front());
      motions_in_memory_.pop_front();
    }
    return {reinterpret_cast<double*>(motion_memory_.slot(motions_).data()), n};
  }
  if (motion_frame_.size() != n * sizeof(double)) motion_frame_.rebuild(n * sizeof(double));
  return {static_cast<double*>(motion_frame_.data()), n};
}

Header Exchange::make_step(Role role, const Ask& ask) const {
  Header step;
  step.kind = Kind::step;
  step.window = ask.window.number;
  step.t_begin = ask.window.t_begin;
  step.t_end = ask.window.t_end;
  step.steps = role == Role::flow ? ask.window.steps_flow : ask.window.steps_solid;
  step.iteration = ask.iteration;
  step.wants_acceleration = ask.wants_acceleration && role == Role::solid;
  step.load_shape = settings_.load_shape;
  step.wall_path = settings_.wall_path;
  step.n_vertices = role == Role::flow ? interface_.n_flow : interface_.n_solid;
  step.idle = true;
  return step;
}

/// The participant is about to fill its next slot: what lies there must have been recorded.
void Exchange::spare_memory(Role role) {
  auto& records = in_memory_[index(role)];
  while (records.size() > unwritten_slots) {
    traffic_->wait_written(records.front());
    records.pop_front();
  }
}

void Exchange::post(Role role, Header step, zmq::message_t& frame, std::span<const std::byte> memory,
                    std::optional<std::uint64_t> same_as) {
  if (traffic_ != nullptr) spare_memory(role);
  asked_[index(role)] = step;
  zmq::message_t kept;  // sending empties the frame
  if (traffic_ != nullptr) kept.copy(frame);
  if (step.memory.pid != 0) step.payload_bytes = memory.size();
  const std::string sent = server_.send(role, step, frame);
  partners_.set_computing(role, true);
  if (traffic_ == nullptr) return;
  if (step.memory.pid == 0) {
    traffic_->append(direction_of(role, false), sent, kept, same_as);
    return;
  }
  const auto record = traffic_->append(direction_of(role, false), link::decode(sent), memory, same_as);
  if (!same_as) motions_in_memory_.push_back(record);
}

void Exchange::post_motion(const Ask& ask) {
  if (interface_.map) map_motion();
  Header step = make_step(Role::flow, ask);
  step.idle = false;
  step.fields = field::position | field::velocity;
  if (motion_memory_) {
    const auto memory = motion_memory_.slot(motions_);
    step.memory = motion_memory_.place(motions_++);
    zmq::message_t nothing;
    post(Role::flow, std::move(step), nothing, memory, {});
  } else {
    zmq::message_t frame = std::move(motion_frame_);
    motion_frame_ = {};
    post(Role::flow, std::move(step), frame, {}, {});
  }
}

void Exchange::post_rest(const Ask& ask) {
  zmq::message_t nothing;
  post(Role::flow, make_step(Role::flow, ask), nothing, {}, {});
}

void Exchange::post_load(const Ask& ask, const Answer& flow) {
  Header step = make_step(Role::solid, ask);
  step.idle = false;
  step.fields = field::overpressure;
  if (interface_.map) {
    post_mapped_load(std::move(step), flow.values().overpressure);
    return;
  }
  zmq::message_t frame;
  const auto bytes = flow.message->payload();
  if (flow.header().memory.pid == 0) {
    frame.copy(flow.message->frames.payload);
    step.payload_checksum = flow.header().payload_checksum;
  } else if (server_.reads_memory(Role::solid)) {
    step.memory = flow.header().memory;
  } else {
    frame.rebuild(bytes.data(), bytes.size());
  }
  const auto memory = step.memory.pid != 0 ? bytes : std::span<const std::byte>();
  post(Role::solid, std::move(step), frame, memory, flow.record);
}

void Exchange::post_load(const Ask& ask, std::span<const double> overpressure) {
  Header step = make_step(Role::solid, ask);
  step.idle = false;
  step.fields = field::overpressure;
  if (interface_.map) {
    post_mapped_load(std::move(step), overpressure);
    return;
  }
  zmq::message_t frame(overpressure.data(), overpressure.size_bytes());
  post(Role::solid, std::move(step), frame, {}, {});
}

/// Forces where the solid takes them, else its vertices' overpressure.
void Exchange::post_mapped_load(Header step, std::span<const double> overpressure) {
  const std::size_t n = (interface_.takes_force ? 3 : 1) * interface_.n_solid;
  zmq::message_t frame(n * sizeof(double));
  const std::span<double> values(static_cast<double*>(frame.data()), n);
  if (interface_.takes_force) {
    step.fields = field::force;
    interface_.map->map_force(overpressure, wall_flow_, wall_, values);
  } else {
    interface_.map->map_pressure(overpressure, values);
  }
  post(Role::solid, std::move(step), frame, {}, {});
}

void Exchange::post_no_load(const Ask& ask) {
  zmq::message_t nothing;
  post(Role::solid, make_step(Role::solid, ask), nothing, {}, {});
}

void Exchange::check(Incoming& result) const {
  const Header& h = result.header;
  const Header& asked = *asked_[index(result.role)];
  if (h.window != asked.window || h.t_begin != asked.t_begin || h.t_end != asked.t_end ||
      h.iteration != asked.iteration)
    throw PartnerFault(result.role, fmt::format("answered window {} ({} s to {} s, iteration {}), asked was "
                                                "window {} ({} s to {} s, iteration {})", h.window, h.t_begin,
                                                h.t_end, h.iteration, asked.window, asked.t_begin, asked.t_end,
                                                asked.iteration));
  std::uint32_t expected = result.role == Role::flow ? field::overpressure : field::position | field::velocity;
  if (asked.wants_acceleration) expected |= field::acceleration;
  if (h.idle) expected = 0;
  if (h.fields != expected)
    throw PartnerFault(result.role, fmt::format("RESULT of window {} holds fields {:#x}, expected {:#x}",
                                                h.window, h.fields, expected));
  const std::size_t n = result.role == Role::flow ? interface_.n_flow : interface_.n_solid;
  if (h.fields != 0 && h.n_vertices != n)
    throw PartnerFault(result.role, fmt::format("RESULT of window {} has {} vertices, the interface "
                                                "mesh {}", h.window, h.n_vertices, n));
  try {
    link::check_payload(h, result.payload());
  } catch (const LinkError& error) {
    throw PartnerFault(result.role, error.what());
  }
}

void Exchange::accept(Incoming message) {
  const Role role = message.role;
  const auto i = index(role);
  if (message.header.kind != Kind::result || !asked_[i] || answers_[i])
    throw PartnerFault(role, fmt::format("sent {} while RESULT was awaited", link::to_word(message.header.kind)));
  check(message);
  asked_[i].reset();
  partners_.set_computing(role, false);
  Answer answer{.message = std::make_shared<Incoming>(std::move(message)), .record = {}};
  if (traffic_ != nullptr) {
    Incoming& m = *answer.message;
    if (m.header.memory.pid == 0) {
      answer.record = traffic_->append(direction_of(role, true), m.frames.header_view(), m.frames.payload);
    } else {
      answer.record = traffic_->append(direction_of(role, true), m.header, m.payload());
      in_memory_[i].push_back(*answer.record);
    }
  }
  answers_[i] = std::move(answer);
}

Answer Exchange::collect(Role role) {
  const double limit = settings_.step_limit > 0.0 ? settings_.step_limit : no_limit;
  auto& answer = answers_[index(role)];
  while (!answer) accept(partners_.await(role, "RESULT", limit));
  Answer out = std::move(*answer);
  answer.reset();
  return out;
}

}  // namespace ocublast::coupler
