#pragma once

#include <array>
#include <functional>
#include <optional>

#include "coupler/coupling_state.hpp"
#include "coupler/partners.hpp"

namespace ocublast::coupler {

/// What is known once everybody is ready.
struct Handshake {
  link::Header mesh;                       ///< the solid's MESH
  zmq::message_t mesh_payload;
  std::optional<link::Header> flow_mesh;   ///< MESH of the flow, where it has one of its own
  zmq::message_t flow_mesh_payload;
  std::array<link::Header, 2> ready;       ///< READY of flow and solid
  std::shared_ptr<Incoming> solid_ready;   ///< with the initial motion, if the solid sent one
  std::string flow_mesh_header;            ///< MESH as it was sent to the flow
};

/// HELLO -> WELCOME -> MESH -> READY with both participants, in any order, within `limit` [s].
/// Mesh hashes must agree, both must stand where `state` has them.
[[nodiscard]] Handshake shake_hands(Partners& partners, Server& server, double limit,
                                    const CouplingState& state);

}  // namespace ocublast::coupler
