#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <vector>

#include "coupler/base/errors.hpp"
#include "coupler/commands.hpp"
#include "coupler/link/payload.hpp"
#include "coupler/recording.hpp"
#include "coupler/traffic_compare.hpp"

namespace ocublast::coupler {

using link::Header;
using link::Kind;

namespace {

std::string range_of(const char* name, std::span<const double> values, const char* unit) {
  if (values.empty()) return {};
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  return fmt::format("  {} [{:.6g}, {:.6g}] {}", name, *low, *high, unit);
}

std::string contents(const Header& h, const TrafficRecord& record) {
  if (h.kind == Kind::mesh)
    return fmt::format("  '{}' {} vertices, {} triangles", h.mesh_name, h.n_vertices,
                       h.n_triangles);
  const auto view = link::view_payload(h, std::as_bytes(std::span(record.payload)));
  std::string text = range_of("position", view.position, "m") +
                     range_of("velocity", view.velocity, "m/s") +
                     range_of("overpressure", view.overpressure, "Pa");
  if (h.kind == Kind::step || h.kind == Kind::result) {
    text = fmt::format("  {:.9g}..{:.9g} s  {} steps{}", h.t_begin, h.t_end, h.steps,
                       h.idle ? "  idle" : "") +
           text;
    if (h.kind == Kind::result) text += fmt::format("  work {:.6g} J", h.work);
  }
  if (h.kind == Kind::ready) text = fmt::format("  stable step {:.6g} s", h.stable_step) + text;
  return text;
}

void require_undamaged(const TrafficReader& reader) {
  if (!reader.damage().empty()) throw LinkError(reader.damage());
}

}  // namespace

void dump_traffic(const std::filesystem::path& file) {
  TrafficReader reader(file);
  const auto& d = reader.description();
  std::printf("case %s (%016lx), mesh %016lx, written by %s%s\n", d.case_name.c_str(), d.case_hash,
              d.mesh_hash, d.program.c_str(), reader.complete() ? "" : "; not closed properly");
  std::printf("%8s %12s %-8s %8s %-10s\n", "number", "time us", "who", "window", "message");
  while (const auto record = reader.next()) {
    const Header h = link::decode(record->header);
    std::printf("%8lu %12.1f %-8s %8lu %-10s%s\n", record->number,
                1e-3 * static_cast<double>(record->nanoseconds), to_word(record->direction).c_str(),
                h.window, std::string(link::to_word(h.kind)).c_str(), contents(h, *record).c_str());
  }
  require_undamaged(reader);
}

bool diff_traffic(const std::filesystem::path& a, const std::filesystem::path& b,
                  double tolerance) {
  TrafficReader left(a);
  TrafficReader right(b);
  std::uint64_t compared = 0;
  while (true) {
    const auto l = left.next();
    const auto r = right.next();
    require_undamaged(left);
    require_undamaged(right);
    if (!l && !r) break;
    if (!l || !r) {
      std::printf("after %lu equal messages only %s goes on\n", compared, (l ? a : b).c_str());
      return false;
    }
    const Header hl = comparable(link::decode(l->header));
    const Header hr = comparable(link::decode(r->header));
    std::optional<std::string> difference;
    if (l->direction != r->direction)
      difference = fmt::format("window {}: {} against {}", hl.window, to_word(l->direction),
                               to_word(r->direction));
    else
      difference = first_difference(hl, std::as_bytes(std::span(l->payload)), hr,
                                    std::as_bytes(std::span(r->payload)), tolerance);
    if (difference) {
      std::printf("message %lu (%s): %s\n", l->number, to_word(l->direction).c_str(),
                  difference->c_str());
      return false;
    }
    ++compared;
  }
  std::printf("%lu messages agree\n", compared);
  return true;
}

}  // namespace ocublast::coupler
