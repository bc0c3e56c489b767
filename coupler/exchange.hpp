#pragma once

#include <array>
#include <deque>
#include <memory>
#include <optional>

#include "coupler/coupling_state.hpp"
#include "coupler/link/payload.hpp"
#include "coupler/partners.hpp"
#include "coupler/recording.hpp"
#include "coupler/settings.hpp"
#include "coupler/time_window.hpp"

namespace ocublast::coupler {

/// A result of a participant with what the recording calls it.
struct Answer {
  std::shared_ptr<Incoming> message;
  std::optional<std::uint64_t> record;

  [[nodiscard]] const link::Header& header() const { return message->header; }
  [[nodiscard]] link::PayloadView values() const;
};

/// The surface that flow and solid share: their meshes, and the way between them where they differ.
struct Interface {
  std::size_t n_flow = 0;                    ///< vertices
  std::size_t n_solid = 0;
  bool takes_force = false;                  ///< the solid, instead of overpressure, where there is a map
  std::unique_ptr<const InterfaceMap> map;   ///< null: both have the same mesh
};

/// Sends step orders to both sides and gathers their answers; checks and records both, and maps
/// between their meshes. Payloads go through shared memory where the participant can read it.
class Exchange {
 public:
  Exchange(Partners& partners, Server& server, const Settings& settings, Interface interface,
           TrafficWriter* traffic);

  /// What is asked: a window, as iteration 1, 2, ... (0: explicit), with accelerations.
  struct Ask {
    TimeWindow window;
    std::uint32_t iteration = 0;
    bool wants_acceleration = false;
  };

  /// Vertices that loads are given at: the flow's.
  [[nodiscard]] std::size_t n_loads() const { return interface_.n_flow; }
  /// Room for position and velocity [6 n] of the solid's vertices for the next order to the flow;
  /// sent by post_motion.
  [[nodiscard]] std::span<double> motion_room();
  void post_motion(const Ask& ask);
  /// Position [n, 3] m of the solid's vertices that the flow was last told; empty where nothing is
  /// mapped. A resumed run puts it back.
  [[nodiscard]] std::span<const double> wall() const;
  void set_wall(std::span<const double> position);
  /// The wall is where it was, at rest.
  void post_rest(const Ask& ask);
  /// Forwards the load of the flow to the solid as it came.
  void post_load(const Ask& ask, const Answer& flow);
  /// Another load [n], Pa.
  void post_load(const Ask& ask, std::span<const double> overpressure);
  /// The load is exactly zero at both ends of the window.
  void post_no_load(const Ask& ask);
  /// The answer of a side that was asked.
  [[nodiscard]] Answer collect(link::Role role);

 private:
  static constexpr std::size_t n_sides = 2;
  [[nodiscard]] static std::size_t index(link::Role role) { return role == link::Role::flow ? 0 : 1; }
  [[nodiscard]] link::Header make_step(link::Role role, const Ask& ask) const;
  void post(link::Role role, link::Header step, zmq::message_t& frame,
            std::span<const std::byte> memory, std::optional<std::uint64_t> same_as);
  void spare_memory(link::Role role);
  [[nodiscard]] std::span<double> motion_to_send();
  void map_motion();
  void post_mapped_load(link::Header step, std::span<const double> overpressure);
  void check(Incoming& result) const;
  void accept(Incoming message);

  Partners& partners_;
  Server& server_;
  const Settings& settings_;
  Interface interface_;
  std::vector<double> motion_;              ///< [6 n_solid], mapped meshes: what is to be sent
  std::vector<double> wall_;                ///< [3 n_solid] m, mapped meshes: what was sent last,
  std::vector<double> wall_flow_;           ///< [3 n_flow] m, and what the flow made of it
  TrafficWriter* traffic_;
  link::SharedMemory motion_memory_;        ///< orders to the flow
  std::uint64_t motions_ = 0;               ///< sent so; the slot of the next one
  zmq::message_t motion_frame_;             ///< where memory is not shared
  std::array<std::optional<link::Header>, n_sides> asked_;
  std::array<std::optional<Answer>, n_sides> answers_;   ///< here, not collected yet
  /// Numbers of the last records whose payloads lie in shared memory, by who wrote it.
  std::array<std::deque<std::uint64_t>, n_sides> in_memory_;
  std::deque<std::uint64_t> motions_in_memory_;
};

}  // namespace ocublast::coupler
