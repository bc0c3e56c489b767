// A flow side for tests of the solid: the wall feels a half sine of overpressure, alike on the
// whole surface, whatever it does. Reads [flow] peak_Pa, duration_s, step_s.
#include <cmath>
#include <fstream>
#include <string>
#include <vector>

#include "coupler/base/case_common.hpp"
#include "coupler/base/command_line.hpp"
#include "coupler/base/errors.hpp"
#include "coupler/link/checkpoint_place.hpp"
#include "coupler/link/participant.hpp"

namespace {

using namespace ocublast;

struct Pulse {
  double peak = 0.0;
  double duration = 0.0;
  double start = 0.0;
  double step = 0.0;
  [[nodiscard]] double at(double t) const {
    if (t <= start || t >= start + duration) return 0.0;
    return peak * std::sin(3.14159265358979323846 * (t - start) / duration);
  }
};

int run(int argc, char** argv) {
  const auto line = parse_command_line(argc, argv, "solid_toy_flow", "pressure pulse");
  if (!line) return 0;
  CaseReader reader(line->source);
  static_cast<void>(read_case_common(reader));
  Pulse pulse;
  auto flow = reader.section("flow");
  flow.real("peak_Pa", pulse.peak, {.unit = "Pa", .required = true, .help = "peak"});
  flow.real("duration_s", pulse.duration,
            {.unit = "s", .required = true, .help = "length of the pulse"});
  flow.real("start_s", pulse.start, {.unit = "s", .required = true, .help = "when it comes"});
  flow.real("step_s", pulse.step, {.unit = "s", .required = true, .help = "stable step"});
  reader.finish();
  link::Participant participant(
      link::connection_from_environment(link::Role::flow, "solid_toy_flow", reader.hash()));
  const auto mesh = participant.receive_mesh();
  std::uint64_t window = 0;
  double time = 0.0;
  if (!line->resume.empty()) {
    std::ifstream file(link::require_checkpoint(line->resume).directory / "flow.txt");
    file >> window >> std::hexfloat;
    std::string text;
    file >> text;
    time = std::stod(text);
  }
  participant.ready(pulse.step, window, time);
  std::vector<double> load(mesh.n_vertices());
  while (true) {
    const auto order = participant.next();
    if (order.kind == link::Order::Kind::finish) break;
    if (order.kind == link::Order::Kind::checkpoint) {
      std::ofstream(order.checkpoint / "flow.txt")
          << window << ' ' << std::hexfloat << time << '\n';
      participant.checkpoint_written();
      continue;
    }
    window = order.window;
    time = order.t_end;
    load.assign(load.size(), pulse.at(order.t_end));
    const bool idle = pulse.at(order.t_end) == 0.0;
    link::Report report{.idle = idle, .stable_step = pulse.step, .steps_taken = 1};
    if (!idle) report.overpressure = load;
    participant.send(report);
  }
  participant.goodbye();
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (...) {
    return report_current_exception("solid_toy_flow");
  }
}
