#include "coupler/handshake.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "coupler/base/errors.hpp"
#include "coupler/link/payload.hpp"

namespace ocublast::coupler {

using link::Clock;
using link::Header;
using link::Kind;
using link::to_word;

namespace {

class Progress {
 public:
  Progress(Partners& partners, Server& server, const CouplingState& state)
      : partners_(partners),
        server_(server),
        roster_(server.roster()),
        state_(state),
        mesh_here_(roster_.n_solids()),
        ready_(roster_.size()) {
    result_.solids.resize(roster_.n_solids());
  }

  [[nodiscard]] bool done() const {
    return std::find(ready_.begin(), ready_.end(), false) == ready_.end();
  }
  /// Whom to blame when nothing more comes, and for what.
  [[nodiscard]] std::pair<Party, std::string> missing() const;
  void accept(Incoming message);
  [[nodiscard]] Handshake take() { return std::move(result_); }

 private:
  [[nodiscard]] SolidHands& hands(Party party) { return result_.solids[index_of(party) - 1]; }
  [[nodiscard]] bool meshes_here() const {
    return std::find(mesh_here_.begin(), mesh_here_.end(), false) == mesh_here_.end();
  }
  void accept_mesh(Incoming& message);
  void accept_flow_mesh(Incoming& message);
  void check_mesh(Incoming& message) const;
  void accept_ready(Incoming message);
  void require_mesh_of(const Incoming& message) const;
  void forward_meshes();

