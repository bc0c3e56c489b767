#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdio>

#include "coupler/base/errors.hpp"
#include "coupler/base/log.hpp"
#include "coupler/commands.hpp"
#include "coupler/link/payload.hpp"
#include "coupler/partners.hpp"
#include "coupler/recording.hpp"
#include "coupler/socket_place.hpp"
#include "coupler/solver_start.hpp"
#include "coupler/traffic_compare.hpp"

namespace ocublast::coupler {

using link::Header;
using link::Kind;
using link::to_word;

namespace {

/// Stands for "no limit" where a wait is watched over by heartbeats alone.
constexpr double no_limit = 1e9;

/// Plays one side of a recording to a live participant of the other.
class Replay {
 public:
  Replay(TrafficReader& traffic, Party live, const RunOptions& options, const Settings& settings,
         double tolerance, std::shared_ptr<spdlog::logger> log)
      : traffic_(traffic),
        live_(live),
        settings_(settings),
        tolerance_(tolerance),
        place_(options.endpoint.empty() ? settings.endpoint : options.endpoint),
        start_(options, settings.roster, place_.encrypted(), settings.case_hash),
        server_({.endpoint = place_.endpoint(),
                 .run_id = link::make_run_id(),
                 .token = start_.token(),
                 .case_hash = settings.case_hash,
                 .silence_limit = settings.silence_limit,
                 .max_message = 1e6 * settings.max_message,
                 .keys = start_.coupler_keys(),
                 .roster = settings.roster,
                 .only = live,
                 .share_memory = settings.share_memory},
                log),
        partners_(server_, signals_, {settings.silence_limit, settings.step_limit}, log) {
    if (options.await)
      start_.announce({live}, server_.endpoint(), settings.silence_limit);
    else
      partners_.start(start_.child(live, server_.endpoint(), settings.silence_limit));
  }

  void run();

 private:
  void play();
  void order(const TrafficRecord& record);
  void compare(const TrafficRecord& record);
  void farewell();

  TrafficReader& traffic_;
  Party live_;
  const Settings& settings_;
  double tolerance_;
  SocketPlace place_;
  SolverStart start_;
  SignalWatch signals_;
  Server server_;
  Partners partners_;
  std::uint64_t compared_ = 0;
  std::uint64_t window_ = 0;
};

/// Sends a recorded order again: same content, numbers of this run.
void Replay::order(const TrafficRecord& record) {
  Header header = link::decode(record.header);
  window_ = header.window;
  zmq::message_t payload(record.payload.data(), record.payload.size());
  server_.send(live_, std::move(header), payload);
}

void Replay::compare(const TrafficRecord& record) {
  const Header expected = link::decode(record.header);
  const bool setting_up = expected.kind == Kind::mesh || expected.kind == Kind::ready;
  const double step_limit = settings_.step_limit > 0.0 ? settings_.step_limit : no_limit;
  Incoming found = partners_.await(live_, expected.kind, std::string(to_word(expected.kind)),
                                   setting_up ? settings_.start_limit : step_limit);
  const auto difference =
      first_difference(comparable(expected), std::as_bytes(std::span(record.payload)),
                       comparable(found.header), found.payload(), tolerance_);
  if (difference)
    throw LinkError(fmt::format("the live {} side ({}) does not reproduce the recording: {}",
                                server_.roster().word(live_), server_.program(live_), *difference));
  ++compared_;
}

void Replay::farewell() {
  Header header;
  header.kind = Kind::finish;
  header.window = window_;
  server_.send(live_, std::move(header));
  static_cast<void>(partners_.await(live_, Kind::bye, "BYE", settings_.start_limit));
  partners_.set_over(live_);
  partners_.await_children(settings_.start_limit);
}

void Replay::play() {
  static_cast<void>(partners_.await(live_, Kind::hello, "HELLO", settings_.start_limit));
  while (const auto record = traffic_.next()) {
    if (record->direction == Direction{live_, true})
      compare(*record);
    else if (record->direction == Direction{live_, false})
      order(*record);
  }
  if (!traffic_.damage().empty())
    std::printf("the recording ends early: %s\n", traffic_.damage().c_str());
  farewell();
  std::printf("%lu messages of the %s side reproduced%s\n", compared_,
              server_.roster().word(live_).c_str(),
              tolerance_ > 0.0 ? fmt::format(" within {}", tolerance_).c_str() : " byte for byte");
}

void Replay::run() {
  try {
    play();
  } catch (const PartnerFault& fault) {
    const auto log = partners_.log_of(live_);
    const std::string text =
        fmt::format("{} failed at window {} of the replay: {}{}", server_.roster().word(live_),
                    window_, fault.what(), log.empty() ? "" : "; its log: " + log.string());
    partners_.end_all(text, fault.exit_code);
    throw LinkError(text);
  } catch (const std::exception& error) {
    partners_.end_all(error.what(), 3);
    throw;
  }
}

}  // namespace

void replay_traffic(const std::filesystem::path& file, link::Role played, const std::string& live,
                    const RunOptions& given, double tolerance) {
  RunOptions options = given;
  CaseReader reader(options.source);
  const Settings settings = read_settings(reader);
  reader.finish();
  TrafficReader traffic(file);
  if (traffic.description().case_hash != settings.case_hash)
    throw CaseError(fmt::format(
        "{} was recorded with case {:016x}, this case is {:016x}: replay needs the same "
        "case and --set",
        file.string(), traffic.description().case_hash, settings.case_hash));
  if (traffic.description().first_window != 1 && options.resume.empty())
    throw CaseError(
        fmt::format("{} begins with window {}: give --resume with the checkpoint before it",
                    file.string(), traffic.description().first_window));
  if (options.out.empty())
    options.out = std::filesystem::path("results") / (settings.common.name + "_replay");
  std::filesystem::create_directories(options.out / "log");
  const auto log = make_logger("coupler", options.out / "log" / "coupler.log");
  const auto& names = settings.roster.solids();
  const auto at = live.empty() ? names.begin() : std::find(names.begin(), names.end(), live);
  if (at == names.end())
    throw CaseError(fmt::format("--live {}: no solid is called so; there are {}", live,
                                fmt::join(names, ", ")));
  const Party solid = solid_party(static_cast<std::size_t>(at - names.begin()));
  Replay(traffic, played == link::Role::flow ? solid : Party::flow, options, settings, tolerance,
         log)
      .run();
}

}  // namespace ocublast::coupler
