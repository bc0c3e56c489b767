#include "solid_solver/coupled_run.hpp"

#include <fmt/format.h>

#include "coupler/base/errors.hpp"
#include "coupler/base/version.hpp"
#include "coupler/link/participant.hpp"
#include "solid_solver/mesh/wet_surface.hpp"

namespace ocublast::solid {
namespace {

/// Motion of the wet nodes in the order of the interface mesh's vertices; acceleration where there
/// is room for it.
void read_motion(const SolidRun& run, const link::Participant::Room& motion) {
  const auto& nodes = run.interface_nodes();
  for (std::size_t v = 0; v < nodes.size(); ++v) {
    const auto n = static_cast<std::size_t>(nodes[v]);
    for (std::size_t i = 0; i < 3; ++i) {
      motion.position[3 * v + i] =
          run.mesh().nodes[3 * n + i] + run.state().displacement[4 * n + i];
      motion.velocity[3 * v + i] = run.state().velocity[4 * n + i];
      if (!motion.acceleration.empty())
        motion.acceleration[3 * v + i] = run.state().acceleration[4 * n + i];
    }
  }
}

void send_surface(Session& session, link::Participant& participant) {
  const auto surface = make_wet_surface(session.run().mesh(), session.solid_case().interface);
  OCU_ASSERT(surface.nodes == session.run().interface_nodes());
  participant.send_mesh(
      {.name = surface.name, .vertices = surface.vertices, .triangles = surface.triangles});
}

void step(Session& session, link::Participant& participant, const link::Order& order) {
  if (order.iteration == 1) session.keep();
  if (order.iteration > 1) session.rewind();
  double seconds = 0.0;
  WindowResult result;
  {
    const Stopwatch watch(seconds);
    result = session.advance({.t_begin = order.t_begin,
                              .t_end = order.t_end,
                              .steps = order.steps,
                              .shape = order.load_shape == link::LoadShape::linear
                                           ? InterfaceLoad::linear
                                           : InterfaceLoad::constant,
                              .overpressure = order.overpressure,
                              .force = order.force});
  }
  link::Report report{.idle = result.idle,
                      .stable_step = session.run().stable_step(),
                      .steps_taken = result.steps,
                      .work = result.interface_work,
                      .impulse = result.interface_impulse,
                      .mass_per_area = session.run().mass_per_area(order.t_end - order.t_begin),
                      .compute_seconds = seconds};
  if (!result.idle) {
    const auto room = participant.room();
    read_motion(session.run(), room);
    report.position = room.position;
    report.velocity = room.velocity;
    report.acceleration = room.acceleration;
  }
  participant.send(report);
  // After the report: the flow computes meanwhile. A window that is iterated is written when it counts.
  if (order.iteration == 0) session.write_due(false);
}

void serve(Session& session, link::Participant& participant) {
  send_surface(session, participant);
  participant.take_forces();
  participant.ready(session.run().stable_step(), session.progress().window,
                    session.run().state().time);
  if (session.progress().window == 0) session.write_due(false);
  while (true) {
    link::Order order;
    {
      const Stopwatch watch(session.wall().waiting);
      order = participant.next();
    }
    if (order.iteration <= 1 && session.progress().window > 0) session.write_due(false);
    if (order.kind == link::Order::Kind::finish) break;
    if (order.kind == link::Order::Kind::checkpoint) {
      session.write_checkpoint_to(order.checkpoint);
      participant.checkpoint_written();
      continue;
    }
    step(session, participant, order);
  }
  session.write_due(true);
  session.write_summary();
  participant.goodbye();
}

}  // namespace

void run_coupled(Session& session) {
  if (session.solid_case().setup.interface.empty())
    throw CaseError("solid.interface.faces: a coupled case needs the face set of the wet surface");
  link::Participant participant(link::connection_from_environment(
      link::Role::solid, fmt::format("solid_solver {}", version_text), session.case_hash()));
  try {
    serve(session, participant);
  } catch (const NumericsError& error) {
    participant.abort(error.what(), ExitCode::numerics);
    throw;
  } catch (const std::exception& error) {
    participant.abort(error.what());
    throw;
  }
}

}  // namespace ocublast::solid