  Partners& partners_;
  Server& server_;
  const Roster& roster_;
  const CouplingState& state_;
  Handshake result_;
  std::vector<bool> mesh_here_;
  bool meshes_sent_ = false;
  std::vector<bool> ready_;
};

std::pair<Party, std::string> Progress::missing() const {
  for (std::size_t k = 0; k < roster_.n_solids(); ++k)
    if (!server_.admitted(solid_party(k))) return {solid_party(k), "HELLO"};
  if (!server_.admitted(Party::flow)) return {Party::flow, "HELLO"};
  for (std::size_t k = 0; k < roster_.n_solids(); ++k)
    if (!mesh_here_[k]) return {solid_party(k), "MESH"};
  for (const Party party : roster_.all())
    if (party != Party::flow && !ready_[index_of(party)]) return {party, "READY"};
  return {Party::flow, "READY"};
}

void Progress::accept(Incoming message) {
  const Party party = message.party;
  try {
    link::check_payload(message.header, message.payload());
  } catch (const LinkError& error) {
    throw PartnerFault(party, error.what());
  }
  const bool flow = party == Party::flow;
  const bool first_mesh = !flow && !mesh_here_[index_of(party) - 1];
  const bool ready_due =
      !ready_[index_of(party)] && (flow ? meshes_sent_ : mesh_here_[index_of(party) - 1]);
  if (message.header.kind == Kind::hello) {
    partners_.set_computing(party, !flow);  // the flow waits for the meshes
  } else if (message.header.kind == Kind::mesh && first_mesh) {
    accept_mesh(message);
  } else if (message.header.kind == Kind::mesh && flow && ready_due) {
    accept_flow_mesh(message);
  } else if (message.header.kind == Kind::ready && ready_due) {
    accept_ready(std::move(message));
  } else {
    throw PartnerFault(party, fmt::format("sent {} out of order during the handshake",
                                          to_word(message.header.kind)));
  }
  forward_meshes();
}

/// Triangles may be missing: a solid of scattered nodes, with a flow that has a mesh of its own.
void Progress::check_mesh(Incoming& message) const {
  const Header& header = message.header;
  if (header.n_vertices == 0 || (header.n_triangles == 0 && message.party == Party::flow))
    throw PartnerFault(message.party, fmt::format("MESH with {} vertices and {} triangles",
                                                  header.n_vertices, header.n_triangles));
  const std::uint64_t hash = link::checksum(message.payload());
  if (hash != header.mesh_hash)
    throw PartnerFault(message.party, fmt::format("MESH has hash {:016x}, announced {:016x}", hash,
                                                  header.mesh_hash));
  try {
    static_cast<void>(link::mesh_from_payload(header, message.payload()));
  } catch (const LinkError& error) {
    throw PartnerFault(message.party, error.what());
  }
}

void Progress::accept_mesh(Incoming& message) {
  check_mesh(message);
  hands(message.party).mesh = {message.header, std::move(message.frames.payload)};
  mesh_here_[index_of(message.party) - 1] = true;
}

/// A single solid's stands for whatever the flow calls it; of several it is found by name.
void Progress::accept_flow_mesh(Incoming& message) {
  check_mesh(message);
  std::size_t k = 0;
  while (roster_.several() && k < roster_.n_solids() &&
         roster_.solids()[k] != message.header.mesh_name)
    ++k;
  if (k == roster_.n_solids() || result_.solids[k].flow_mesh)
    throw PartnerFault(
        Party::flow, fmt::format("MESH '{}': {}", message.header.mesh_name,
                                 k == roster_.n_solids() ? "no solid is called so" : "came twice"));
  result_.solids[k].flow_mesh = MeshMessage{message.header, std::move(message.frames.payload)};
}

void Progress::forward_meshes() {
  if (meshes_sent_ || !meshes_here() || !server_.admitted(Party::flow)) return;
  for (std::size_t k = 0; k < roster_.n_solids(); ++k) {
    SolidHands& solid = result_.solids[k];
    Header header = solid.mesh.header;
    header.n_interfaces = static_cast<std::uint32_t>(roster_.n_solids());
    if (roster_.several()) header.mesh_name = roster_.solids()[k];
    zmq::message_t copy;
    copy.copy(solid.mesh.payload);
    solid.header_to_flow = server_.send(Party::flow, header, copy);
  }
  partners_.set_computing(Party::flow, true);
  meshes_sent_ = true;
}

/// READY repeats the hash of the mesh that its sender works on; of several, the hash of their
/// hashes.
void Progress::require_mesh_of(const Incoming& message) const {
  const bool flow = message.party == Party::flow;
  std::vector<std::uint64_t> hashes;
  bool own = false;
  for (std::size_t k = 0; k < roster_.n_solids(); ++k) {
    const SolidHands& solid = result_.solids[k];
    if (!flow && solid_party(k) != message.party) continue;
    own = own || (flow && solid.flow_mesh);
    hashes.push_back(flow && solid.flow_mesh ? solid.flow_mesh->header.mesh_hash
                                             : solid.mesh.header.mesh_hash);
    if (flow && !solid.flow_mesh && solid.mesh.header.n_triangles == 0)
      throw PartnerFault(
          solid_party(k),
          "MESH without triangles: a solid of scattered nodes needs a flow that has a "
          "surface of its own (flow.body.surface)");
  }
  const std::uint64_t expected =
      hashes.size() == 1 ? hashes.front() : link::checksum(std::as_bytes(std::span(hashes)));
  if (message.header.mesh_hash != expected)
    throw PartnerFault(message.party, fmt::format("READY for the mesh {:016x}, {} is {:016x}",
                                                  message.header.mesh_hash,
                                                  own ? "its own" : "the run's mesh", expected));
}

void Progress::accept_ready(Incoming message) {
  const Party party = message.party;
  const Header& header = message.header;
  require_mesh_of(message);
  const std::uint64_t window = party == Party::flow ? state_.flow_window() : state_.window;
  const double time = party == Party::flow ? state_.flow_time() : state_.time;
  if (header.window != window || header.time != time)
    throw PartnerFault(party,
                       fmt::format("stands at window {}, t = {} s; the coupler at window {}, "
                                   "t = {} s",
                                   header.window, header.time, window, time));
  if (header.fields != 0 &&
      (party == Party::flow || header.n_vertices != hands(party).mesh.header.n_vertices))
    throw PartnerFault(party, "READY with a motion that does not fit the mesh");
  ready_[index_of(party)] = true;
  server_.set_reads_memory(party, header.shares_memory);
  partners_.set_computing(party, false);
  if (party == Party::flow)
    result_.flow_ready = header;
  else
    hands(party).ready = std::make_shared<Incoming>(std::move(message));
}

}  // namespace

Handshake shake_hands(Partners& partners, Server& server, double limit,
                      const CouplingState& state) {
  Progress progress(partners, server, state);
  const auto deadline = Clock::now() + link::seconds(limit);
  for (const Party party : server.roster().all()) partners.set_computing(party, true);
  while (!progress.done()) {
    const auto [party, what] = progress.missing();
    const double left = std::chrono::duration<double>(deadline - Clock::now()).count();
    progress.accept(partners.await(party, what, std::max(left, 0.0)));
    if (partners.stop_requested()) throw LinkError("stopped before the first window, as asked");
  }
  return progress.take();
}

}  // namespace ocublast::coupler
