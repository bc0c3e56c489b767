#pragma once

#include <cstddef>
#include <span>

#include "flow_solver/grid/grid.hpp"
#include "flow_solver/numerics/kernel.hpp"

namespace ocublast::flow {

/// One aligned allocation (2 MiB, huge pages asked for) that holds fields in rows [k][j][f][i].
class FieldMemory {
 public:
  FieldMemory() = default;
  /// Room for n_fields on the grid; ghost rows and planes in y and z only where asked.
  FieldMemory(const Grid& grid, int n_fields, bool ghost_rows);
  ~FieldMemory();
  FieldMemory(FieldMemory&& other) noexcept;
  FieldMemory& operator=(FieldMemory&& other) noexcept;
  FieldMemory(const FieldMemory&) = delete;
  FieldMemory& operator=(const FieldMemory&) = delete;

  [[nodiscard]] const Block& block() const { return block_; }
  [[nodiscard]] std::span<double> all() const { return {memory_, size_}; }

 private:
  double* memory_ = nullptr;
  std::size_t size_ = 0;
  Block block_;
};

}  // namespace ocublast::flow
