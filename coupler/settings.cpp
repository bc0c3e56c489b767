#include "coupler/settings.hpp"

#include <array>
#include <string_view>
#include <utility>

namespace ocublast::coupler {
namespace {

enum class SchemeName {
  serial_explicit,
  paper,
  leap_frog,
  parallel_explicit,
  serial_implicit,
  parallel_implicit
};

constexpr std::array<std::pair<std::string_view, SchemeName>, 6> schemes{
    {{"serial-explicit", SchemeName::serial_explicit},
     {"paper", SchemeName::paper},
     {"leap-frog", SchemeName::leap_frog},
     {"parallel-explicit", SchemeName::parallel_explicit},
     {"serial-implicit", SchemeName::serial_implicit},
     {"parallel-implicit", SchemeName::parallel_implicit}}};
constexpr std::array<std::pair<std::string_view, RelaxationKind>, 3> relaxations{
    {{"constant", RelaxationKind::constant},
     {"aitken", RelaxationKind::aitken},
     {"iqn-ils", RelaxationKind::iqn_ils}}};
constexpr std::array<std::pair<std::string_view, WindowRule>, 3> window_rules{
    {{"subcycle", WindowRule::subcycle},
     {"lockstep", WindowRule::lockstep},
     {"fixed", WindowRule::fixed}}};
constexpr std::array<std::pair<std::string_view, MappingKind>, 3> mappings{
    {{"automatic", MappingKind::automatic},
     {"nearest-projection", MappingKind::nearest_projection},
     {"radial-basis", MappingKind::radial_basis}}};
constexpr std::array<std::pair<std::string_view, link::WallPath>, 2> wall_paths{
    {{"cubic", link::WallPath::cubic}, {"straight", link::WallPath::straight}}};
constexpr std::array<std::pair<std::string_view, link::LoadShape>, 2> load_shapes{
    {{"linear", link::LoadShape::linear}, {"constant", link::LoadShape::constant}}};

/// Stability figures beyond which the predictor falls to order 1, and beyond which the scheme is
/// refused: measured on the piston and the rod, with a margin of two to five. A pipelined structure
/// is predicted over two windows and needs four times less.
///
/// Why: a mass M against a gas that answers p = -Z v at the ends of windows of width w, theta = Z w
/// / M. Serial, order 2 (v* = 2 v(n) - v(n-1)): z^3 - z^2 + theta/2 (z + 1)(2 z - 1) = 0, stable
/// to 1.155; order 1 to 2.0. Pipelined (v* = 3 v(n-1) - 2 v(n-2)): z^4 - z^3 + theta/2 (3 z^2 + z -
/// 2) = 0, stable to 0.453; order 1 to 0.828. Gas in cells, which answers with the mass of the
/// first one too, takes a quarter to a half off (the toy gas column: below 0.35 and 0.9), many
/// solid steps per window more.
constexpr double theta_warn_pipelined = 0.005;
constexpr double theta_refuse_pipelined = 0.01;

void apply_scheme(SchemeName name, Settings& settings) {
  switch (name) {
    case SchemeName::serial_explicit:
      break;
    case SchemeName::paper:
      settings.predictor_order = 0;
      settings.wall_path = link::WallPath::straight;
      settings.load_shape = link::LoadShape::constant;
      break;
    case SchemeName::leap_frog:
      settings.leap_frog = true;
      settings.window = WindowRule::lockstep;
      break;
    case SchemeName::parallel_explicit:
      settings.scheme = SchemeKind::parallel_explicit;
      settings.theta_warn = theta_warn_pipelined;
      settings.theta_refuse = theta_refuse_pipelined;
      break;
    case SchemeName::serial_implicit:
      settings.scheme = SchemeKind::serial_implicit;
      break;
    case SchemeName::parallel_implicit:
      settings.scheme = SchemeKind::parallel_implicit;
      settings.relaxation = RelaxationKind::iqn_ils;
      // A motion that repeats itself says nothing of the load where the solid hardly feels it.
      settings.convergence_load = 1e-6;
      break;
  }
}

void read_implicit(Section& section, Settings& settings) {
  section.choice<RelaxationKind>("relaxation", settings.relaxation, relaxations,
                                 {.help = "how an implicit iteration finds its next guess"});
  section.real("relaxation_factor", settings.relaxation_factor,
               {.unit = "1",
                .min = 0.0,
                .max = 2.0,
                .above_min = true,
                .help = "constant, or first in a window"});
  section.real("convergence_motion", settings.convergence_motion,
               {.unit = "1",
                .min = 0.0,
                .max = 1.0,
                .above_min = true,
                .help = "implicit: change of a window's motion, relative to it"});
  section.real("convergence_load", settings.convergence_load,
               {.unit = "1",
                .min = 0.0,
                .max = 1.0,
                .help = "implicit: change of the load, 0: not looked at"});
  section.integer("max_iterations", settings.max_iterations,
                  {.min = 1, .max = 1000, .help = "implicit: iterations of a window at most"});
}

void read_scheme(Section& section, Settings& settings) {
  SchemeName scheme = SchemeName::serial_explicit;
  section.choice<SchemeName>(
      "scheme", scheme, schemes,
      {.help = "serial-explicit: flow first, 2nd order; paper: its order 0; leap-frog: the "
               "solid's own acceleration, in lock step; parallel-explicit: pipelined"});
  apply_scheme(scheme, settings);
  read_implicit(section, settings);
  section.integer("predictor_order", settings.predictor_order,
                  {.min = 0, .max = 2, .help = "order of the predicted motion of the structure"});
  section.choice<link::WallPath>("wall_path", settings.wall_path, wall_paths,
                                 {.help = "path of the wall inside a window"});
  section.choice<link::LoadShape>("load", settings.load_shape, load_shapes,
                                  {.help = "load on the solid inside a window"});
  section.choice<MappingKind>(
      "mapping", settings.mapping.kind, mappings,
      {.help = "between interface meshes that differ; automatic: nearest projection, radial "
               "basis where the solid has no triangles"});
  section.real("mapping_gap", settings.mapping.largest_gap,
               {.unit = "1",
                .min = 0.0,
                .max = 100.0,
                .above_min = true,
                .help = "largest distance between the two meshes, in facet sizes"});
}

void read_windows(Section& section, Settings& settings) {
  section.choice<WindowRule>(
      "window", settings.window, window_rules,
      {.help = "width of a coupling window: a flow step, a common step, fixed"});
  section.real("window_s", settings.window_width,
               {.unit = "s", .min = 0.0, .help = "width of a fixed window"});
  section.integer("max_flow_steps", settings.max_flow_steps,
                  {.min = 1, .max = 20, .help = "flow steps in a subcycled window at most"});
  section.integer("max_solid_steps", settings.max_solid_steps,
                  {.min = 1, .max = 20, .help = "solid steps in a subcycled window at most"});
  if (section.listing()) return;
  if (settings.window == WindowRule::fixed && settings.window_width <= 0.0)
    section.fault("window_s", "missing, window = \"fixed\" needs its width in s, accepted > 0 s");
  if (settings.leap_frog && settings.window != WindowRule::lockstep)
    section.fault("window",
                  "scheme = \"leap-frog\" needs one solid step per window, accepted: lockstep");
  // 0 is the default, as the effective case of a run says it.
  if (settings.window != WindowRule::fixed && settings.window_width > 0.0)
    section.fault("window_s", "is used only with window = \"fixed\"; remove it or set window");
}

void read_limits(Section& section, Settings& settings) {
  section.real("load_ramp_s", settings.load_ramp,
               {.unit = "s",
                .min = 0.0,
                .help = "time in which the load on the solid grows from 0, 0: none"});
  section.real(
      "theta_warn", settings.theta_warn,
      {.unit = "1", .min = 0.0, .help = "impedance x window / mass per area: order 1 above"});
  section.real("theta_refuse", settings.theta_refuse,
               {.unit = "1", .min = 0.0, .help = "the same: refused above"});
  section.flag("allow_unstable", settings.allow_unstable, "go on above theta_refuse");
  section.real(
      "silence_limit_s", settings.silence_limit,
      {.unit = "s", .min = 0.1, .max = 1e6, .help = "longest time without a sign of life"});
  section.real(
      "start_limit_s", settings.start_limit,
      {.unit = "s", .min = 0.1, .max = 1e6, .help = "longest set-up, and longest farewell"});
  section.real("step_limit_s", settings.step_limit,
               {.unit = "s",
                .min = 0.0,
                .max = 1e6,
                .help = "longest wall time of one window of one side, 0: none"});
  section.real("max_message_MB", settings.max_message,
               {.unit = "MB", .min = 1.0, .max = 2000.0, .help = "larger messages are refused"});
}

}  // namespace

Settings read_settings(CaseReader& reader) {
  Settings settings;
  settings.common = read_case_common(reader);
  auto section = reader.section("coupling", "how flow and solid advance together");
  read_scheme(section, settings);
  read_windows(section, settings);
  read_limits(section, settings);
  section.flag("record", settings.record, "keep the exact messages in traffic.ocu");
  section.flag("record_packed", settings.record_packed,
               "pack the recording with zstd: smaller, more work beside the run");
  section.flag("shared_memory", settings.share_memory, "ipc: large payloads through shared memory");
  section.real("checkpoint_every_s", settings.checkpoint_every,
               {.unit = "s", .min = 0.0, .help = "simulated time between checkpoints, 0: none"});
  check_interval(section, "checkpoint_every_s", settings.checkpoint_every,
                 settings.common.end_time);
  section.integer("checkpoint_every_windows", settings.checkpoint_every_windows,
                  {.min = 0, .help = "windows between checkpoints, 0: none"});
  section.text("endpoint", settings.endpoint,
               {.help = "ipc://PATH or tcp://ADDRESS:PORT; empty: a private ipc socket"});
  settings.case_hash = reader.hash();
  if (!reader.solids().empty()) settings.roster = Roster(reader.solids());
  auto hosts = section.table(
      "hosts", "who is started elsewhere, by somebody else: addresses they connect from");
  for (const Party party : settings.roster.all()) {
    auto& host = settings.hosts.emplace_back();
    hosts.text(settings.roster.file_name(party), host,
               {.help = "its address, as in \"10.0.0.2\"; needs a tcp endpoint"});
  }
  return settings;
}

}  // namespace ocublast::coupler
