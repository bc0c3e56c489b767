#pragma once

#include <cstddef>
#include <span>

#include "flow_solver/grid/grid.hpp"
#include "flow_solver/numerics/kernel.hpp"

namespace ocublast::flow::inline OCU_PRECISION {

/// One aligned allocation (2 MiB, huge pages asked for) that holds fields in rows [k][j][f][i].
class FieldMemory {
 public:
  FieldMemory() = default;
  /// Room for n_fields on the grid; ghost rows and planes in y and z only where asked.
  FieldMemory(const Grid& grid, int n_fields, bool ghost_rows);
  /// Plain room for so many values: a thread's scratch. Vectors that straddle cache lines would
  /// cost twice, which a std::vector does not prevent.
  explicit FieldMemory(std::size_t count);
  ~FieldMemory();
  FieldMemory(FieldMemory&& other) noexcept;
  FieldMemory& operator=(FieldMemory&& other) noexcept;
  FieldMemory(const FieldMemory&) = delete;
  FieldMemory& operator=(const FieldMemory&) = delete;

  [[nodiscard]] const Block& block() const { return block_; }
  [[nodiscard]] std::span<Real> all() const { return {memory_, size_}; }
  [[nodiscard]] Real* data() const { return memory_; }

 private:
  void allocate(std::size_t count);
  Real* memory_ = nullptr;
  std::size_t size_ = 0;
  Block block_;
};

}  // namespace ocublast::flow
