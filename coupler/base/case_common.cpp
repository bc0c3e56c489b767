#include "coupler/base/case_common.hpp"

#include <fmt/format.h>

namespace ocublast {

CaseCommon read_case_common(CaseReader& reader) {
  CaseCommon common;
  auto about = reader.section("case", "what the case is");
  about.text("name", common.name, {.required = true, .help = "short name, as the folder's"});
  about.text("title", common.title, {.required = true, .help = "one line, shown by --list"});
  std::string run_time;
  about.text("run_time", run_time, {.help = "typical wall time on two cores, shown by --list"});
  std::string resolution;
  about.text("resolution", resolution, {.help = "which [resolution.NAME] preset applies"});
  auto time = reader.section("time", "how long the case runs");
  time.real("end_s", common.end_time,
            {.unit = "s", .min = 0.0, .above_min = true, .required = true, .help = "end time"});
  auto ambient = reader.section("ambient", "the undisturbed air");
  ambient.real("pressure_Pa", common.ambient_pressure,
               {.unit = "Pa",
                .min = 0.0,
                .above_min = true,
                .required = true,
                .help = "absolute pressure; loads on solids are relative to it"});
  ambient.real(
      "temperature_K", common.ambient_temperature,
      {.unit = "K", .min = 0.0, .above_min = true, .required = true, .help = "temperature"});
  reader.expect_sections(
      {"case", "time", "ambient", "coupling", "flow", "solid", "mesh", "resolution", "report"});
  return common;
}

void check_interval(Section& section, std::string_view key, double every, double end_time) {
  constexpr double most = 1e6;
  if (section.listing() || every <= 0.0 || end_time <= most * every) return;
  section.fault(key, fmt::format("is {} s, more than a million times in {} s; accepted >= {} s",
                                 every, end_time, end_time / most));
}

}  // namespace ocublast
