#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "coupler/coupling_state.hpp"
#include "coupler/link/payload.hpp"
#include "coupler/partners.hpp"
#include "coupler/recording.hpp"
#include "coupler/settings.hpp"
#include "coupler/time_window.hpp"

namespace ocublast::coupler {

/// What one side answered: the flow, or all solids as one, their vertices one after the other.
struct Answer {
  link::Header totals;  ///< of several solids: sums of work and impulse, smallest steps
  std::shared_ptr<const void> owner;  ///< keeps the values alive
  link::PayloadView view;
  std::shared_ptr<Incoming> message;  ///< where one participant answered: can be passed on as it is
  std::optional<std::uint64_t> record;  ///< what the recording calls it
  std::vector<link::Header> each;       ///< of several solids: their own
  bool checked = true;  ///< that its values are finite; else see Exchange::check_finite

  [[nodiscard]] const link::Header& header() const { return totals; }
  [[nodiscard]] const link::PayloadView& values() const { return view; }
};

/// The surface that the flow and one solid share: their meshes, and the way between them where they
/// differ.
struct Interface {
  std::size_t n_flow = 0;  ///< vertices
  std::size_t n_solid = 0;
  bool takes_force = false;                 ///< the solid, instead of overpressure
  std::unique_ptr<const InterfaceMap> map;  ///< null: both have the same mesh
  std::size_t first_flow = 0;               ///< its first vertex among those of all interfaces
  std::size_t first_solid = 0;
};

/// Sends step orders to all and gathers their answers; checks and records both, maps between their
/// meshes, and cuts load and motion into the parts of several solids. Payloads go through shared
/// memory where the participant can read it.
class Exchange {
 public:
  /// `sends_force`: the flow answers forces at the vertices instead of overpressure.
  Exchange(Partners& partners, Server& server, const Settings& settings,
           std::vector<Interface> interfaces, bool sends_force, TrafficWriter* traffic);

  /// What is asked: a window, as iteration 1, 2, ... (0: explicit), with accelerations.
  struct Ask {
    TimeWindow window;
    std::uint32_t iteration = 0;
    bool wants_acceleration = false;
    std::uint64_t zero_before = 0;  ///< CouplingState::zero_loads
  };

  /// From now on the finiteness of values that came through shared memory is the caller's to see
  /// to, before they count: while it waits anyway, or where it reads them anyway.
  void check_later() { checks_later_ = true; }
  /// Throws PartnerFault that names the first value of an answer that is not finite.
  void check_finite(const Answer& answer) const;

  /// Numbers that make a load: overpressure Pa, or force [n, 3] N, at the flow's vertices.
  [[nodiscard]] std::size_t n_loads() const { return components_ * n_flow_; }
  [[nodiscard]] static std::span<const double> load_of(const Answer& flow) {
    return flow.values().force.empty() ? flow.values().overpressure : flow.values().force;
  }
  /// Room for position and velocity [6 n] of the solids' vertices for the next order to the flow;
  /// sent by post_motion.
  [[nodiscard]] std::span<double> motion_room();
  void post_motion(const Ask& ask);
  /// Whether what was in the room stays there after it has been sent, until the room has been asked
  /// for twice.
  [[nodiscard]] bool keeps_motion() const { return motion_memory_ && !mapped_; }
  /// Position [n, 3] m of the solids' vertices that the flow was last told; empty where nothing is
  /// mapped. A resumed run puts it back.
  [[nodiscard]] std::span<const double> wall() const { return wall_; }
  void set_wall(std::span<const double> position);
  /// The walls are where they were, at rest.
  void post_rest(const Ask& ask);
  /// The load of the flow to the solids; to a single one with the same mesh it goes as it came.
  void post_load(const Ask& ask, const Answer& flow);
  /// Another load [n_loads].
  void post_load(const Ask& ask, std::span<const double> load);
  /// The load is exactly zero at both ends of the window, for all.
  void post_no_load(const Ask& ask);
  /// CouplingState::zero_loads after the loads posted last.
  [[nodiscard]] std::uint64_t zero_loads() const { return zero_loads_; }
  /// The answers of those that were asked. A solid that rests stands where `state` has it.
  [[nodiscard]] Answer collect_flow();
  [[nodiscard]] Answer collect_solids(const CouplingState& state);

 private:
  [[nodiscard]] link::Header make_step(Party party, const Ask& ask) const;
  void post(Party party, link::Header step, zmq::message_t& frame,
            std::span<const std::byte> memory, std::optional<std::uint64_t> same_as);
  void post_part(std::size_t k, const Ask& ask, std::span<const double> load, const Answer* flow);
  void post_parts(const Ask& ask, std::span<const double> load, const Answer* flow);
  void spare_memory(Party party);
  [[nodiscard]] std::span<double> motion_to_send();
  void map_motion();
  void check(Incoming& result) const;
  [[nodiscard]] bool check_values(Incoming& result) const;
  void accept(Incoming message);
  [[nodiscard]] Answer collect(Party party);
  [[nodiscard]] Answer combine(std::vector<Answer> answers, const CouplingState& state) const;

  Partners& partners_;
  Server& server_;
  const Settings& settings_;
  std::vector<Interface> interfaces_;
  std::size_t n_flow_ = 0, n_solid_ = 0;  ///< vertices of all interfaces
  std::size_t components_ = 1;            ///< of a load at a vertex
  bool mapped_ = false;
  std::vector<double> motion_;     ///< [6 n_solid], mapped meshes: what is to be sent
  std::vector<double> wall_;       ///< [3 n_solid] m, mapped meshes: what was sent last,
  std::vector<double> wall_flow_;  ///< [3 n_flow] m, and what the flow made of it
  std::uint64_t zero_loads_ = 0;
  TrafficWriter* traffic_;
  link::SharedMemory motion_memory_;                ///< orders to the flow
  std::uint64_t motions_ = 0;                       ///< sent so; the slot of the next one
  zmq::message_t motion_frame_;                     ///< where memory is not shared
  std::vector<std::optional<link::Header>> asked_;  ///< by party
  std::vector<std::optional<Answer>> answers_;      ///< here, not collected yet
  /// Numbers of the last records whose payloads lie in shared memory, by who wrote it.
  std::vector<std::deque<std::uint64_t>> in_memory_;
  std::deque<std::uint64_t> motions_in_memory_;
  std::vector<std::size_t> unwritten_;  ///< by party: so many of those the recording may owe
  bool checks_later_ = false;
};

}  // namespace ocublast::coupler
