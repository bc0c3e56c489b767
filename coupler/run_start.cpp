#include "coupler/run_start.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <limits>
#include <utility>
#include <vector>

#include "coupler/link/payload.hpp"

namespace ocublast::coupler {

using link::Header;

namespace {

Eigen::Map<const Eigen::Vector3d> corner(const link::InterfaceMesh& mesh, std::size_t i) {
  return Eigen::Map<const Eigen::Vector3d>(
      &mesh.vertices[3 * static_cast<std::size_t>(mesh.triangles[i])]);
}

}  // namespace

link::InterfaceMesh mesh_of(const MeshMessage& mesh) {
  return link::mesh_from_payload(
      mesh.header, {static_cast<const std::byte*>(mesh.payload.data()), mesh.payload.size()});
}

double area_of(const link::InterfaceMesh& mesh) {
  double area = 0.0;
  for (std::size_t t = 0; t + 2 < mesh.triangles.size(); t += 3) {
    std::array<Eigen::Map<const Eigen::Vector3d>, 3> x{corner(mesh, t), corner(mesh, t + 1),
                                                       corner(mesh, t + 2)};
    area += 0.5 * (x[1] - x[0]).cross(x[2] - x[0]).norm();
  }
  return area;
}

void start_state(CouplingState& state, Handshake& hands, bool leap_frog) {
  state.stable_flow = hands.flow_ready.stable_step;
  state.stable_solid = std::numeric_limits<double>::infinity();
  std::vector<double> position, velocity, acceleration;
  bool accelerates = false;
  state.solid_at_rest = true;
  for (SolidHands& solid : hands.solids) {
    const Header& ready = solid.ready->header;
    const std::size_t n = 3 * solid.mesh.header.n_vertices;
    state.stable_solid = std::min(state.stable_solid, ready.stable_step);
    state.solid_at_rest = state.solid_at_rest && ready.fields == 0;
    const auto view = link::view_payload(ready, solid.ready->payload());
    const auto vertices = mesh_of(solid.mesh).vertices;
    const auto at = view.position.empty() ? std::span<const double>(vertices) : view.position;
    position.insert(position.end(), at.begin(), at.end());
    velocity.insert(velocity.end(), view.velocity.begin(), view.velocity.end());
    velocity.resize(position.size(), 0.0);
    acceleration.insert(acceleration.end(), view.acceleration.begin(), view.acceleration.end());
    acceleration.resize(acceleration.size() + n - view.acceleration.size(), 0.0);
    accelerates = accelerates || !view.acceleration.empty();
  }
  state.wall_current = state.solid_at_rest;
  state.position = SharedValues::from(std::move(position));
  state.velocity = SharedValues::from(std::move(velocity));
  if (!accelerates) return;
  if (leap_frog) {
    state.acceleration = SharedValues::from(std::move(acceleration));
    return;
  }
  // A velocity one second ago that makes the predictor's backward difference this acceleration.
  std::vector<double> before(state.velocity.values.begin(), state.velocity.values.end());
  for (std::size_t i = 0; i < before.size(); ++i) before[i] -= acceleration[i];
  state.velocity_before = SharedValues::from(std::move(before));
  state.width_before = 1.0;
}

std::uint64_t hash_of_meshes(const Handshake& hands) {
  std::vector<std::uint64_t> hashes;
  for (const SolidHands& solid : hands.solids) {
    hashes.push_back(solid.mesh.header.mesh_hash);
    if (solid.flow_mesh && solid.flow_mesh->header.mesh_hash != hashes.back())
      hashes.push_back(solid.flow_mesh->header.mesh_hash);
  }
  return hashes.size() == 1 ? hashes.front() : link::checksum(std::as_bytes(std::span(hashes)));
}

void record_handshake(TrafficWriter& traffic, Handshake& hands) {
  zmq::message_t nothing;
  for (std::size_t k = 0; k < hands.solids.size(); ++k) {
    SolidHands& solid = hands.solids[k];
    const auto number =
        traffic.append({solid_party(k), true}, link::encode(solid.mesh.header), solid.mesh.payload);
    traffic.append({Party::flow, false}, solid.header_to_flow, solid.mesh.payload, number);
  }
  for (SolidHands& solid : hands.solids)
    if (solid.flow_mesh)
      traffic.append({Party::flow, true}, link::encode(solid.flow_mesh->header),
                     solid.flow_mesh->payload);
  traffic.append({Party::flow, true}, link::encode(hands.flow_ready), nothing);
  for (std::size_t k = 0; k < hands.solids.size(); ++k) {
    Incoming& ready = *hands.solids[k].ready;
    traffic.append({solid_party(k), true}, ready.frames.header_view(), ready.frames.payload);
  }
}

}  // namespace ocublast::coupler
