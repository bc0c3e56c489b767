#pragma once

#include <memory>
#include <optional>

#include "coupler/coupling_state.hpp"
#include "coupler/partners.hpp"
#include "coupler/recording.hpp"
#include "coupler/settings.hpp"
#include "coupler/time_window.hpp"

namespace ocublast::coupler {

/// What both sides reported of a window.
struct WindowReports {
  link::Header flow;
  link::Header solid;
};

/// One window of serial explicit coupling, flow first: the motion of the solid is predicted, the
/// flow advances to its end and answers the load there, the solid advances under it and answers its
/// motion. Advances `state`; records all four messages where `traffic` is given.
class WindowExchange {
 public:
  WindowExchange(Partners& partners, Server& server, const Settings& settings,
                 std::size_t n_vertices, TrafficWriter* traffic);

  /// `order` of the predictor may be lower than the settings' (see theta).
  [[nodiscard]] WindowReports advance(CouplingState& state, const TimeWindow& window, int order);

 private:
  [[nodiscard]] zmq::message_t predict(const CouplingState& state, const TimeWindow& window,
                                       int order) const;
  [[nodiscard]] link::Header make_step(const TimeWindow& window, std::uint32_t steps) const;
  [[nodiscard]] std::shared_ptr<Incoming> ask(link::Role role, link::Header step,
                                              zmq::message_t& payload,
                                              std::optional<std::uint64_t> same_as);
  void check_result(const Incoming& result, const TimeWindow& window, std::uint32_t fields) const;
  void accept_motion(CouplingState& state, const std::shared_ptr<Incoming>& result,
                     double width) const;

  Partners& partners_;
  Server& server_;
  const Settings& settings_;
  std::size_t n_vertices_;
  TrafficWriter* traffic_;
  std::uint64_t load_record_ = 0;  ///< number of the record that holds the flow's last load
};

}  // namespace ocublast::coupler
