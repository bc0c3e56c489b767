#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "coupler/coupling_state.hpp"
#include "coupler/partners.hpp"

namespace ocublast::coupler {

/// A MESH message.
struct MeshMessage {
  link::Header header;
  zmq::message_t payload;
};

/// What is known of a solid once everybody is ready.
struct SolidHands {
  MeshMessage mesh;
  std::string header_to_flow;            ///< MESH as it was sent to the flow
  std::optional<MeshMessage> flow_mesh;  ///< the flow's own for this solid's surface
  std::shared_ptr<Incoming> ready;       ///< READY, with the initial motion if there is one
};
struct Handshake {
  link::Header flow_ready;
  std::vector<SolidHands> solids;
};

/// HELLO -> WELCOME -> MESH -> READY with all participants, in any order, within `limit` [s].
/// Mesh hashes must agree, all must stand where `state` has them.
[[nodiscard]] Handshake shake_hands(Partners& partners, Server& server, double limit,
                                    const CouplingState& state);

}  // namespace ocublast::coupler
