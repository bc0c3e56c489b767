#pragma once

#include <span>

namespace ocublast::coupler {

/// What is known of the wall at the end of the last window.
struct WallHistory {
  std::span<const double> position;         ///< [n,3] m, at t(n)
  std::span<const double> velocity;         ///< [n,3] m/s, at t(n)
  std::span<const double> velocity_before;  ///< [n,3] m/s, at t(n) - width_before
  double width_before = 0.0;                ///< s
  std::span<const double> acceleration;     ///< [n,3] m/s^2, at t(n), the solid's own; may be empty
};

/// A path that a predicted wall is pulled towards: where it was sent to last, position and velocity
/// [6 n] at the beginning of the window; empty: none. A position predicted anew in each window
/// misses the path by some e; the cubic then bends by 6 e / width^2 at its end, and the gas in the
/// first cell, heavy against a thin layer of solid in windows far below the flow's step, answers
/// that with a load. So only `share` of e is made up for in this window:
///   x* <- x' + share (x* - x'),  x' = x_before + width (v_before + v*) / 2.
struct PathBegin {
  std::span<const double> motion;
  double width = 0.0;  ///< s, of this window, which may begin after t(n)
  double share = 1.0;
};

/// Predicts the wall `width` [s] after t(n) into `position` and `velocity` [n,3].
/// Order 0: frozen. Order 1: x + w v, v. Order 2: the acceleration of the last window goes on,
///   a = (v(n) - v(n-1)) / w(n-1),  x* = x + w v + w^2 a / 2,  v* = v + w a,
/// which for equal windows is x + w (3/2 v(n) - 1/2 v(n-1)) and 2 v(n) - v(n-1)
/// (Piperno, Farhat, Larrouturou 1995, Comput. Methods Appl. Mech. Engrg. 124, generalised to
/// windows of changing width). With the solid's own acceleration that takes the place of a: central
/// differences then have x* itself at the end of one step (leap-frog across the interface).
/// False where a predicted value is not finite: always so where one of x, v or a that it is made of
/// is not.
bool predict_wall(const WallHistory& history, int order, double width, std::span<double> position,
                  std::span<double> velocity, const PathBegin& path = {}) noexcept;

}  // namespace ocublast::coupler
