#include "solid_solver/coupled_run.hpp"

#include <fmt/format.h>

#include "coupler/base/errors.hpp"
#include "coupler/base/version.hpp"
#include "coupler/link/participant.hpp"
#include "solid_solver/parallel/wet_share.hpp"

namespace ocublast::solid {
namespace {

/// One order as all ranks see it: the root has it from the coupler.
struct Command {
  link::Order::Kind kind = link::Order::Kind::step;
  std::uint32_t iteration = 0;
  Window window;  ///< its load is this rank's share
  bool wants_acceleration = false;
  std::filesystem::path checkpoint;
};

/// A coupled run on one rank or several; only the root's knows the coupler.
class Coupled {
 public:
  Coupled(Session& session, link::Participant* participant)
      : session_(session),
        participant_(participant),
        share_(session.whole_mesh(), session.solid_case().interface, session.run()) {}

  void serve() {
    start();
    while (true) {
      const auto command = await_command();
      if (command.iteration <= 1 && session_.progress().window > 0) session_.write_due(false);
      if (command.kind == link::Order::Kind::finish) break;
      if (command.kind == link::Order::Kind::checkpoint) {
        session_.write_checkpoint_to(command.checkpoint);
        if (participant_ != nullptr) participant_->checkpoint_written();
        continue;
      }
      step(command);
    }
    session_.write_due(true);
    session_.write_summary();
    if (participant_ != nullptr) participant_->goodbye();
  }

 private:
  void start() {
    if (participant_ != nullptr) {
      const auto& surface = share_.surface();
      participant_->take_forces();
      participant_->send_mesh({.name = surface.name,
                               .vertices = surface.vertices,
                               .triangles = surface.triangles,
                               .n_quads = surface.n_quads});
      participant_->ready(session_.run().stable_step(), session_.progress().window,
                          session_.run().state().time);
    }
    if (session_.progress().window == 0) session_.write_due(false);
  }

  Command await_command() {
    const Stopwatch watch(session_.wall().waiting);
    link::Order order;
    const auto& team = session_.run().team();
    if (participant_ != nullptr) order = participant_->next();
    team.await_root();
    struct Header {
      link::Order::Kind kind;
      link::LoadShape shape;
      std::uint32_t steps, iteration;
      bool wants_acceleration, loaded, forced;
      double t_begin, t_end;
    };
    Header header{order.kind,
                  order.load_shape,
                  order.steps,
                  order.iteration,
                  order.wants_acceleration,
                  !order.overpressure.empty(),
                  !order.force.empty(),
                  order.t_begin,
                  order.t_end};
    team.broadcast(header);
    Command command{
        .kind = header.kind,
        .iteration = header.iteration,
        .window = {.t_begin = header.t_begin,
                   .t_end = header.t_end,
                   .steps = header.steps,
                   .shape = header.shape == link::LoadShape::linear ? InterfaceLoad::linear
                                                                    : InterfaceLoad::constant},
        .wants_acceleration = header.wants_acceleration,
        .checkpoint = order.checkpoint};
    if (header.loaded) command.window.overpressure = share_.scatter_pressure(order.overpressure);
    if (header.forced) command.window.force = share_.scatter_forces(order.force);
    return command;
  }

  void step(const Command& command) {
    if (command.iteration == 1) session_.keep();
    if (command.iteration > 1) session_.rewind();
    double seconds = 0.0;
    WindowResult result;
    {
      const Stopwatch watch(seconds);
      result = session_.advance(command.window);
    }
    const auto& window = command.window;
    link::Report report{
        .idle = result.idle,
        .stable_step = session_.run().stable_step(),
        .steps_taken = result.steps,
        .work = result.interface_work,
        .impulse = result.interface_impulse,
        .mass_per_area = session_.run().mass_per_area(window.t_end - window.t_begin),
        .compute_seconds = seconds};
    if (!result.idle) gather_motion(command.wants_acceleration, report);
    if (participant_ != nullptr) participant_->send(report);
    // After the report: the flow computes meanwhile. A window that is iterated is written when it
    // counts.
    if (command.iteration == 0) session_.write_due(false);
  }

  /// Motion of the wet nodes in the order of the interface mesh's vertices.
  void gather_motion(bool with_acceleration, link::Report& report) {
    link::Participant::Room room;
    if (participant_ != nullptr) room = participant_->room();
    const auto& run = session_.run();
    share_.gather_positions(run, room.position);
    share_.gather(run.state().velocity, room.velocity);
    if (with_acceleration) share_.gather(run.state().acceleration, room.acceleration);
    report.position = room.position;
    report.velocity = room.velocity;
    report.acceleration = room.acceleration;
  }

  Session& session_;
  link::Participant* participant_;
  WetShare share_;
};

}  // namespace

void run_coupled(Session& session) {
  if (session.solid_case().interface.empty())
    throw CaseError("solid.interface.faces: a coupled case needs the face set of the wet surface");
  if (!session.root()) {
    Coupled(session, nullptr).serve();
    return;
  }
  link::Participant participant(link::connection_from_environment(
      link::Role::solid, fmt::format("solid_solver {}", version_text), session.case_hash()));
  participant.guard([&] { Coupled(session, &participant).serve(); });
}

}  // namespace ocublast::solid
