#include "flow_solver/ranks/cut_borders.hpp"

#include <algorithm>
#include <cmath>

#include "flow_solver/grid/fields.hpp"

namespace ocublast::flow::inline OCU_PRECISION {
namespace {

/// Nodes beyond which a closure changes no flux at the border by more than rounding: the inverse of
/// tri(alpha, 1, alpha) falls by this from node to node.
int reach_of(double alpha, int known) {
  const double decay =
      alpha > 0.0 ? (1.0 - std::sqrt(1.0 - 4.0 * alpha * alpha)) / (2.0 * alpha) : 0.5;
  return known + n_ghost +
         static_cast<int>(std::ceil(std::log(0.1 * least_weight) / std::log(decay)));
}

constexpr int class_of_component(int axis, int q) {
  if (q == 0 || q == 4) return 0;
  return q == 1 + axis ? 1 : 2;
}

bool is_mirrored(LineEnd end) {
  return end == LineEnd::mirrored_slip || end == LineEnd::held_wall;
}

}  // namespace

CutBorders::CutBorders(const RankPart& part, int axis, LineSolve solve, const WholeLine& line)
    : part_(&part),
      axis_(axis),
      solve_(solve),
      line_(line),
      known_(known_faces(solve, line.scheme)) {
  const double alpha = solve == LineSolve::filter ? line.scheme.filter_alpha
                                                  : make_flux_end_rows(line.scheme).alpha[4];
  reach_ = reach_of(alpha, known_);
}

const CutBorders::Weights* CutBorders::weights_for(const Key& key) {
  std::unique_ptr<Weights>& held = weights_[key];
  if (held) return held.get();
  const auto [below, wall_low, above, wall_high, first, last] = key;
  // A segment that is cut off here ends like a wall: what lies there has no weight.
  const WholeLine segment{.n = below + above,
                          .low = wall_low || below == reach_ ? LineEnd::ghosted : line_.low,
                          .high = wall_high || above == reach_ ? LineEnd::ghosted : line_.high,
                          .scheme = line_.scheme};
  const int begin = first + below, end = last + below;
  const BorderWeights w = make_border_weights(segment, solve_, below, begin, end);
  held = std::make_unique<Weights>();
  // Of a segment that is cut off the "ghosts" are nodes far away.
  int from = w.first, to = w.last;
  if (!wall_low && below == reach_) from = std::max(from, -begin);
  if (!wall_high && above == reach_) to = std::min(to, segment.n - begin);
  if (from >= to) return held.get();
  held->first = from + begin - below;
  held->last = to + begin - below;
  const auto faces = static_cast<std::size_t>(w.faces);
  for (std::size_t c = 0; c < n_classes; ++c) {
    for (std::size_t m = 0; m < faces; ++m) {
      for (int i = from; i < to; ++i)
        held->weight.push_back(
            w.weight[(static_cast<std::size_t>(i - w.first) * faces + m) * n_classes + c]);
    }
  }
  return held.get();
}

void CutBorders::take(const CutLines& lines, const std::vector<int>& borders) {
  lines_.clear();
  const auto a = static_cast<std::size_t>(axis_);
  const std::size_t b_of = axis_ == 0 ? 1 : 0, c_of = axis_ == 2 ? 1 : 2;
  const int own_begin = part_->begin[a], own_end = part_->end[a];
  for (const Segment& s : lines.segments) {
    if (s.b < part_->begin[b_of] || s.b >= part_->end[b_of] || s.c < part_->begin[c_of] ||
        s.c >= part_->end[c_of])
      continue;
    for (std::size_t n = 0; n < borders.size(); ++n) {
      const int border = part_->blocks.begin[a][static_cast<std::size_t>(borders[n])];
      if (border <= s.begin || border >= s.end) continue;
      const int below = border - s.begin, above = s.end - border;
      if ((s.wall_low < 0 || below >= reach_) && (s.wall_high < 0 || above >= reach_)) continue;
      Line line{.sum = static_cast<int>(n),
                .b = s.b - part_->begin[b_of],
                .c = s.c - part_->begin[c_of],
                .border = border - own_begin,
                .begin = s.begin - own_begin,
                .end = s.end - own_begin,
                .wall_low = s.wall_low,
                .wall_high = s.wall_high};
      const int low = std::min(below, reach_), high = std::min(above, reach_);
      const int first = std::max(own_begin - border, -low), last = std::min(own_end - border, high);
      if (first < last) {
        const bool wall_low = s.wall_low >= 0 && below < reach_,
                   wall_high = s.wall_high >= 0 && above < reach_;
        line.weights = weights_for({low, wall_low, high, wall_high, first, last});
      }
      lines_.push_back(line);
    }
  }
}

void CutBorders::load(const Context& ctx, const Line& line, double* values,
                      std::ptrdiff_t stride) const {
  const Block &w = ctx.W, &a = ctx.A;
  const auto along = [&](const Block& block) {
    return axis_ == 0 ? 1 : (axis_ == 1 ? block.sj : block.sk);
  };
  const auto at = [&](const Block& block) {
    if (axis_ == 0) return block.data + line.b * block.sj + line.c * block.sk;
    return block.data + line.b + line.c * (axis_ == 1 ? block.sk : block.sj);
  };
  const Real *state = at(w), *kept = at(a);
  const std::ptrdiff_t sl = along(w), al = along(a);
  const double inverse_gm1 = 1.0 / (ctx.gamma - 1.0);
  for (int n = line.weights->first; n < line.weights->last; ++n) {
    const int i = line.border + n;
    double* out = values + (n - line.weights->first);
    const bool inside = i >= line.begin && i < line.end;
    if (solve_ == LineSolve::filter && inside) {
      for (int f = 0; f < 5; ++f) out[f * stride] = kept[i * al + f * a.sf];
      continue;
    }
    const int wall = i < line.begin ? line.wall_low : (i >= line.end ? line.wall_high : -1);
    const int layer = i < line.begin ? line.begin - 1 - i : i - line.end;
    double v[5];
    for (int f = 0; f < 5; ++f) {
      v[f] =
          wall >= 0
              ? ctx.wall_ghost[axis_][(static_cast<std::ptrdiff_t>(wall) * n_ghost + layer) * 5 + f]
              : state[i * sl + f * w.sf];
    }
    const double p = v[0] * ctx.gas_constant * v[4];
    const double energy = p * inverse_gm1 + 0.5 * v[0] * (v[1] * v[1] + v[2] * v[2] + v[3] * v[3]);
    if (solve_ == LineSolve::filter) {
      out[0] = v[0];
      for (int f = 1; f < 4; ++f) out[f * stride] = v[0] * v[f];
      out[4 * stride] = energy;
      continue;
    }
    // The bulk pressure is even about a mirrored end, else beyond the end that of the last node.
    int smooth = std::clamp(i, line.begin, line.end - 1);
    if (wall < 0 && i < line.begin && is_mirrored(line_.low)) smooth = line.begin + layer;
    if (wall < 0 && i >= line.end && is_mirrored(line_.high)) smooth = line.end - 1 - layer;
    const double total = p + (ctx.bulk ? state[smooth * sl + field_bulk * w.sf] : 0.0);
    const double u_n = v[1 + axis_];
    out[0] = v[0] * u_n;
    for (int f = 1; f < 4; ++f)
      out[f * stride] = v[0] * u_n * v[f] + (f == 1 + axis_ ? total - ctx.rest_pressure : 0.0);
    out[4 * stride] = u_n * (energy + total);
  }
}

void CutBorders::sum_line(const Context& ctx, const Line& line, std::vector<double>& values,
                          Real* out) const {
  const int faces = 2 * known_ - 1;
  const int n = line.weights == nullptr ? 0 : line.weights->last - line.weights->first;
  values.resize(5 * static_cast<std::size_t>(n));
  if (n > 0) load(ctx, line, values.data(), n);
  for (int m = 0; m < faces; ++m) {
    for (int q = 0; q < 5; ++q) {
      double sum = 0.0;
      if (n > 0) {
        const double* weight =
            line.weights->weight.data() +
            static_cast<std::ptrdiff_t>(class_of_component(axis_, q) * faces + m) * n;
        const double* value = values.data() + static_cast<std::ptrdiff_t>(q) * n;
#pragma omp simd reduction(+ : sum)
        for (int i = 0; i < n; ++i) sum += weight[i] * value[i];
      }
      out[(m * 5 + q) * tile_width] = static_cast<Real>(sum);
    }
  }
}

void CutBorders::put(const Context& ctx, const std::vector<BorderSum>& sums, int threads) const {
  const auto n = static_cast<std::ptrdiff_t>(lines_.size());
  const std::ptrdiff_t groups = axis_ == 0 ? ctx.mask_groups : ctx.mask_tiles;
#pragma omp parallel num_threads(threads) if (n > 64)
  {
    std::vector<double> values;
#pragma omp for schedule(static)
    for (std::ptrdiff_t l = 0; l < n; ++l) {
      const Line& line = lines_[static_cast<std::size_t>(l)];
      const BorderSum& sum = sums[static_cast<std::size_t>(line.sum)];
      const std::ptrdiff_t group = line.c * groups + line.b / tile_width;
      sum_line(ctx, line, values,
               sum.out + group * sum.faces * 5 * tile_width + line.b % tile_width);
    }
  }
}

}  // namespace ocublast::flow
