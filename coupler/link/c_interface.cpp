#include <cstdlib>
#include <optional>
#include <string>

#include "coupler/link/ocublast_link.h"
#include "coupler/link/participant.hpp"

using ocublast::ExitCode;
namespace link_ = ocublast::link;

struct ocu_participant {
  link_::Participant participant;
  link_::Role role;
  std::size_t n_vertices = 0;
  std::vector<link_::InterfaceMesh> meshes;
  ocu_order order{};
  std::string checkpoint;
  std::string error;
};

namespace {

/// Of ocu_connect, which has no participant to keep it in.
std::string& connect_error() {
  thread_local std::string text;
  return text;
}

/// Does the work of one call; what it throws becomes the participant's error, and the coupler hears
/// it.
template <class Work>
int attempt(ocu_participant* p, Work work) noexcept {
  if (p == nullptr) return 0;
  try {
    work();
    return 1;
  } catch (const std::exception& error) {
    p->error = error.what();
    p->participant.abort(p->error);
    return 0;
  }
}

std::span<const double> values(const double* at, std::size_t n) {
  return at == nullptr ? std::span<const double>() : std::span<const double>(at, n);
}

void give_mesh(const link_::InterfaceMesh& mesh, const char** name, size_t* n_vertices,
               const double** vertices, size_t* n_triangles, const int32_t** triangles) {
  *name = mesh.name.c_str();
  *n_vertices = mesh.n_vertices();
  *vertices = mesh.vertices.data();
  *n_triangles = mesh.triangles.size() / 3;
  *triangles = mesh.triangles.data();
}

/// [n_meshes, 4] of a flow with several solids.
std::vector<link_::InterfaceBalance> balances(const double* at, std::size_t n_meshes) {
  std::vector<link_::InterfaceBalance> all;
  for (std::size_t k = 0; at != nullptr && n_meshes > 1 && k < n_meshes; ++k, at += 4)
    all.push_back({.work = at[0], .impulse = {at[1], at[2], at[3]}});
  return all;
}

std::uint64_t hash_from_environment() {
  const char* text = std::getenv("OCUBLAST_CASE_HASH");
  return text == nullptr ? 0 : std::strtoull(text, nullptr, 16);
}

}  // namespace

extern "C" {

ocu_participant* ocu_connect(int role, const char* program, uint64_t case_hash) {
  try {
    const auto side = role == OCU_FLOW ? link_::Role::flow : link_::Role::solid;
    const auto connection = link_::connection_from_environment(
        side, program, case_hash != 0 ? case_hash : hash_from_environment());
    return new ocu_participant{.participant = link_::Participant(connection), .role = side};
  } catch (const std::exception& error) {
    connect_error() = error.what();
    return nullptr;
  }
}

int ocu_send_mesh(ocu_participant* p, const char* name, size_t n_vertices, const double* vertices,
                  size_t n_triangles, const int32_t* triangles) {
  return attempt(p, [&] {
    p->n_vertices = n_vertices;
    p->participant.send_mesh({.name = name,
                              .vertices = {vertices, vertices + 3 * n_vertices},
                              .triangles = {triangles, triangles + 3 * n_triangles}});
  });
}

int ocu_mesh(ocu_participant* p, size_t* n_vertices, const double** vertices, size_t* n_triangles,
             const int32_t** triangles) {
  return attempt(p, [&] {
    p->meshes = {p->participant.receive_mesh()};
    p->n_vertices = p->meshes.front().n_vertices();
    const char* name = nullptr;
    give_mesh(p->meshes.front(), &name, n_vertices, vertices, n_triangles, triangles);
  });
}

int ocu_receive_meshes(ocu_participant* p, size_t* n_meshes) {
  return attempt(p, [&] {
    p->meshes = p->participant.receive_meshes();
    p->n_vertices = 0;
    for (const auto& mesh : p->meshes) p->n_vertices += mesh.n_vertices();
    *n_meshes = p->meshes.size();
  });
}

int ocu_mesh_of(ocu_participant* p, size_t k, const char** name, size_t* n_vertices,
                const double** vertices, size_t* n_triangles, const int32_t** triangles) {
  return attempt(
      p, [&] { give_mesh(p->meshes.at(k), name, n_vertices, vertices, n_triangles, triangles); });
}

int ocu_take_forces(ocu_participant* p) {
  return attempt(p, [&] { p->participant.take_forces(); });
}

int ocu_ready(ocu_participant* p, double stable_step, uint64_t window, double time,
              const double* velocity) {
  return attempt(p, [&] {
    p->participant.ready(
        stable_step, window, time,
        {.position = {}, .velocity = values(velocity, 3 * p->n_vertices), .acceleration = {}});
  });
}

const ocu_order* ocu_next(ocu_participant* p) {
  const int done = attempt(p, [&] {
    const auto order = p->participant.next();
    p->checkpoint = order.checkpoint.string();
    p->order = {.kind = order.kind == link_::Order::Kind::step         ? OCU_STEP
                        : order.kind == link_::Order::Kind::checkpoint ? OCU_CHECKPOINT
                                                                       : OCU_FINISH,
                .window = order.window,
                .t_begin = order.t_begin,
                .t_end = order.t_end,
                .steps = order.steps,
                .load_linear = order.load_shape == link_::LoadShape::linear,
                .wall_cubic = order.wall_path == link_::WallPath::cubic,
                .iteration = order.iteration,
                .wants_acceleration = order.wants_acceleration,
                .idle = order.idle,
                .position = order.position.empty() ? nullptr : order.position.data(),
                .velocity = order.velocity.empty() ? nullptr : order.velocity.data(),
                .overpressure = order.overpressure.empty() ? nullptr : order.overpressure.data(),
                .checkpoint = p->checkpoint.c_str(),
                .force = order.force.empty() ? nullptr : order.force.data()};
  });
  return done != 0 ? &p->order : nullptr;
}

int ocu_send(ocu_participant* p, const ocu_report* r) {
  return attempt(p, [&] {
    const std::size_t n = 3 * p->n_vertices;
    p->participant.send({.idle = r->idle != 0,
                         .position = values(r->position, n),
                         .velocity = values(r->velocity, n),
                         .acceleration = values(r->acceleration, n),
                         .overpressure = values(r->overpressure, p->n_vertices),
                         .force = {},
                         .stable_step = r->stable_step,
                         .steps_taken = r->steps_taken,
                         .work = r->work,
                         .interfaces = balances(r->balance, p->meshes.size()),
                         .impulse = {r->impulse[0], r->impulse[1], r->impulse[2]},
                         .impedance = r->impedance,
                         .mass_per_area = r->mass_per_area,
                         .compute_seconds = r->compute_seconds,
                         .status = {}});
  });
}

int ocu_checkpoint_written(ocu_participant* p) {
  return attempt(p, [&] { p->participant.checkpoint_written(); });
}

int ocu_goodbye(ocu_participant* p) {
  return attempt(p, [&] { p->participant.goodbye(); });
}

void ocu_abort(ocu_participant* p, const char* reason, int exit_code) {
  if (p != nullptr) p->participant.abort(reason, static_cast<ExitCode>(exit_code));
}

void ocu_close(ocu_participant* p) {
  delete p;
}

const char* ocu_error(const ocu_participant* p) {
  return p == nullptr ? connect_error().c_str() : p->error.c_str();
}

}  // extern "C"
