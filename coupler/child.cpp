#include "coupler/child.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <fstream>
#include <sstream>

#include "coupler/base/errors.hpp"
#include "coupler/link/message.hpp"
#include "coupler/rank_guard.hpp"

namespace ocublast::coupler {

std::string ProcessEnd::text() const {
  if (signal != 0) return fmt::format("killed by signal {} ({})", signal, ::strsignal(signal));
  switch (exit_code) {
    case 0:
      return "ended with exit code 0 before the run was over";
    case 2:
      return "ended with exit code 2 (case)";
    case 3:
      return "ended with exit code 3 (link)";
    case 4:
      return "ended with exit code 4 (numerics)";
    default:
      return fmt::format("ended with exit code {}", exit_code);
  }
}

namespace {

/// A closed connection is usually a process about to end, whose exit code says more.
constexpr double close_patience = 0.3;
/// One that is dying needs a processor to do so: a busy machine may keep it waiting.
constexpr double take_down_patience = 5.0;
/// mpirun ends its ranks within a second of the death of one.
constexpr double launcher_patience = 1.5;

std::vector<std::string> make_environment(
    const std::vector<std::pair<std::string, std::string>>& added) {
  std::vector<std::string> all;
  for (char** at = environ; *at != nullptr; ++at) {
    const std::string entry = *at;
    bool replaced = false;
    for (const auto& [name, value] : added) replaced = replaced || entry.starts_with(name + "=");
    if (!replaced) all.push_back(entry);
  }
  for (const auto& [name, value] : added) all.push_back(name + "=" + value);
  return all;
}

std::vector<char*> pointers(std::vector<std::string>& texts) {
  std::vector<char*> out;
  for (auto& text : texts) out.push_back(text.data());
  out.push_back(nullptr);
  return out;
}

}  // namespace

Child::Child(const Start& start) : party_(start.party), guarded_(start.guarded), log_(start.log) {
  std::filesystem::create_directories(start.log.parent_path());
  const int log_fd = ::open(start.log.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  if (log_fd < 0) throw LinkError(fmt::format("{}: cannot be created", start.log.string()));
  int report[2];
  if (::pipe2(report, O_CLOEXEC) != 0) throw LinkError("no pipe for a new process");
  auto command = start.command;
  auto environment = make_environment(start.environment);
  const auto argv = pointers(command);
  const auto envp = pointers(environment);
  const pid_t parent = ::getpid();
  pid_ = ::fork();
  if (pid_ == 0) {
    const Launch launch{argv.data(), envp.data(), log_fd, report[1], parent};
    if (start.guarded) stand_guard(launch);
    become(launch);
  }
  ::close(log_fd);
  ::close(report[1]);
  int error = pid_ < 0 ? errno : 0;
  if (pid_ > 0) static_cast<void>(!::read(report[0], &error, sizeof error));
  ::close(report[0]);
  if (error != 0) {
    if (pid_ > 0) ::waitpid(pid_, nullptr, 0);
    pid_ = -1;
    throw LinkError(fmt::format("the {} side cannot be started: {}: {}", start.word,
                                start.command.front(), std::strerror(error)));
  }
  pidfd_ = static_cast<int>(::syscall(SYS_pidfd_open, pid_, 0));
  if (pidfd_ < 0) {
    ::kill(-pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
    throw LinkError("this kernel has no pidfd (Linux 5.3 or later is needed)");
  }
}

Child::Child(Child&& other) noexcept
    : party_(other.party_),
      guarded_(other.guarded_),
      pid_(std::exchange(other.pid_, -1)),
      pidfd_(std::exchange(other.pidfd_, -1)),
      log_(std::move(other.log_)),
      end_(other.end_) {}

Child& Child::operator=(Child&& other) noexcept {
  std::swap(party_, other.party_);
  std::swap(guarded_, other.guarded_);
  std::swap(pid_, other.pid_);
  std::swap(pidfd_, other.pidfd_);
  std::swap(log_, other.log_);
  std::swap(end_, other.end_);
  return *this;
}

Child::~Child() {
  if (pid_ > 0) end(0.0);
  if (pidfd_ >= 0) ::close(pidfd_);
}

std::optional<ProcessEnd> Child::ended() {
  if (end_ || pid_ < 0) return end_;
  int status = 0;
  if (::waitpid(pid_, &status, WNOHANG) != pid_) return {};
  end_ =
      WIFSIGNALED(status) ? ProcessEnd{-1, WTERMSIG(status)} : ProcessEnd{WEXITSTATUS(status), 0};
  return end_;
}

std::optional<ProcessEnd> Child::wait(double limit) {
  if (auto done = ended()) return done;
  pollfd item{pidfd_, POLLIN, 0};
  ::poll(&item, 1, static_cast<int>(1000.0 * limit));
  return ended();
}

bool Child::being_taken_down() const {
  std::ifstream stat(fmt::format("/proc/{}/stat", pid_));
  std::string text;
  std::getline(stat, text, '\0');
  // After the name, which may hold anything: state, four numbers of groups and terminals, its
  // foreground, flags.
  std::istringstream fields(text.substr(std::min(text.size(), text.rfind(')') + 1)));
  std::string state;
  long skipped = 0;
  unsigned long flags = 0;
  fields >> state >> skipped >> skipped >> skipped >> skipped >> skipped >> flags;
  constexpr unsigned long exiting = 0x4;  // PF_EXITING of the kernel
  return fields && (state == "Z" || (flags & exiting) != 0);
}

std::optional<ProcessEnd> Child::wait_after_close() {
  if (guarded_) return wait(launcher_patience);
  return wait(being_taken_down() ? take_down_patience : close_patience);
}

void Child::end(double patience) noexcept {
  // A guard gives its launcher 0.7 s and then ends what is left; it must not be killed over that.
  const double term_patience = guarded_ ? 5.0 : 0.5;
  if (pid_ < 0) return;
  if (!wait(patience)) {
    ::kill(-pid_, SIGTERM);
    ::kill(-pid_, SIGCONT);  // a stopped process must run to die
    if (!wait(term_patience)) {
      ::kill(-pid_, SIGKILL);
      static_cast<void>(wait(5.0));
    }
  }
  // What the solver itself started must not outlive it.
  ::kill(-pid_, SIGKILL);
  pid_ = -1;
}

std::vector<std::string> split_command(const std::string& command) {
  std::vector<std::string> words;
  bool inside = false;
  char quote = '\0';
  for (const char c : command) {
    if (quote != '\0') {
      if (c == quote)
        quote = '\0';
      else
        words.back() += c;
      continue;
    }
    if (c == ' ' || c == '\t') {
      inside = false;
      continue;
    }
    if (!inside) words.emplace_back();
    inside = true;
    if (c == '\'' || c == '"')
      quote = c;
    else
      words.back() += c;
  }
  return words;
}

std::string tail_of(const std::filesystem::path& file, int lines) {
  std::ifstream in(file);
  std::deque<std::string> last;
  std::string line;
  while (std::getline(in, line)) {
    last.push_back(line);
    if (last.size() > static_cast<std::size_t>(lines)) last.pop_front();
  }
  std::string text;
  for (const auto& l : last) text += "  | " + l + "\n";
  return text;
}

}  // namespace ocublast::coupler
