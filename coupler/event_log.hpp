#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

namespace ocublast::coupler {

/// DIR/log/events.jsonl: what happened in a run, one JSON object per line, for programs. Each has
/// `time_utc`, `event` and what belongs to it; lines are written at once and whole.
class EventLog {
 public:
  explicit EventLog(const std::filesystem::path& file);
  ~EventLog();
  EventLog(const EventLog&) = delete;
  EventLog& operator=(const EventLog&) = delete;
  /// Never throws: a full disk must not end a run for its log's sake.
  void note(const char* event, const nlohmann::json& more) noexcept;

 private:
  int fd_ = -1;
};

/// What DIR/status.json says of a run, renewed about once a second.
struct RunStatus {
  std::string case_name;
  std::string phase;   ///< "handshake", "windows", "checkpoint", "farewell", "ended", "failed"
  std::string detail;  ///< why it failed
  std::uint64_t window = 0;
  double time = 0.0;          ///< s
  double end_time = 0.0;      ///< s
  double seconds_left = 0.0;  ///< s of wall time, estimated; 0: not known
  double overhead = 0.0;      ///< s per window, median
  double theta = 0.0;
  double energy_error = 0.0;  ///< relative
  std::string flow, solid;    ///< their own progress texts
};

/// Replaces DIR/status.json at once. Never throws.
void write_status(const std::filesystem::path& directory, const RunStatus& status) noexcept;

/// `coupler status DIR`: prints it, and whether the coupler is still alive. Throws CaseError where
/// there is no run.
void print_status(const std::filesystem::path& directory);

}  // namespace ocublast::coupler
