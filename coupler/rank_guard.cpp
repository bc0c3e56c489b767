#include "coupler/rank_guard.hpp"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <ctime>

namespace ocublast::coupler {
namespace {

/// After SIGTERM mpirun ends its ranks by SIGTERM, and after a second by SIGKILL; ranks that wait
/// in MPI die of the first. All others have to be gone within a second of a death.
constexpr long launcher_patience_ns = 700'000'000;
constexpr long nap_ns = 2'000'000;

void watch(sigset_t& signals) noexcept {
  ::sigemptyset(&signals);
  constexpr int watched[] = {SIGCHLD, SIGTERM, SIGINT, SIGHUP};
  for (const int number : watched) ::sigaddset(&signals, number);
  ::sigprocmask(SIG_SETMASK, &signals, nullptr);
}

/// Keeps standard input, and the log as output: the coupler's locks, sockets and pipes are not
/// ours.
void close_all_but(int log_fd) noexcept {
  ::dup2(log_fd, STDOUT_FILENO);
  ::dup2(log_fd, STDERR_FILENO);
  if (::syscall(SYS_close_range, 3U, ~0U, 0U) == 0) return;
  for (int fd = 3; fd < 4096; ++fd) ::close(fd);  // a kernel before 5.9
}

/// SIGKILL to every child of this process, which is a single thread; not to their children.
void kill_children() noexcept {
  char path[64] = "/proc/self/task/";
  char* const end = std::to_chars(path + 16, path + 48, ::getpid()).ptr;
  constexpr char leaf[] = "/children";
  for (std::size_t i = 0; i < sizeof leaf; ++i) end[i] = leaf[i];
  const int fd = ::open(path, O_RDONLY | O_CLOEXEC);
  if (fd < 0) return;
  pid_t pid = 0;
  char text[512];
  for (ssize_t n = ::read(fd, text, sizeof text); n > 0; n = ::read(fd, text, sizeof text))
    for (ssize_t i = 0; i < n; ++i) {
      if (text[i] >= '0' && text[i] <= '9') {
        pid = 10 * pid + (text[i] - '0');
        continue;
      }
      if (pid > 0) ::kill(pid, SIGKILL);
      pid = 0;
    }
  ::close(fd);
}

/// Kills generation after generation: the children of the dead become ours, until there are none.
void end_all_descendants() noexcept {
  const timespec nap{0, nap_ns};
  while (true) {
    kill_children();
    pid_t pid = 0;
    while ((pid = ::waitpid(-1, nullptr, WNOHANG)) > 0) {
    }
    if (pid < 0 && errno == ECHILD) return;
    ::nanosleep(&nap, nullptr);
  }
}

[[noreturn]] void end_like(int status) noexcept {
  if (!WIFSIGNALED(status)) ::_exit(WEXITSTATUS(status));
  const rlimit no_core{0, 0};
  ::setrlimit(RLIMIT_CORE, &no_core);
  sigset_t none;
  ::sigemptyset(&none);
  ::signal(WTERMSIG(status), SIG_DFL);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
  ::kill(::getpid(), WTERMSIG(status));
  ::_exit(128 + WTERMSIG(status));
}

timespec in_time(long ns) noexcept {
  timespec at{};
  ::clock_gettime(CLOCK_MONOTONIC, &at);
  at.tv_nsec += ns;
  at.tv_sec += at.tv_nsec / 1'000'000'000;
  at.tv_nsec %= 1'000'000'000;
  return at;
}

bool passed(const timespec& deadline) noexcept {
  const timespec now = in_time(0);
  return now.tv_sec != deadline.tv_sec ? now.tv_sec > deadline.tv_sec
                                       : now.tv_nsec >= deadline.tv_nsec;
}

/// Waits until the launcher has ended, or has been told to and did not in time; its status,
/// SIGKILL's where it did not.
int await_launcher(pid_t launcher, const sigset_t& signals) noexcept {
  bool told = false;
  timespec deadline{};
  while (!told || !passed(deadline)) {
    int status = 0;
    pid_t pid = 0;
    while ((pid = ::waitpid(-1, &status, WNOHANG)) > 0)
      if (pid == launcher) return status;
    if (pid < 0 && errno == ECHILD) return SIGKILL;
    const timespec nap{0, 20 * nap_ns}, day{86'400, 0};
    const int number = ::sigtimedwait(&signals, nullptr, told ? &nap : &day);
    if (told || number <= 0 || number == SIGCHLD) continue;
    told = true;
    deadline = in_time(launcher_patience_ns);
    ::kill(-launcher, SIGTERM);
    ::kill(-launcher, SIGCONT);  // a stopped process must run to die
  }
  return SIGKILL;  // as wait reports it
}

}  // namespace

void become(const Launch& launch) noexcept {
  ::setpgid(0, 0);
  ::prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (::getppid() != launch.parent) ::_exit(1);  // it died in between
  sigset_t none;
  ::sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
  ::dup2(launch.log_fd, STDOUT_FILENO);
  ::dup2(launch.log_fd, STDERR_FILENO);
  ::execvpe(launch.argv[0], launch.argv, launch.envp);
  const int error = errno;
  static_cast<void>(!::write(launch.report_fd, &error, sizeof error));
  ::_exit(127);
}

void stand_guard(const Launch& launch) noexcept {
  sigset_t signals;
  watch(signals);
  ::setpgid(0, 0);
  ::prctl(PR_SET_NAME, "rank_guard");
  ::prctl(PR_SET_CHILD_SUBREAPER, 1);
  ::prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (::getppid() != launch.parent) ::_exit(1);
  Launch own = launch;
  own.parent = ::getpid();
  const pid_t launcher = ::fork();
  if (launcher == 0) become(own);
  if (launcher < 0) {
    const int error = errno;
    static_cast<void>(!::write(launch.report_fd, &error, sizeof error));
    ::_exit(127);
  }
  ::setpgid(launcher, launcher);  // before anybody signals its group, whoever of both comes first
  close_all_but(launch.log_fd);
  const int status = await_launcher(launcher, signals);
  end_all_descendants();
  end_like(status);
}

}  // namespace ocublast::coupler
