#include "flow_solver/numerics/field_memory.hpp"

#include <sys/mman.h>

#include <cstdlib>
#include <new>
#include <utility>

namespace ocublast::flow::inline OCU_PRECISION {
namespace {

constexpr std::size_t huge_page = std::size_t{2} << 20;
// Nodes before node 0 of a row: a whole vector, so that node 0 is aligned and the four ghosts fit.
constexpr std::ptrdiff_t row_front = tile_width;
// Extra cache lines per plane against planes that fall on the same cache sets.
constexpr std::ptrdiff_t plane_pad = 5 * tile_width;
// Kernels may read (never use) a few nodes before the first and behind the last row.
constexpr std::ptrdiff_t margin = 8 * tile_width;

}  // namespace

FieldMemory::FieldMemory(const Grid& grid, int n_fields, bool ghost_rows) {
  const auto ghosts = [&](int a) {
    return ghost_rows ? grid.axis[static_cast<std::size_t>(a)].ghosts() : 0;
  };
  const std::ptrdiff_t row =
      row_front + (grid.axis[0].n + n_ghost + tile_width - 1) / tile_width * tile_width;
  block_.sf = row;
  block_.sj = row * n_fields;
  block_.sk = block_.sj * (grid.axis[1].n + 2 * ghosts(1)) + plane_pad;
  const std::ptrdiff_t count = block_.sk * (grid.axis[2].n + 2 * ghosts(2)) + 2 * margin;
  allocate(static_cast<std::size_t>(count));
  block_.data = memory_ + margin + row_front + ghosts(1) * block_.sj + ghosts(2) * block_.sk;
}

FieldMemory::FieldMemory(std::size_t count) {
  allocate(count);
}

void FieldMemory::allocate(std::size_t count) {
  const std::size_t bytes = (count * sizeof(Real) + huge_page - 1) / huge_page * huge_page;
  void* raw = std::aligned_alloc(huge_page, bytes);
  if (raw == nullptr) throw std::bad_alloc();
  // Advice only; without huge pages everything works, 2 to 8 % slower.
  static_cast<void>(madvise(raw, bytes, MADV_HUGEPAGE));
  memory_ = static_cast<Real*>(raw);
  size_ = count;
}

FieldMemory::~FieldMemory() {
  std::free(memory_);
}

FieldMemory::FieldMemory(FieldMemory&& other) noexcept
    : memory_(std::exchange(other.memory_, nullptr)),
      size_(std::exchange(other.size_, 0)),
      block_(std::exchange(other.block_, {})) {}

FieldMemory& FieldMemory::operator=(FieldMemory&& other) noexcept {
  std::swap(memory_, other.memory_);
  std::swap(size_, other.size_);
  std::swap(block_, other.block_);
  return *this;
}

}  // namespace ocublast::flow
