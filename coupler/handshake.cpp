#include "coupler/handshake.hpp"

#include <fmt/format.h>

#include "coupler/base/errors.hpp"
#include "coupler/link/payload.hpp"

namespace ocublast::coupler {

using link::Clock;
using link::Header;
using link::Kind;
using link::Role;
using link::to_word;

namespace {

class Progress {
 public:
  Progress(Partners& partners, Server& server, const CouplingState& state)
      : partners_(partners), server_(server), state_(state) {}

  [[nodiscard]] bool done() const { return ready_[0] && ready_[1]; }
  /// Whom to blame when nothing more comes, and for what.
  [[nodiscard]] std::pair<Role, std::string> missing() const {
    if (!server_.admitted(Role::solid)) return {Role::solid, "HELLO"};
    if (!server_.admitted(Role::flow)) return {Role::flow, "HELLO"};
    if (!mesh_here_) return {Role::solid, "MESH"};
    return ready_[1] ? std::pair{Role::flow, "READY"} : std::pair{Role::solid, "READY"};
  }
  void accept(Incoming message);
  [[nodiscard]] Handshake take() { return std::move(result_); }

 private:
  void accept_mesh(Incoming& message);
  static void check_mesh(Incoming& message);
  void accept_ready(Incoming message);
  void forward_mesh();

  Partners& partners_;
  Server& server_;
  const CouplingState& state_;
  Handshake result_;
  bool mesh_here_ = false;
  bool mesh_sent_ = false;
  std::array<bool, 2> ready_{};
};

void Progress::accept(Incoming message) {
  const Role role = message.role;
  try {
    link::check_payload(message.header, message.payload());
  } catch (const LinkError& error) {
    throw PartnerFault(role, error.what());
  }
  const bool first_mesh = role == Role::solid && !mesh_here_;
  const bool ready_due = !ready_[role == Role::flow ? 0 : 1] &&
                         (role == Role::flow ? mesh_sent_ : mesh_here_);
  if (message.header.kind == Kind::hello) {
    partners_.set_computing(role, role == Role::solid);  // the flow waits for the mesh
  } else if (message.header.kind == Kind::mesh && first_mesh) {
    accept_mesh(message);
  } else if (message.header.kind == Kind::mesh && role == Role::flow && mesh_sent_ && !ready_[0] &&
             !result_.flow_mesh) {
    check_mesh(message);
    result_.flow_mesh = message.header;
    result_.flow_mesh_payload = std::move(message.frames.payload);
  } else if (message.header.kind == Kind::ready && ready_due) {
    accept_ready(std::move(message));
  } else {
    throw PartnerFault(role, fmt::format("sent {} out of order during the handshake",
                                         to_word(message.header.kind)));
  }
  forward_mesh();
}

/// Triangles may be missing: a solid of scattered nodes, with a flow that has a mesh of its own.
void Progress::check_mesh(Incoming& message) {
  const Header& header = message.header;
  if (header.n_vertices == 0 || (header.n_triangles == 0 && message.role == Role::flow))
    throw PartnerFault(message.role, fmt::format("MESH with {} vertices and {} triangles", header.n_vertices,
                                                 header.n_triangles));
  const std::uint64_t hash = link::checksum(message.payload());
  if (hash != header.mesh_hash)
    throw PartnerFault(message.role, fmt::format("MESH has hash {:016x}, announced {:016x}", hash, header.mesh_hash));
  try {
    static_cast<void>(link::mesh_from_payload(header, message.payload()));
  } catch (const LinkError& error) {
    throw PartnerFault(message.role, error.what());
  }
}

void Progress::accept_mesh(Incoming& message) {
  check_mesh(message);
  result_.mesh = message.header;
  result_.mesh_payload = std::move(message.frames.payload);
  mesh_here_ = true;
}

void Progress::forward_mesh() {
  if (mesh_sent_ || !mesh_here_ || !server_.admitted(Role::flow)) return;
  zmq::message_t copy;
  copy.copy(result_.mesh_payload);
  result_.flow_mesh_header = server_.send(Role::flow, result_.mesh, copy);
  partners_.set_computing(Role::flow, true);
  mesh_sent_ = true;
}

void Progress::accept_ready(Incoming message) {
  const Role role = message.role;
  const Header& header = message.header;
  const bool own = role == Role::flow && result_.flow_mesh;
  const std::uint64_t expected = own ? result_.flow_mesh->mesh_hash : result_.mesh.mesh_hash;
  if (header.mesh_hash != expected)
    throw PartnerFault(role, fmt::format("READY for the mesh {:016x}, {} is {:016x}", header.mesh_hash,
                                         own ? "its own" : "the run's mesh", expected));
  if (role == Role::flow && !own && result_.mesh.n_triangles == 0)
    throw PartnerFault(Role::solid, "MESH without triangles: a solid of scattered nodes needs a flow that has "
                                    "a surface of its own (flow.body.surface)");
  const std::uint64_t window = role == Role::flow ? state_.flow_window() : state_.window;
  const double time = role == Role::flow ? state_.flow_time() : state_.time;
  if (header.window != window || header.time != time)
    throw PartnerFault(role, fmt::format("stands at window {}, t = {} s; the coupler at window {}, "
                                         "t = {} s", header.window, header.time, window, time));
  if (header.fields != 0 && (role == Role::flow || header.n_vertices != result_.mesh.n_vertices))
    throw PartnerFault(role, "READY with a motion that does not fit the mesh");
  const std::size_t i = role == Role::flow ? 0 : 1;
  result_.ready[i] = header;
  ready_[i] = true;
  server_.set_reads_memory(role, header.shares_memory);
  partners_.set_computing(role, false);
  if (role == Role::solid) result_.solid_ready = std::make_shared<Incoming>(std::move(message));
}

}  // namespace

Handshake shake_hands(Partners& partners, Server& server, double limit,
                      const CouplingState& state) {
  Progress progress(partners, server, state);
  const auto deadline = Clock::now() + link::seconds(limit);
  partners.set_computing(Role::flow, true);
  partners.set_computing(Role::solid, true);
  while (!progress.done()) {
    const auto [role, what] = progress.missing();
    const double left = std::chrono::duration<double>(deadline - Clock::now()).count();
    progress.accept(partners.await(role, what, std::max(left, 0.0)));
    if (partners.stop_requested()) throw LinkError("stopped before the first window, as asked");
  }
  return progress.take();
}

}  // namespace ocublast::coupler
