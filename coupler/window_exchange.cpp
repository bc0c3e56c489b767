#include "coupler/window_exchange.hpp"

#include <algorithm>
#include <cstring>

#include <fmt/format.h>

#include "coupler/base/errors.hpp"
#include "coupler/link/payload.hpp"
#include "coupler/predictor.hpp"

namespace ocublast::coupler {

using link::Header;
using link::Kind;
using link::Role;
namespace field = link::field;

namespace {

/// Stands for "no limit" where a wait is watched over by heartbeats alone.
constexpr double no_limit = 1e9;

}  // namespace

WindowExchange::WindowExchange(Partners& partners, Server& server, const Settings& settings,
                               std::size_t n_vertices, TrafficWriter* traffic)
    : partners_(partners), server_(server), settings_(settings), n_vertices_(n_vertices),
      traffic_(traffic) {}

zmq::message_t WindowExchange::predict(const CouplingState& state, const TimeWindow& window,
                                       int order) const {
  const std::size_t n = 3 * n_vertices_;
  zmq::message_t payload(2 * n * sizeof(double));
  const std::span<double> values(static_cast<double*>(payload.data()), 2 * n);
  const WallHistory history{.position = state.position.values,
                            .velocity = state.velocity.values,
                            .velocity_before = state.velocity_before.values,
                            .width_before = state.velocity_before.values.empty() ? 0.0
                                                                                 : state.width_before};
  // A wall that rests is sent as it is, once.
  predict_wall(history, state.solid_at_rest ? 0 : order, window.width(), values.first(n), values.last(n));
  return payload;
}

Header WindowExchange::make_step(const TimeWindow& window, std::uint32_t steps) const {
  Header step;
  step.kind = Kind::step;
  step.window = window.number;
  step.t_begin = window.t_begin;
  step.t_end = window.t_end;
  step.steps = steps;
  step.load_shape = settings_.load_shape;
  step.wall_path = settings_.wall_path;
  step.n_vertices = n_vertices_;
  return step;
}

std::shared_ptr<Incoming> WindowExchange::ask(Role role, Header step, zmq::message_t& payload,
                                              std::optional<std::uint64_t> same_as) {
  zmq::message_t kept;
  if (traffic_ != nullptr) kept.copy(payload);
  step.idle = step.fields == 0;
  const std::string sent = server_.send(role, std::move(step), payload);
  if (traffic_ != nullptr) traffic_->append(direction_of(role, false), sent, kept, same_as);
  partners_.set_computing(role, true);
  const double limit = settings_.step_limit > 0.0 ? settings_.step_limit : no_limit;
  auto result = std::make_shared<Incoming>(partners_.await(role, Kind::result, "RESULT", limit));
  partners_.set_computing(role, false);
  if (traffic_ != nullptr)
    load_record_ = traffic_->append(direction_of(role, true), result->frames.header_view(),
                                    result->frames.payload);
  return result;
}

void WindowExchange::check_result(const Incoming& result, const TimeWindow& window,
                                  std::uint32_t fields) const {
  const Header& h = result.header;
  if (h.window != window.number || h.t_begin != window.t_begin || h.t_end != window.t_end)
    throw PartnerFault(result.role, fmt::format("answered window {} ({} s to {} s), asked was window "
                                                "{} ({} s to {} s)", h.window, h.t_begin, h.t_end,
                                                window.number, window.t_begin, window.t_end));
  const std::uint32_t expected = h.idle ? 0 : fields;
  if (h.fields != expected)
    throw PartnerFault(result.role, fmt::format("RESULT of window {} holds fields {:#x}, expected {:#x}",
                                                window.number, h.fields, expected));
  if (h.fields != 0 && h.n_vertices != n_vertices_)
    throw PartnerFault(result.role, fmt::format("RESULT of window {} has {} vertices, the interface "
                                                "mesh {}", window.number, h.n_vertices, n_vertices_));
}

void WindowExchange::accept_motion(CouplingState& state, const std::shared_ptr<Incoming>& result,
                                   double width) const {
  state.velocity_before = state.velocity;
  state.width_before = width;
  state.solid_at_rest = result->header.idle;
  if (!result->header.idle) {
    const auto view = link::view_payload(result->header, result->payload());
    state.position = {result, view.position};
    state.velocity = {result, view.velocity};
  } else if (std::any_of(state.velocity.values.begin(), state.velocity.values.end(),
                         [](double v) { return v != 0.0; })) {
    state.velocity = SharedValues::from(std::vector<double>(3 * n_vertices_, 0.0));
  }
}

WindowReports WindowExchange::advance(CouplingState& state, const TimeWindow& window, int order) {
  Header step = make_step(window, window.steps_flow);
  zmq::message_t motion;
  if (!(state.solid_at_rest && state.wall_current)) {
    motion = predict(state, window, order);
    step.fields = field::position | field::velocity;
  }
  state.wall_current = state.solid_at_rest;
  const auto flow = ask(Role::flow, std::move(step), motion, {});
  check_result(*flow, window, field::overpressure);
  const auto flow_record = load_record_;

  step = make_step(window, window.steps_solid);
  zmq::message_t load;
  std::optional<std::uint64_t> same_as;
  if (!flow->header.idle) {
    load.copy(flow->frames.payload);
    step.payload_checksum = flow->header.payload_checksum;
    step.fields = field::overpressure;
    same_as = flow_record;
  } else if (!state.load_zero) {  // the load falls to zero within this window: say so in full
    load.rebuild(n_vertices_ * sizeof(double));
    std::memset(load.data(), 0, load.size());
    step.fields = field::overpressure;
  }
  state.load_zero = flow->header.idle;
  const auto solid = ask(Role::solid, std::move(step), load, same_as);
  check_result(*solid, window, field::position | field::velocity);
  accept_motion(state, solid, window.width());

  state.window = window.number;
  state.time = window.t_end;
  state.stable_flow = flow->header.stable_step;
  state.stable_solid = solid->header.stable_step;
  state.impedance = flow->header.impedance;
  state.mass_per_area = solid->header.mass_per_area;
  state.balance.add(flow->header.work, solid->header.work, flow->header.impulse, solid->header.impulse);
  return {flow->header, solid->header};
}

}  // namespace ocublast::coupler
