#include "coupler/base/rank_exchange.hpp"

#define OMPI_SKIP_MPICXX 1
#define MPICH_SKIP_MPICXX 1
#include <mpi.h>

namespace ocublast {
namespace {

constexpr int first_tag = 100;  ///< beyond those of Ranks

}  // namespace

struct RankExchange::Requests {
  std::vector<MPI_Request> list;
  [[nodiscard]] int count() const { return static_cast<int>(list.size()); }
};

RankExchange::RankExchange(const Ranks&, int channel, std::span<const Message> sends,
                           std::span<const Message> receives)
    : requests_(std::make_unique<Requests>()) {
  auto& list = requests_->list;
  const auto length = [](const Message& m) { return static_cast<int>(m.data.size()); };
  for (const auto& m : receives)
    MPI_Recv_init(m.data.data(), length(m), MPI_BYTE, m.peer, first_tag + channel, MPI_COMM_WORLD,
                  &list.emplace_back());
  for (const auto& m : sends)
    MPI_Send_init(m.data.data(), length(m), MPI_BYTE, m.peer, first_tag + channel, MPI_COMM_WORLD,
                  &list.emplace_back());
}

RankExchange::~RankExchange() {
  int over = 0;
  if (!requests_ || requests_->list.empty()) return;
  MPI_Finalized(&over);
  if (over != 0) return;
  for (auto& request : requests_->list) MPI_Request_free(&request);
}

RankExchange::RankExchange(RankExchange&&) noexcept = default;
RankExchange& RankExchange::operator=(RankExchange&& other) noexcept {
  std::swap(requests_, other.requests_);
  return *this;
}

void RankExchange::start() {
  if (requests_->count() > 0) MPI_Startall(requests_->count(), requests_->list.data());
}

void RankExchange::poll() {
  int done = 0;
  if (requests_->count() > 0)
    MPI_Testall(requests_->count(), requests_->list.data(), &done, MPI_STATUSES_IGNORE);
}

void RankExchange::finish() {
  if (requests_->count() > 0)
    MPI_Waitall(requests_->count(), requests_->list.data(), MPI_STATUSES_IGNORE);
}

}  // namespace ocublast
