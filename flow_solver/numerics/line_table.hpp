#pragma once

#include <type_traits>
#include <utility>
#include <vector>

#include "flow_solver/grid/grid.hpp"
#include "flow_solver/grid/precision.hpp"

namespace ocublast::flow::inline OCU_PRECISION {

/// Values as fields hold them.
template <class T>
[[nodiscard]] std::vector<Real> stored(std::vector<T> values) {
  if constexpr (std::is_same_v<Real, T>)
    return values;
  else
    return {values.begin(), values.end()};
}

/// How a line ends. A mirrored end closes the solve on the end face by parity, a held wall by the
/// known flux there (MirrorRow); a ghosted end runs the solve through the four ghost nodes and
/// closes it there at second order. A known end (a border between ranks) has the fluxes of its last
/// faces given (known_flux_faces, known_filter_faces of them): none of the solved rows reaches
/// beyond it.
enum class LineEnd { mirrored_slip, held_wall, ghosted, periodic, known };

// Rows of one face in the tables, per parity class: right-side weights (three of a flux, four of
// the filter) and lower factor g, all divided by the pivot, upper factor c, and the inverse pivot
// itself: F(j) = weights . differences - g F(j-1), then F(j) -= c F(j+1).
inline constexpr int n_classes = 3;  ///< 0 mass and energy, 1 normal momentum, 2 tangential
inline constexpr int flux_weights = 3;
inline constexpr int filter_weights = 4;
inline constexpr int flux_class_size = flux_weights + 3;
inline constexpr int filter_class_size = filter_weights + 3;
inline constexpr int flux_row_size = n_classes * flux_class_size;
inline constexpr int filter_row_size = n_classes * filter_class_size;
inline constexpr int table_offset = 4;  ///< entry of face or node 0

/// Row of the end face of a mirrored line, by the class of the flux.
enum class MirrorRow {
  zero,  ///< the flux is odd about the end: it vanishes there
  even,  ///< the flux is even
  held,  ///< the ghosts' fluxes are 2 F - f for a known flux F at the wall, which the face takes
};
/// A held wall knows what passes through it: stress and work along the wall and heat (and mass,
/// whose F is zero); only the normal momentum is even. The filter takes nothing through such a
/// wall.
[[nodiscard]] constexpr MirrorRow mirror_row(int parity_class, bool held, bool filter) noexcept {
  if (held && filter) return MirrorRow::zero;
  if (parity_class == 1) return MirrorRow::even;
  return held ? MirrorRow::held : MirrorRow::zero;
}

/// Eliminated tridiagonal systems of the flux and filter solves on lines of one length and ends.
/// Flux: alpha F(j-1) + F(j) + alpha F(j+1) = a [f(j-1)+f(j)] + b [f(j-2)+f(j+1)] + c
/// [f(j-3)+f(j+2)]; filter: the same left side with alpha_f, right side sum of k_m [phi(j+m-1) -
/// phi(j-m)].
template <class T>
struct LineTableOf {
  int n = 0;           ///< nodes
  int face_begin = 0;  ///< first face of the solve (-3 behind ghosts)
  int face_end = 0;    ///< last face of the solve
  bool periodic = false;
  std::vector<T> flux;       ///< [face + table_offset, flux_row_size]
  std::vector<T> filter;     ///< [face + table_offset, filter_row_size]
  std::vector<T> flux_wrap;  ///< periodic: correction vector of the rank-one update [face]
  std::vector<T> filter_wrap;
  double flux_wrap_last = 0.0;   ///< weight of the last face in the update's scalar product
  double flux_wrap_scale = 0.0;  ///< 1 / (1 + v z)
  double filter_wrap_last = 0.0;
  double filter_wrap_scale = 0.0;
};
using LineTable = LineTableOf<double>;  ///< as it is made
using StoredTable = LineTableOf<Real>;  ///< as kernels read it
[[nodiscard]] StoredTable stored(LineTable table);

/// Weights and off-diagonals by distance from a ghosted end, for lines whose ends differ by lane:
/// entry r = 1..3 for a face with r faces to the end, itself included; 4 for the interior.
struct EndRows {
  double alpha[5] = {};
  double weights[5][4] = {};
};

struct LineScheme {
  bool eighth_order = false;  ///< tridiagonal eighth-order fluxes instead of sixth
  double filter_alpha = 0.47;
};

/// Faces at a known end, the border itself included, whose flux must be given: as many as a row of
/// the solve has pairs of nodes.
[[nodiscard]] constexpr int known_flux_faces(bool eighth_order) noexcept {
  return eighth_order ? 3 : 2;
}
inline constexpr int known_filter_faces = 4;

[[nodiscard]] LineTable make_line_table(int n, LineEnd low, LineEnd high, const LineScheme& scheme);

[[nodiscard]] EndRows make_flux_end_rows(const LineScheme& scheme);
[[nodiscard]] EndRows make_filter_end_rows(const LineScheme& scheme);

/// Geometry of a direction by face and node, offset by table_offset.
template <class T>
struct LineMetricOf {
  std::vector<T> inverse_face_spacing;  ///< 1/m, 1/(x(j) - x(j-1)); 0 at the outermost
  std::vector<T> face_jacobian;         ///< m, mean of the neighbouring nodes
  std::vector<T> inverse_jacobian;      ///< 1/m at nodes
  std::vector<T> jacobian;              ///< m at nodes
};
using LineMetric = LineMetricOf<double>;
using StoredMetric = LineMetricOf<Real>;
[[nodiscard]] StoredMetric stored(LineMetric metric);
[[nodiscard]] LineMetric make_line_metric(const Axis& axis);

}  // namespace ocublast::flow
