// Border fluxes as weighted sums over nodes, against the line solve itself.

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <vector>

#include "flow_solver/grid/grid.hpp"
#include "flow_solver/ranks/border_weights.hpp"

namespace ocublast::flow {
namespace {

/// Some node value, rough and of order one.
double value(int i) {
  return std::sin(1.3 * i) + 0.3 * std::cos(7.1 * i) + 0.01 * i;
}

/// Fluxes of all faces of one class by the eliminated rows; node values as `at` gives them.
template <class At>
std::vector<double> solve(const LineTable& t, LineSolve which, int parity_class, const At& at) {
  const bool filter = which == LineSolve::filter;
  const int weights = filter ? filter_weights : flux_weights;
  std::vector<double> y(static_cast<std::size_t>(t.face_end - t.face_begin + 1));
  const auto row = [&](int j) {
    return (filter ? t.filter : t.flux).data() +
           (j + table_offset) * (filter ? filter_row_size : flux_row_size) +
           parity_class * (weights + 3);
  };
  double before = 0.0;
  for (int j = t.face_begin; j <= t.face_end; ++j) {
    double rhs = 0.0;
    for (int m = 0; m < weights; ++m) {
      if (row(j)[m] != 0.0) rhs += row(j)[m] * (at(j + m) + (filter ? -1.0 : 1.0) * at(j - 1 - m));
    }
    before = y[static_cast<std::size_t>(j - t.face_begin)] = rhs - row(j)[weights] * before;
  }
  for (int j = t.face_end - 1; j >= t.face_begin; --j) {
    const auto s = static_cast<std::size_t>(j - t.face_begin);
    y[s] -= row(j)[weights + 1] * y[s + 1];
  }
  return y;
}

void expect_sums_equal_the_solve(LineEnd low, LineEnd high, LineSolve which, bool eighth) {
  const WholeLine line{.n = 60, .low = low, .high = high, .scheme = {.eighth_order = eighth}};
  const LineTable t = make_line_table(line.n, low, high, line.scheme);
  const int cuts[4] = {0, 9, 30, 60};
  for (int c = 0; c < n_classes; ++c) {
    const auto at = [&](int i) {
      // The filter sees its own nodes beyond a plane of symmetry.
      const bool mirror = which == LineSolve::filter;
      if (i < 0 && mirror && low == LineEnd::mirrored_slip)
        return (c == 1 ? -1.0 : 1.0) * value(-1 - i);
      if (i >= line.n && mirror && high == LineEnd::mirrored_slip)
        return (c == 1 ? -1.0 : 1.0) * value(2 * line.n - 1 - i);
      return value(i);
    };
    const auto exact = solve(t, which, c, at);
    for (const int border : {9, 30}) {
      const int known = known_faces(which, line.scheme);
      for (int face = border - known + 1; face < border + known; ++face) {
        double sum = 0.0;
        for (int p = 0; p < 3; ++p) {
          const BorderWeights w = make_border_weights(line, which, border, cuts[p], cuts[p + 1]);
          for (int i = w.first; i < w.last; ++i) {
            const auto m = static_cast<std::size_t>(face - border + known - 1);
            const auto weight = [&](std::size_t of) {
              return w.weight[((static_cast<std::size_t>(i - w.first)) *
                                   static_cast<std::size_t>(w.faces) +
                               of) *
                                  n_classes +
                              static_cast<std::size_t>(c)];
            };
            const bool near = i >= w.near_first && i < w.near_last;
            const double ratio = w.ratio[m * n_classes + static_cast<std::size_t>(c)];
            sum += (near ? weight(m) : ratio * weight(0)) * value(i + cuts[p]);
          }
        }
        // Sixty terms of order one, each to 1e-16, and what least_weight drops: 2 x 3e-15.
        EXPECT_NEAR(sum, exact[static_cast<std::size_t>(face - t.face_begin)], 1.6e-14)
            << "face " << face << " class " << c;
      }
    }
  }
}

TEST(BorderWeights, AddUpToTheFluxesOfTheWholeLine) {
  for (const LineSolve which : {LineSolve::flux, LineSolve::filter}) {
    for (const bool eighth : {false, true}) {
      expect_sums_equal_the_solve(LineEnd::ghosted, LineEnd::mirrored_slip, which, eighth);
      expect_sums_equal_the_solve(LineEnd::held_wall, LineEnd::ghosted, which, eighth);
    }
  }
}

TEST(BorderWeights, OfAConstantAreOneOnAPeriodicLine) {
  // Row sums of the inverse times twice those of the right side: 2 (a + b) / (1 + 2 alpha) = 1.
  const WholeLine line{.n = 24, .low = LineEnd::periodic, .high = LineEnd::periodic, .scheme = {}};
  for (const int border : {0, 8, 16}) {
    const BorderWeights w = make_border_weights(line, LineSolve::flux, border, 0, 24);
    for (std::size_t m = 0; m < static_cast<std::size_t>(w.faces); ++m) {
      double sum = 0.0;
      for (std::size_t i = 0; i < 24; ++i)
        sum += w.weight[(i * static_cast<std::size_t>(w.faces) + m) * n_classes];
      EXPECT_NEAR(sum, 1.0, 1e-15);
    }
  }
}

TEST(BorderWeights, ReachAsFarAsTheInverseDecaysToTheLeastWeight) {
  const WholeLine line{.n = 1000, .low = LineEnd::ghosted, .high = LineEnd::ghosted, .scheme = {}};
  // ln(1e-15) / ln(0.382) = 36 nodes for compact 6, 97 for the filter at 0.70, less the amplitude.
  const BorderWeights flux = make_border_weights(line, LineSolve::flux, 500, 500, 1000);
  const BorderWeights filter = make_border_weights(line, LineSolve::filter, 500, 500, 1000);
  EXPECT_NEAR(flux.last, 36, 3);
  EXPECT_NEAR(filter.last, 97, 8);
  EXPECT_TRUE(make_border_weights(line, LineSolve::flux, 500, 600, 1000).weight.empty());
  // All but the stencils' nodes share one sum.
  EXPECT_LE(flux.near_last, 5);
  EXPECT_LE(filter.near_last, 8);
  EXPECT_EQ(flux.near_first, 0);
}

}  // namespace
}  // namespace ocublast::flow
