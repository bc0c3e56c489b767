#pragma once

#include <csignal>
#include <deque>
#include <functional>
#include <initializer_list>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "coupler/child.hpp"
#include "coupler/server.hpp"

namespace ocublast::coupler {

/// SIGINT and SIGTERM as something to poll instead of an interruption; blocked while this lives.
class SignalWatch {
 public:
  SignalWatch();
  ~SignalWatch();
  SignalWatch(const SignalWatch&) = delete;
  SignalWatch& operator=(const SignalWatch&) = delete;
  [[nodiscard]] int fd() const { return fd_; }
  /// Number of signals that arrived since the last call.
  [[nodiscard]] int take();

 private:
  int fd_ = -1;
  sigset_t before_{};
};

/// The participants as the coupler sees them: one place that waits for a message and, while it
/// waits, notices death (pidfd), lost connections, silence, overlong steps and Ctrl-C.
class Partners {
 public:
  struct Limits {
    double silence = 60.0;  ///< s between two WAIT messages at most, divided by four
    double step = 0.0;      ///< s of wall time for one window; 0: none
  };
  Partners(Server& server, SignalWatch& signals, const Limits& limits,
           std::shared_ptr<spdlog::logger> log);

  void start(const Child::Start& start) { children_.emplace_back(start); }
  /// Called about once a second while waiting.
  void set_tick(std::function<void()> tick) { tick_ = std::move(tick); }

  /// Next message of any participant. Throws PartnerFault for ABORT, death, lost connection and
  /// for `limit` [s] passed (blamed on `blame`). `what` names what is awaited.
  [[nodiscard]] Incoming await(std::optional<Party> blame, const std::string& what, double limit);
  /// Next message of `party`, which must be of `kind`; its payload is checked.
  [[nodiscard]] Incoming await(Party party, link::Kind kind, const std::string& what, double limit);
  /// Whether Ctrl-C or SIGTERM asked for an orderly end. A second one throws LinkError at once.
  [[nodiscard]] bool stop_requested() const { return stops_ > 0; }

  /// Participants that owe an answer are not sent WAIT (they would not read it).
  void set_computing(Party party, bool computing);
  void set_over(Party party) { over_[index_of(party)] = true; }  ///< BYE came: its end is no fault

  /// Tells the others, gives them a second, then ends our own children.
  void end_all(const std::string& reason, int exit_code) noexcept;
  /// After BYE: waits until the children have ended by themselves; a nonzero exit code is a fault.
  void await_children(double limit);
  /// What lies behind a fault: where sending found the participant gone, its last words or how its
  /// process ended, waiting a moment; the fault itself where neither is known.
  [[nodiscard]] PartnerFault cause_of(const PartnerFault& fault);
  /// Log of a child, empty path if that side was not started by us.
  [[nodiscard]] std::filesystem::path log_of(Party party) const;

 private:
  [[nodiscard]] Child* child(Party party);
  void poll_once(link::Clock::time_point until);
  void check_lives();
  [[nodiscard]] bool hear_last_words(Party party);
  [[nodiscard]] std::optional<Incoming> take();  ///< kept messages first
  [[nodiscard]] std::optional<Incoming> take_new();
  void keep_alive(const std::string& what);

  Server& server_;
  SignalWatch& signals_;
  Limits limits_;
  std::shared_ptr<spdlog::logger> log_;
  std::vector<Child> children_;
  std::deque<Incoming> pending_;  ///< came while we listened for last words
  std::function<void()> tick_;
  std::vector<bool> computing_, over_;
  int stops_ = 0;
  link::Clock::time_point last_wait_ = link::Clock::now();
  link::Clock::time_point last_tick_ = link::Clock::now();
};

}  // namespace ocublast::coupler
