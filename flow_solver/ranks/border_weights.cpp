#include "flow_solver/ranks/border_weights.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

#include "flow_solver/grid/grid.hpp"

namespace ocublast::flow::inline OCU_PRECISION {
namespace {

/// Weights of the nodes -n_ghost .. n + n_ghost - 1 of an open or mirrored line in the flux of one
/// face: the transposed solve with a one at the face, then the transposed right side.
std::vector<double> face_weights(const LineTable& t, LineSolve solve, int parity_class, int face) {
  const bool filter = solve == LineSolve::filter;
  const int n_weights = filter ? filter_weights : flux_weights;
  const auto& rows = filter ? t.filter : t.flux;
  const int row_size = filter ? filter_row_size : flux_row_size;
  const auto row = [&](int j) {
    return rows.data() + static_cast<std::ptrdiff_t>(j + table_offset) * row_size +
           parity_class * (n_weights + 3);
  };
  std::vector<double> v(static_cast<std::size_t>(t.n + 2 * n_ghost), 0.0);
  // Back substitution F(j) = y(j) - c(j) F(j+1), transposed; then y(j) = r(j) - g(j) y(j-1).
  std::vector<double> bar(static_cast<std::size_t>(t.face_end - t.face_begin + 1), 0.0);
  const auto at = [&](int j) -> double& { return bar[static_cast<std::size_t>(j - t.face_begin)]; };
  at(face) = 1.0;
  for (int j = face; j < t.face_end; ++j) at(j + 1) = -row(j)[n_weights + 1] * at(j);
  for (int j = t.face_end; j > t.face_begin; --j) at(j - 1) -= row(j)[n_weights] * at(j);
  for (int j = t.face_begin; j <= t.face_end; ++j) {
    for (int m = 0; m < n_weights; ++m) {
      const double w = row(j)[m] * at(j);
      if (w == 0.0) continue;
      v[static_cast<std::size_t>(j + m + n_ghost)] += w;
      v[static_cast<std::size_t>(j - 1 - m + n_ghost)] += filter ? -w : w;
    }
  }
  return v;
}

/// The same for a periodic line, nodes 0 .. n - 1: a line without ends, whose weights repeat.
std::vector<double> periodic_weights(const WholeLine& line, LineSolve solve, int face) {
  const int known = known_faces(solve, line.scheme);
  const double alpha = solve == LineSolve::filter ? line.scheme.filter_alpha
                                                  : make_flux_end_rows(line.scheme).alpha[4];
  const double decay =
      alpha > 0.0 ? (1.0 - std::sqrt(1.0 - 4.0 * alpha * alpha)) / (2.0 * alpha) : 0.5;
  const int reach =
      known + static_cast<int>(std::ceil(std::log(1e-5 * least_weight) / std::log(decay)));
  const LineTable t = make_line_table(2 * reach, LineEnd::ghosted, LineEnd::ghosted, line.scheme);
  const std::vector<double> open = face_weights(t, solve, 0, reach);
  std::vector<double> v(static_cast<std::size_t>(line.n), 0.0);
  for (int i = 0; i < 2 * reach; ++i) {
    const int node = ((face + i - reach) % line.n + line.n) % line.n;
    v[static_cast<std::size_t>(node)] += open[static_cast<std::size_t>(i + n_ghost)];
  }
  return v;
}

/// Weights of one face for the nodes first .. last - 1 of the whole line.
std::vector<double> weights_between(const WholeLine& line, const LineTable& t, LineSolve solve,
                                    int parity_class, int face, int first, int last) {
  std::vector<double> out(static_cast<std::size_t>(last - first), 0.0);
  if (line.low == LineEnd::periodic) {
    const auto v = periodic_weights(line, solve, face);
    std::copy(v.begin() + first, v.begin() + last, out.begin());
    return out;
  }
  const auto v = face_weights(t, solve, parity_class, face);
  for (int i = first; i < last; ++i)
    out[static_cast<std::size_t>(i - first)] = v[static_cast<std::size_t>(i + n_ghost)];
  if (solve == LineSolve::flux) return out;
  // The filter's ghosts at a plane of symmetry are the nodes themselves, the normal momentum
  // reversed.
  const double sign = parity_class == 1 ? -1.0 : 1.0;
  for (int m = 0; m < n_ghost; ++m) {
    const auto move = [&](int ghost, int node) {
      if (ghost < first || ghost >= last) return;
      out[static_cast<std::size_t>(node - first)] +=
          sign * out[static_cast<std::size_t>(ghost - first)];
      out[static_cast<std::size_t>(ghost - first)] = 0.0;
    };
    if (line.low == LineEnd::mirrored_slip) move(-1 - m, m);
    if (line.high == LineEnd::mirrored_slip) move(line.n + m, line.n - 1 - m);
  }
  return out;
}

/// Finds the nodes that need a sum for every face: those that differ from the ratios, taken where
/// the weights are largest but for a stencil next to the border, by more than the least weight.
void find_ratios(BorderWeights& w) {
  const auto faces = static_cast<std::size_t>(w.faces);
  const int n = w.last - w.first;
  const auto at = [&](int i, std::size_t m, std::size_t c) {
    return w.weight[(static_cast<std::size_t>(i) * faces + m) * n_classes + c];
  };
  w.near_first = w.first;
  w.near_last = w.last;
  w.ratio.assign(faces * n_classes, 0.0);
  if (n <= 2 * w.faces) return;
  // The block lies on one side of the border; its node next to it has the largest weights.
  const bool above = std::abs(at(0, faces - 1, 0)) > std::abs(at(n - 1, faces - 1, 0));
  const int reference = above ? w.faces : n - 1 - w.faces;
  for (std::size_t c = 0; c < n_classes; ++c) {
    if (at(reference, 0, c) == 0.0) return;
    for (std::size_t m = 0; m < faces; ++m)
      w.ratio[m * n_classes + c] = at(reference, m, c) / at(reference, 0, c);
  }
  const auto follows = [&](int i) {
    for (std::size_t m = 0; m < faces; ++m) {
      for (std::size_t c = 0; c < n_classes; ++c) {
        if (std::abs(at(i, m, c) - w.ratio[m * n_classes + c] * at(i, 0, c)) > least_weight)
          return false;
      }
    }
    return true;
  };
  int first = 0, last = n;
  while (first < last && follows(first)) ++first;
  while (last > first && follows(last - 1)) --last;
  w.near_first = w.first + first;
  w.near_last = w.first + last;
}

}  // namespace

BorderWeights make_border_weights(const WholeLine& line, LineSolve solve, int border, int begin,
                                  int end) {
  const bool periodic = line.low == LineEnd::periodic;
  const int known = known_faces(solve, line.scheme);
  const int first = begin == 0 && !periodic ? -n_ghost : begin;
  const int last = end == line.n && !periodic ? line.n + n_ghost : end;
  const LineTable t =
      periodic ? LineTable{} : make_line_table(line.n, line.low, line.high, line.scheme);
  BorderWeights out;
  out.faces = 2 * known - 1;
  const auto faces = static_cast<std::size_t>(out.faces);
  std::vector<std::array<double, n_classes>> all(static_cast<std::size_t>(last - first) * faces);
  for (std::size_t m = 0; m < faces; ++m) {
    const int face = border - known + 1 + static_cast<int>(m);
    for (int c = 0; c < n_classes; ++c) {
      const auto v = weights_between(line, t, solve, c, face, first, last);
      for (std::size_t i = 0; i < v.size(); ++i)
        all[i * faces + m][static_cast<std::size_t>(c)] = v[i];
    }
  }
  const auto counts = [&](int node) {
    for (std::size_t m = 0; m < faces; ++m) {
      for (const double w : all[static_cast<std::size_t>(node - first) * faces + m]) {
        if (std::abs(w) >= least_weight) return true;
      }
    }
    return false;
  };
  int from = first, to = last;
  while (from < to && !counts(from)) ++from;
  while (to > from && !counts(to - 1)) --to;
  out.first = from - begin;
  out.last = to - begin;
  for (int i = from; i < to; ++i) {
    for (std::size_t m = 0; m < faces; ++m) {
      const auto& w = all[static_cast<std::size_t>(i - first) * faces + m];
      out.weight.insert(out.weight.end(), w.begin(), w.end());
    }
  }
  find_ratios(out);
  return out;
}

}  // namespace ocublast::flow
