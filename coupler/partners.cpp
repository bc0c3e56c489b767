#include "coupler/partners.hpp"

#include <fmt/format.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <algorithm>

#include "coupler/base/errors.hpp"
#include "coupler/link/payload.hpp"

namespace ocublast::coupler {

using link::Clock;
using link::Kind;
using link::to_word;

namespace {

/// A solver that gives up says so and ends; its last words may arrive after its death is seen. All
/// have arrived once its connection is seen closed, which a busy machine may delay.
constexpr double last_words_patience = 1.0;
/// The same for one that has not been admitted: its connection is not known.
constexpr double first_words_patience = 0.05;
/// Time the others get to end by themselves after ABORT.
constexpr double abort_patience = 1.0;
constexpr double tick_every = 1.0;

/// The run ends with a participant's own code where that says more than that the link broke.
PartnerFault fault_of(Party party, const ProcessEnd& end) {
  const bool own_code = end.exit_code == 2 || end.exit_code == 4;
  return {party, end.text(), own_code ? end.exit_code : 3};
}

}  // namespace

SignalWatch::SignalWatch() {
  sigset_t wanted;
  sigemptyset(&wanted);
  sigaddset(&wanted, SIGINT);
  sigaddset(&wanted, SIGTERM);
  ::pthread_sigmask(SIG_BLOCK, &wanted, &before_);
  fd_ = ::signalfd(-1, &wanted, SFD_CLOEXEC | SFD_NONBLOCK);
  if (fd_ < 0) throw LinkError("no signalfd");
}
SignalWatch::~SignalWatch() {
  ::close(fd_);
  ::pthread_sigmask(SIG_SETMASK, &before_, nullptr);
}
int SignalWatch::take() {
  signalfd_siginfo info{};
  int n = 0;
  while (::read(fd_, &info, sizeof info) == static_cast<ssize_t>(sizeof info)) ++n;
  return n;
}

Partners::Partners(Server& server, SignalWatch& signals, const Limits& limits,
                   std::shared_ptr<spdlog::logger> log)
    : server_(server),
      signals_(signals),
      limits_(limits),
      log_(std::move(log)),
      computing_(server.roster().size()),
      over_(server.roster().size()) {}

Child* Partners::child(Party party) {
  for (Child& c : children_)
    if (c.party() == party) return &c;
  return nullptr;
}

std::filesystem::path Partners::log_of(Party party) const {
  for (const Child& c : children_)
    if (c.party() == party) return c.log();
  return {};
}

PartnerFault Partners::cause_of(const PartnerFault& fault) {
  if (!fault.gone) return fault;
  Child* c = child(fault.party);
  const auto end = c == nullptr ? std::nullopt : c->wait_after_close();
  try {
    static_cast<void>(hear_last_words(fault.party));
  } catch (const PartnerFault& heard) {
    return heard;
  }
  return end ? fault_of(fault.party, *end) : fault;
}

void Partners::set_computing(Party party, bool computing) {
  computing_[index_of(party)] = computing;
}

void Partners::poll_once(Clock::time_point until) {
  auto all = server_.poll_items();
  all.push_back({nullptr, signals_.fd(), ZMQ_POLLIN, 0});
  for (Child& c : children_)
    if (!over_[index_of(c.party())]) all.push_back({nullptr, c.pidfd(), ZMQ_POLLIN, 0});
  try {
    zmq::poll(all.data(), all.size(), link::time_left(until));
  } catch (const zmq::error_t& error) {
    if (error.num() != EINTR) throw;
  }
  const int stops = signals_.take();
  if (stops == 0) return;
  stops_ += stops;
  if (stops_ > 1) throw LinkError("stopped at once, as asked for twice");
  log_->info("asked to stop: the window under way is finished first");
}

std::optional<Incoming> Partners::take() {
  if (!pending_.empty()) {
    std::optional<Incoming> first(std::move(pending_.front()));
    pending_.pop_front();
    return first;
  }
  return take_new();
}

std::optional<Incoming> Partners::take_new() {
  auto message = server_.take();
  if (message && message->header.kind == Kind::abort)
    throw PartnerFault(message->party, message->header.reason,
                       std::clamp(static_cast<int>(message->header.exit_code), 1, 4));
  return message;
}

/// Reads on until nothing of a participant can come any more. What it sent before is kept: then
/// true. Its ABORT is thrown.
bool Partners::hear_last_words(Party party) {
  if (std::any_of(pending_.begin(), pending_.end(),
                  [&](const Incoming& m) { return m.party == party; }))
    return true;
  const double patience = server_.admitted(party) ? last_words_patience : first_words_patience;
  const auto deadline = Clock::now() + link::seconds(patience);
  while (true) {
    while (auto message = take_new()) {
      const bool its_own = message->party == party;
      pending_.push_back(std::move(*message));
      if (its_own) return true;
    }
    if (server_.lost(party) || Clock::now() >= deadline) return false;
    auto items = server_.poll_items();
    zmq::poll(items.data(), items.size(), link::time_left(deadline));
  }
}

void Partners::check_lives() {
  for (Child& c : children_)
    if (!over_[index_of(c.party())])
      if (const auto end = c.ended(); end && !hear_last_words(c.party()))
        throw fault_of(c.party(), *end);
  for (const Party party : server_.roster().all()) {
    if (over_[index_of(party)] || !server_.lost(party)) continue;
    if (Child* c = child(party))
      if (const auto end = c->wait_after_close()) {
        if (!hear_last_words(party)) throw fault_of(party, *end);
        return;
      }
    throw PartnerFault(party, "closed its connection, or sent no heartbeat in time");
  }
}

void Partners::keep_alive(const std::string& what) {
  if (link::seconds_since(last_wait_) < 0.25 * limits_.silence) return;
  last_wait_ = Clock::now();
  for (const Party party : server_.roster().all())
    if (!computing_[index_of(party)] && !over_[index_of(party)]) server_.send_wait(party, what);
}

Incoming Partners::await(std::optional<Party> blame, const std::string& what, double limit) {
  const auto begin = Clock::now();
  const auto deadline = begin + link::seconds(limit);
  while (true) {
    if (auto message = take()) return std::move(*message);
    check_lives();
    if (Clock::now() >= deadline) {
      const std::string text =
          fmt::format("{} was awaited in vain for {:.3g} s", what, link::seconds_since(begin));
      if (blame) throw PartnerFault(*blame, text);
      throw LinkError(text);
    }
    keep_alive(what);
    if (tick_ && link::seconds_since(last_tick_) >= tick_every) {
      last_tick_ = Clock::now();
      tick_();
    }
    const double nap = std::min(tick_every, 0.25 * limits_.silence);
    poll_once(std::min(deadline, Clock::now() + link::seconds(nap)));
  }
}

Incoming Partners::await(Party party, Kind kind, const std::string& what, double limit) {
  Incoming message = await(party, what, limit);
  if (message.party != party || message.header.kind != kind)
    throw PartnerFault(message.party, fmt::format("sent {} while {} of the {} side was awaited",
                                                  to_word(message.header.kind), what,
                                                  server_.roster().word(party)));
  try {
    link::check_payload(message.header, message.payload());
  } catch (const LinkError& error) {
    throw PartnerFault(party, error.what());
  }
  return message;
}

void Partners::end_all(const std::string& reason, int exit_code) noexcept {
  server_.abort_all(reason, exit_code);
  const auto begin = Clock::now();
  for (Child& c : children_) c.end(std::max(0.0, abort_patience - link::seconds_since(begin)));
}

void Partners::await_children(double limit) {
  const auto begin = Clock::now();
  for (Child& c : children_) {
    const auto end = c.wait(std::max(0.0, limit - link::seconds_since(begin)));
    if (!end)
      throw PartnerFault(c.party(), fmt::format("said BYE but did not end within {:.3g} s", limit));
    if (end->signal != 0 || end->exit_code != 0) throw PartnerFault(c.party(), end->text());
  }
}

}  // namespace ocublast::coupler
