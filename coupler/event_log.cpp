#include "coupler/event_log.hpp"

#include <fcntl.h>
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <chrono>
#include <ctime>
#include <fstream>
#include <nlohmann/json.hpp>

#include "coupler/base/errors.hpp"

namespace ocublast::coupler {
namespace {

std::string utc_now() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  const auto whole = std::chrono::duration_cast<std::chrono::seconds>(now);
  const auto part = std::chrono::duration_cast<std::chrono::milliseconds>(now - whole);
  return fmt::format("{:%Y-%m-%dT%H:%M:%S}.{:03}Z",
                     fmt::gmtime(static_cast<std::time_t>(whole.count())), part.count());
}

constexpr const char* status_name = "status.json";

/// Whether somebody holds the lock of a run.
bool coupler_lives(const std::filesystem::path& directory) {
  const int fd = ::open((directory / "log" / "coupler.lock").c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) return false;
  const bool held = ::flock(fd, LOCK_SH | LOCK_NB) != 0;
  ::close(fd);
  return held;
}

}  // namespace

EventLog::EventLog(const std::filesystem::path& file)
    : fd_(::open(file.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644)) {
  if (fd_ < 0) throw LinkError(fmt::format("{}: cannot be created", file.string()));
}

EventLog::~EventLog() {
  ::close(fd_);
}

void EventLog::note(const char* event, const nlohmann::json& more) noexcept {
  try {
    nlohmann::json line{{"time_utc", utc_now()}, {"event", event}};
    line.update(more);
    // Text of a solver may hold anything: bytes that are no UTF-8 are replaced.
    const std::string text =
        line.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
    static_cast<void>(!::write(fd_, text.data(), text.size()));
  } catch (const std::exception&) {
    // Nothing depends on it.
  }
}

void write_status(const std::filesystem::path& directory, const RunStatus& s) noexcept {
  try {
    const nlohmann::json json{{"time_utc", utc_now()},
                              {"case", s.case_name},
                              {"phase", s.phase},
                              {"detail", s.detail},
                              {"window", s.window},
                              {"time_s", s.time},
                              {"end_s", s.end_time},
                              {"left_s", s.seconds_left},
                              {"microseconds_per_window", 1e6 * s.overhead},
                              {"theta", s.theta},
                              {"energy_error_relative", s.energy_error},
                              {"flow", s.flow},
                              {"solid", s.solid},
                              {"pid", ::getpid()}};
    const auto file = directory / status_name;
    auto aside = file;
    aside += ".part";
    std::ofstream out(aside, std::ios::trunc);
    out << json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) << '\n';
    out.close();
    if (out) std::filesystem::rename(aside, file);
  } catch (const std::exception&) {
    // A run goes on without being watched.
  }
}

void print_status(const std::filesystem::path& directory) {
  const auto file = directory / status_name;
  std::ifstream in(file);
  if (!in)
    throw CaseError(fmt::format("{}: no {} in it: not the results of a coupled run",
                                directory.string(), status_name));
  nlohmann::json s;
  try {
    s = nlohmann::json::parse(in);
    const std::string phase = s.at("phase");
    const bool over = phase == "ended" || phase == "failed" || phase == "stopped";
    const bool alive = coupler_lives(directory);
    fmt::print("{}: {}{} (as of {})\n", s.at("case").get<std::string>(), phase,
               over || alive ? "" : ", but its coupler is gone",
               s.at("time_utc").get<std::string>());
    const double end = s.at("end_s");
    const double time = s.at("time_s");
    fmt::print("window {}, t = {:.6g} s of {:.6g} s ({:.1f} %)",
               s.at("window").get<std::uint64_t>(), time, end,
               end > 0.0 ? 100.0 * time / end : 100.0);
    if (const double left = s.at("left_s"); left > 0.0 && alive)
      fmt::print(", about {:.0f} s left", left);
    fmt::print("\ncoupling {:.0f} us per window, theta {:.3g}, interface energy error {:.2e}\n",
               s.at("microseconds_per_window").get<double>(), s.at("theta").get<double>(),
               s.at("energy_error_relative").get<double>());
    for (const char* key : {"flow", "solid", "detail"})
      if (const std::string text = s.at(key); !text.empty()) fmt::print("{}: {}\n", key, text);
  } catch (const nlohmann::json::exception& error) {
    throw LinkError(fmt::format("{}: cannot be read: {}", file.string(), error.what()));
  }
}

}  // namespace ocublast::coupler
