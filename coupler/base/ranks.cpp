#include "coupler/base/ranks.hpp"

// The C interface only: the C++ one was removed from MPI.
#define OMPI_SKIP_MPICXX 1
#define MPICH_SKIP_MPICXX 1
#include <fmt/format.h>
#include <mpi.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <exception>
#include <optional>
#include <thread>

#include "coupler/base/errors.hpp"

namespace ocublast {
namespace {

/// A single MPI message holds at most this many bytes (its count is an int).
constexpr std::size_t largest_message = std::size_t{1} << 30;
constexpr int tag = 1;
/// A rank other than the root gives the root this long to tell the same fault first.
constexpr auto courtesy = std::chrono::milliseconds(500);

bool started_by_mpirun() {
  return std::getenv("OMPI_COMM_WORLD_SIZE") != nullptr || std::getenv("PMI_SIZE") != nullptr;
}

void send(std::span<const std::byte> bytes, int to) {
  for (std::size_t at = 0; at < bytes.size(); at += largest_message)
    MPI_Send(bytes.data() + at, static_cast<int>(std::min(largest_message, bytes.size() - at)),
             MPI_BYTE, to, tag, MPI_COMM_WORLD);
}

void receive(std::span<std::byte> bytes, int from) {
  for (std::size_t at = 0; at < bytes.size(); at += largest_message)
    MPI_Recv(bytes.data() + at, static_cast<int>(std::min(largest_message, bytes.size() - at)),
             MPI_BYTE, from, tag, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
}

/// What went wrong on a rank, in a form that travels.
struct Fault {
  ExitCode code = ExitCode::done;
  std::string text;
};

Fault current_fault() {
  try {
    throw;
  } catch (const CaseError& error) {
    return {ExitCode::bad_case, error.what()};
  } catch (const LinkError& error) {
    return {ExitCode::link, error.what()};
  } catch (const NumericsError& error) {
    return {ExitCode::numerics, error.what()};
  } catch (const std::exception& error) {
    return {ExitCode::other, error.what()};
  } catch (...) {
    return {ExitCode::other, "unknown exception"};
  }
}

[[noreturn]] void throw_fault(const Fault& fault) {
  switch (fault.code) {
    case ExitCode::bad_case:
      throw CaseError(fault.text);
    case ExitCode::link:
      throw LinkError(fault.text);
    case ExitCode::numerics:
      throw NumericsError(fault.text);
    case ExitCode::done:
    case ExitCode::other:
      break;
  }
  throw std::runtime_error(fault.text);
}

}  // namespace

Ranks::Ranks() {
  if (!started_by_mpirun()) return;
  int granted = 0;
  if (MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &granted) != MPI_SUCCESS ||
      granted < MPI_THREAD_FUNNELED)
    throw LinkError("MPI does not start, or not for programs with threads; see mpirun's message");
  MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
  MPI_Comm_size(MPI_COMM_WORLD, &size_);
  MPI_Comm here = MPI_COMM_NULL;
  MPI_Comm_split_type(MPI_COMM_WORLD, MPI_COMM_TYPE_SHARED, rank_, MPI_INFO_NULL, &here);
  MPI_Comm_size(here, &on_this_host_);
  MPI_Comm_free(&here);
}

Ranks::~Ranks() {
  int initialised = 0;
  MPI_Initialized(&initialised);
  if (initialised != 0) MPI_Finalize();
}

void Ranks::wait_for_all() const {
  if (!alone()) MPI_Barrier(MPI_COMM_WORLD);
}

void Ranks::await_root() const {
  if (alone()) return;
  MPI_Request all_here = MPI_REQUEST_NULL;
  MPI_Ibarrier(MPI_COMM_WORLD, &all_here);
  constexpr auto longest = std::chrono::microseconds(200);
  auto pause = std::chrono::microseconds(5);
  int done = 0;
  while (!root() && done == 0) {
    MPI_Test(&all_here, &done, MPI_STATUS_IGNORE);
    if (done == 0) std::this_thread::sleep_for(pause);
    pause = std::min(2 * pause, longest);
  }
  MPI_Wait(&all_here, MPI_STATUS_IGNORE);
}

double Ranks::min_of_all(double value) const {
  if (!alone()) MPI_Allreduce(MPI_IN_PLACE, &value, 1, MPI_DOUBLE, MPI_MIN, MPI_COMM_WORLD);
  return value;
}

double Ranks::max_of_all(double value) const {
  max_of_all(std::span<double>(&value, 1));
  return value;
}

void Ranks::max_of_all(std::span<double> values) const {
  if (!alone())
    MPI_Allreduce(MPI_IN_PLACE, values.data(), static_cast<int>(values.size()), MPI_DOUBLE, MPI_MAX,
                  MPI_COMM_WORLD);
}

bool Ranks::any_of_all(bool value) const {
  int any = value ? 1 : 0;
  if (!alone()) MPI_Allreduce(MPI_IN_PLACE, &any, 1, MPI_INT, MPI_MAX, MPI_COMM_WORLD);
  return any != 0;
}

void Ranks::sum_of_all(std::span<double> values) const {
  if (alone()) return;
  const std::size_t n = values.size();
  std::vector<double> all(n * static_cast<std::size_t>(size_));
  MPI_Allgather(values.data(), static_cast<int>(n), MPI_DOUBLE, all.data(), static_cast<int>(n),
                MPI_DOUBLE, MPI_COMM_WORLD);
  for (std::size_t i = 0; i < n; ++i) {
    double sum = all[i];
    for (std::size_t from = 1; from < static_cast<std::size_t>(size_); ++from)
      sum += all[from * n + i];
    values[i] = sum;
  }
}

double Ranks::sum_of_all(double value) const {
  sum_of_all(std::span<double>(&value, 1));
  return value;
}

std::string Ranks::broadcast(std::string text, int root) const {
  if (alone()) return text;
  std::size_t length = text.size();
  broadcast(std::span<std::size_t>(&length, 1), root);
  text.resize(length);
  broadcast(std::span<char>(text.data(), length), root);
  return text;
}

void Ranks::broadcast_bytes(std::span<std::byte> bytes, int root) const {
  if (alone()) return;
  for (std::size_t at = 0; at < bytes.size(); at += largest_message)
    MPI_Bcast(bytes.data() + at, static_cast<int>(std::min(largest_message, bytes.size() - at)),
              MPI_BYTE, root, MPI_COMM_WORLD);
}

void Ranks::gather_bytes(std::span<const std::byte> mine,
                         const std::function<std::span<std::byte>(int, std::size_t)>& room) const {
  if (!root()) {
    const std::size_t bytes = mine.size();
    send(std::as_bytes(std::span<const std::size_t>(&bytes, 1)), 0);
    send(mine, 0);
    return;
  }
  const auto own = room(0, mine.size());
  std::copy(mine.begin(), mine.end(), own.begin());
  for (int from = 1; from < size_; ++from) {
    std::size_t bytes = 0;
    receive(std::as_writable_bytes(std::span<std::size_t>(&bytes, 1)), from);
    receive(room(from, bytes), from);
  }
}

void Ranks::scatter_bytes(std::span<const std::span<const std::byte>> parts,
                          std::span<std::byte> mine) const {
  if (!root()) {
    receive(mine, 0);
    return;
  }
  for (int to = 1; to < size_; ++to) send(parts[static_cast<std::size_t>(to)], to);
  std::copy(parts[0].begin(), parts[0].end(), mine.begin());
}

void Ranks::together(const std::function<void()>& work) const {
  if (alone()) {
    work();
    return;
  }
  Fault fault;
  int failed = size_;  // rank
  try {
    work();
  } catch (...) {
    fault = current_fault();
    failed = rank_;
  }
  MPI_Allreduce(MPI_IN_PLACE, &failed, 1, MPI_INT, MPI_MIN, MPI_COMM_WORLD);
  if (failed == size_) return;
  broadcast(std::span<ExitCode>(&fault.code, 1), failed);
  fault.text = broadcast(fault.text, failed);
  throw_fault(fault);
}

int run_on_ranks(const std::string& program,
                 const std::function<int(const Ranks&)>& body) noexcept {
  std::optional<Ranks> ranks;
  try {
    ranks.emplace();
    return body(*ranks);
  } catch (...) {
    if (!ranks || ranks->alone()) return report_current_exception(program);
    if (!ranks->root()) std::this_thread::sleep_for(courtesy);
    const int code = report_current_exception(
        ranks->root() ? program : fmt::format("{} (rank {})", program, ranks->rank()));
    MPI_Abort(MPI_COMM_WORLD, code);
    return code;
  }
}

}  // namespace ocublast
