#pragma once

#include <cstdint>

#include "coupler/coupling_state.hpp"
#include "coupler/handshake.hpp"
#include "coupler/recording.hpp"

namespace ocublast::coupler {

// What the handshake brings into a run.

[[nodiscard]] link::InterfaceMesh mesh_of(const MeshMessage& mesh);
/// Area [m^2] of all triangles of a mesh, where its vertices lie at the start.
[[nodiscard]] double area_of(const link::InterfaceMesh& mesh);
/// Hash of all meshes of the run; of the one mesh where there is one.
[[nodiscard]] std::uint64_t hash_of_meshes(const Handshake& hands);
/// Where the solids' surfaces are and how they move when a run begins, one after the other.
/// `leap_frog`: their accelerations are kept as such, else as a velocity before.
void start_state(CouplingState& state, Handshake& hands, bool leap_frog);
/// Appends the messages of the handshake.
void record_handshake(TrafficWriter& traffic, Handshake& hands);

}  // namespace ocublast::coupler
