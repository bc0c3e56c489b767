#include <fmt/format.h>
#include <malloc.h>
#include <omp.h>

#include <algorithm>
#include <cstdio>
#include <optional>
#include <thread>

#include "coupler/base/errors.hpp"
#include "coupler/base/log.hpp"
#include "coupler/base/ranks.hpp"
#include "coupler/base/version.hpp"
#include "flow_solver/io/body_surface.hpp"
#include "flow_solver/io/make_bodies.hpp"
#include "flow_solver/io/precision_case.hpp"
#include "flow_solver/io/run.hpp"

namespace ocublast::flow::inline OCU_PRECISION {
namespace {

void list_keys() {
  auto reader = CaseReader::make_listing();
  static_cast<void>(read_flow_case(reader));
  std::fputs(reader.key_list().c_str(), stdout);
}

/// Says in a few lines what would run.
std::string describe(const FlowCase& flow_case) {
  const Grid grid = make_grid(flow_case.axes, flow_case.geometry);
  return fmt::format(
      "flow: {} x {} x {} = {} nodes, {} bodies, {} bursts, {} probes, to t = {} s\n",
      grid.axis[0].n, grid.axis[1].n, grid.axis[2].n, grid.n_cells(), flow_case.bodies.size(),
      flow_case.bursts.size(), flow_case.probes.size(), flow_case.common.end_time);
}

/// The root writes the log; the other ranks' faults reach standard error when they end.
std::shared_ptr<spdlog::logger> rank_logger(const Ranks& ranks, const CommandLine& line) {
  if (ranks.root())
    return make_logger("flow_solver",
                       line.out.empty() ? line.out : line.out / "log" / "flow_solver.log");
  return std::make_shared<spdlog::logger>("flow_solver");
}

/// Threads of a rank where the command line says nothing: the machine's share.
int default_threads(const Ranks& ranks) {
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()) / ranks.on_this_host());
}

/// The root's meshes on every rank.
std::vector<link::InterfaceMesh> share_meshes(const Ranks& ranks,
                                              std::vector<link::InterfaceMesh> meshes) {
  if (ranks.alone()) return meshes;
  const auto share = [&](auto& values) {
    std::size_t count = values.size();
    ranks.broadcast(std::span<std::size_t>(&count, 1));
    values.resize(count);
    ranks.broadcast(std::span(values));
  };
  std::size_t n = meshes.size();
  ranks.broadcast(std::span<std::size_t>(&n, 1));
  meshes.resize(n);
  for (link::InterfaceMesh& mesh : meshes) {
    mesh.name = ranks.broadcast(mesh.name);
    share(mesh.vertices);
    share(mesh.triangles);
    ranks.broadcast(std::span<std::size_t>(&mesh.n_quads, 1));
    ranks.broadcast(std::span<bool>(&mesh.takes_force, 1));
  }
  return meshes;
}

/// Whether the run reached its end.
bool run(const Ranks& ranks, const CommandLine& line) {
  if (line.list_keys) {
    if (ranks.root()) list_keys();
    return true;
  }
  CaseReader reader(line.source);
  FlowCase flow_case = read_flow_case(reader);
  const bool coupled = reader.has("coupling");
  if (coupled && !flow_case.coupled)
    reader.section("flow").fault("body",
                                 "a case with [coupling] needs a body with motion = \"coupled\"");
  if (!coupled && flow_case.coupled)
    reader.section("flow").fault("body", "a coupled body needs a [coupling] table");
  reader.finish();
  require_own_precision(flow_case.precision);
  if (line.effective_only) {
    if (ranks.root()) std::fputs(reader.effective().c_str(), stdout);
    return true;
  }
  if (line.check_only) {
    static_cast<void>(make_bodies(flow_case, {}));
    if (ranks.root()) std::fputs(describe(flow_case).c_str(), stdout);
    return true;
  }
  flow_case.options.threads = line.threads > 0 ? line.threads : default_threads(ranks);
  omp_set_num_threads(flow_case.options.threads);
  auto log = rank_logger(ranks, line);
  if (!coupled) return FlowRun(ranks, std::move(flow_case), line, log, {}).run_alone();
  std::optional<link::Participant> coupler;  // of the root
  if (ranks.root()) {
    coupler.emplace(link::connection_from_environment(
        link::Role::flow, fmt::format("flow_solver {}", version_text), reader.hash()));
  }
  const auto serve = [&] {
    auto surfaces = share_meshes(
        ranks, coupler ? coupler->receive_meshes() : std::vector<link::InterfaceMesh>());
    bool forces_taken = true;
    for (const auto& surface : surfaces) forces_taken = forces_taken && surface.takes_force;
    for (const BodyCase& body : flow_case.bodies) {
      if (body.motion != BodyMotion::coupled || body.surface.empty()) continue;
      const BodySurface own = read_body_surface(body.surface);
      const auto at = std::find(flow_case.solids.begin(), flow_case.solids.end(), body.solid);
      auto& surface = surfaces.at(static_cast<std::size_t>(at - flow_case.solids.begin()));
      surface.vertices = own.vertices;
      surface.triangles = own.triangles;
      surface.n_quads = own.n_quads;
      if (coupler) coupler->send_mesh(surface);
      forces_taken = false;
    }
    FlowRun flow_run(ranks, std::move(flow_case), line, log, surfaces);
    flow_run.run_coupled(coupler ? &*coupler : nullptr, forces_taken);
  };
  if (coupler)
    coupler->guard(serve);
  else
    serve();
  return true;
}

}  // namespace

int run_flow_solver(int argc, char** argv) {
  const std::string program = "flow_solver";
  become_asked_precision(argc, argv);
  mallopt(M_MMAP_THRESHOLD, 256 << 20);  // large messages and frames come from re-used memory
  mallopt(M_TRIM_THRESHOLD, 1 << 30);
  return run_on_ranks(program, [&](const Ranks& ranks) {
    const auto line = parse_command_line(
        argc, argv, program, "Compressible flow on a Cartesian grid with immersed bodies.");
    try {
      const bool finished = !line || run(ranks, *line);
      return static_cast<int>(finished ? ExitCode::done : ExitCode::other);
    } catch (const NumericsError&) {
      // A failed step fails on all ranks with the same text (Flow::advance): the root tells it and
      // ends them.
      if (ranks.root()) throw;
      ranks.wait_for_all();
      return static_cast<int>(ExitCode::numerics);
    }
  });
}

}  // namespace ocublast::flow
