#pragma once

#include <cstddef>

#include "flow_solver/grid/precision.hpp"

namespace ocublast::flow {

/// Primitive variables in the order of storage: density kg/m^3, velocity m/s, temperature K.
enum Primitive : int { prim_rho = 0, prim_u = 1, prim_v = 2, prim_w = 3, prim_T = 4 };
inline constexpr int n_primitive = 5;
/// Where a view of the primitive variables says so, the field behind them: what the scheme's
/// artificial bulk viscosity adds to the pressure, Pa.
inline constexpr int artificial_pressure_field = n_primitive;

/// A set of fields on the grid with ghosts, seen through strides (in elements): field f at node
/// (i, j, k) is data[f * stride_f + i + j * stride_j + k * stride_k], indices from -n_ghost in
/// present directions. Rows of all fields lie side by side: [k][j][f][i].
template <class T>
struct FieldsView {
  T* data = nullptr;  ///< node (0, 0, 0) of field 0
  std::ptrdiff_t stride_f = 0;
  std::ptrdiff_t stride_j = 0;
  std::ptrdiff_t stride_k = 0;
  bool artificial_pressure = false;

  [[nodiscard]] T& operator()(int f, int i, int j, int k) const {
    return data[f * stride_f + i + j * stride_j + k * stride_k];
  }
  /// A reading view of the same fields.
  operator FieldsView<const T>() const {
    return {data, stride_f, stride_j, stride_k, artificial_pressure};
  }
};

}  // namespace ocublast::flow
