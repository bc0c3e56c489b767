#pragma once

#include <spdlog/spdlog.h>

#include <chrono>
#include <filesystem>
#include <memory>
#include <string>

#include "solid_solver/io/checkpoint.hpp"

namespace ocublast::solid {

/// Wall seconds spent, by kind.
struct WallSplit {
  double compute = 0.0;
  double tables = 0.0;
  double output = 0.0;
  double waiting = 0.0;  ///< for the coupler
  double checkpoint = 0.0;
};

/// Adds the time until its end to a sum.
class Stopwatch {
 public:
  explicit Stopwatch(double& sum) : sum_(sum), begin_(std::chrono::steady_clock::now()) {}
  ~Stopwatch() { sum_ += elapsed(); }
  Stopwatch(const Stopwatch&) = delete;
  Stopwatch& operator=(const Stopwatch&) = delete;
  [[nodiscard]] double elapsed() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
  }

 private:
  double& sum_;
  std::chrono::steady_clock::time_point begin_;
};

/// A run with its tables, fields, checkpoints and summary, alone or coupled, on one rank or several
/// (then every rank has a session and calls the same).
class Session {
 public:
  struct Options {
    std::filesystem::path out;
    std::uint64_t case_hash = 0;
    bool equilibrium = true;  ///< relax first where the case wants it
  };
  Session(SolidCase from, Options options, std::shared_ptr<spdlog::logger> log);

  [[nodiscard]] SolidRun& run() { return run_; }
  [[nodiscard]] const SolidCase& solid_case() const { return case_; }
  [[nodiscard]] bool root() const { return run_.team().root(); }
  /// As read, before it was cut among ranks; null elsewhere than on the root.
  [[nodiscard]] const SolidMesh* whole_mesh() const { return case_.whole_mesh.get(); }
  [[nodiscard]] std::uint64_t case_hash() const { return options_.case_hash; }
  [[nodiscard]] RunProgress& progress() { return progress_; }
  [[nodiscard]] WallSplit& wall() { return wall_; }
  [[nodiscard]] spdlog::logger& log() { return *log_; }

  /// Advances over a window and counts it.
  WindowResult advance(const Window& window);
  /// Rows and fields that are due at the current time; everything when `last`. Collective, as is
  /// all that follows; the root writes.
  void write_due(bool last);
  /// Keeps the state in memory, and goes back to it: a window of implicit coupling is done again.
  void keep();
  void rewind();
  void write_checkpoint_to(const std::filesystem::path& directory);
  void resume_from(const std::filesystem::path& directory);
  /// Summary, to be called at the end.
  void write_summary();
  /// What runs, in a few lines.
  [[nodiscard]] std::string describe();

 private:
  void find_equilibrium();
  void set_initial_velocities();
  [[nodiscard]] std::string bounded_by();
  [[nodiscard]] std::string element_counts();

  SolidCase case_;
  Options options_;
  std::shared_ptr<spdlog::logger> log_;
  SolidRun run_;
  WholeState whole_;
  History history_;
  FieldOutput fields_;
  RunProgress progress_;
  std::vector<std::vector<double>> kept_;  ///< by keep(): the arrays of a checkpoint
  RunProgress kept_progress_;
  WallSplit wall_;
  CellResults cells_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// Whether t has come to `due`, up to rounding of summed windows.
[[nodiscard]] bool is_due(double t, double due);
/// Smallest multiple of `every` after t (s).
[[nodiscard]] double next_due(double t, double every);

}  // namespace ocublast::solid
