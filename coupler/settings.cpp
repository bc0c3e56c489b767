#include "coupler/settings.hpp"

#include <array>
#include <string_view>
#include <utility>

namespace ocublast::coupler {
namespace {

enum class Scheme { serial_explicit, paper };

constexpr std::array<std::pair<std::string_view, Scheme>, 2> schemes{
    {{"serial-explicit", Scheme::serial_explicit}, {"paper", Scheme::paper}}};
constexpr std::array<std::pair<std::string_view, WindowRule>, 3> window_rules{
    {{"subcycle", WindowRule::subcycle},
     {"lockstep", WindowRule::lockstep},
     {"fixed", WindowRule::fixed}}};
constexpr std::array<std::pair<std::string_view, link::WallPath>, 2> wall_paths{
    {{"cubic", link::WallPath::cubic}, {"straight", link::WallPath::straight}}};
constexpr std::array<std::pair<std::string_view, link::LoadShape>, 2> load_shapes{
    {{"linear", link::LoadShape::linear}, {"constant", link::LoadShape::constant}}};

void read_scheme(Section& section, Settings& settings) {
  Scheme scheme = Scheme::serial_explicit;
  section.choice<Scheme>("scheme", scheme, schemes,
                         {.help = "serial-explicit: flow first, 2nd order; paper: order 0, 1st order"});
  if (scheme == Scheme::paper) {
    settings.predictor_order = 0;
    settings.wall_path = link::WallPath::straight;
    settings.load_shape = link::LoadShape::constant;
  }
  section.integer("predictor_order", settings.predictor_order,
                  {.min = 0, .max = 2, .help = "order of the predicted motion of the structure"});
  section.choice<link::WallPath>("wall_path", settings.wall_path, wall_paths,
                                 {.help = "path of the wall inside a window"});
  section.choice<link::LoadShape>("load", settings.load_shape, load_shapes,
                                  {.help = "load on the solid inside a window"});
}

void read_windows(Section& section, Settings& settings) {
  section.choice<WindowRule>("window", settings.window, window_rules,
                             {.help = "width of a coupling window: a flow step, a common step, fixed"});
  section.real("window_s", settings.window_width,
               {.unit = "s", .min = 0.0, .help = "width of a fixed window"});
  section.integer("max_solid_steps", settings.max_solid_steps,
                  {.min = 1, .max = 20, .help = "solid steps in a subcycled window at most"});
  if (section.listing()) return;
  if (settings.window == WindowRule::fixed && settings.window_width <= 0.0)
    section.fault("window_s", "missing, window = \"fixed\" needs its width in s, accepted > 0 s");
  if (settings.window != WindowRule::fixed && section.has("window_s"))
    section.fault("window_s", "is used only with window = \"fixed\"; remove it or set window");
}

void read_limits(Section& section, Settings& settings) {
  section.real("theta_warn", settings.theta_warn,
               {.unit = "1", .min = 0.0, .help = "impedance x window / mass per area: order 1 above"});
  section.real("theta_refuse", settings.theta_refuse,
               {.unit = "1", .min = 0.0, .help = "the same: refused above"});
  section.flag("allow_unstable", settings.allow_unstable, "go on above theta_refuse");
  section.real("silence_limit_s", settings.silence_limit,
               {.unit = "s", .min = 0.1, .max = 1e6, .help = "longest time without a sign of life"});
  section.real("start_limit_s", settings.start_limit,
               {.unit = "s", .min = 0.1, .max = 1e6, .help = "longest set-up, and longest farewell"});
  section.real("step_limit_s", settings.step_limit,
               {.unit = "s", .min = 0.0, .max = 1e6,
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
  section.real("checkpoint_every_s", settings.checkpoint_every,
               {.unit = "s", .min = 0.0, .help = "simulated time between checkpoints, 0: none"});
  section.integer("checkpoint_every_windows", settings.checkpoint_every_windows,
                  {.min = 0, .help = "windows between checkpoints, 0: none"});
  section.text("endpoint", settings.endpoint,
               {.help = "ipc://PATH or tcp://ADDRESS:PORT; empty: a private ipc socket"});
  settings.case_hash = reader.hash();
  return settings;
}

}  // namespace ocublast::coupler
