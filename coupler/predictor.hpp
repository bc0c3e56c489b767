#pragma once

#include <span>

namespace ocublast::coupler {

/// What is known of the wall at the end of the last window.
struct WallHistory {
  std::span<const double> position;           ///< [n,3] m, at t(n)
  std::span<const double> velocity;           ///< [n,3] m/s, at t(n)
  std::span<const double> velocity_before;    ///< [n,3] m/s, at t(n) - width_before
  double width_before = 0.0;                  ///< s
  std::span<const double> acceleration;       ///< [n,3] m/s^2, at t(n), the solid's own; may be empty
};

/// Predicts the wall `width` [s] after t(n) into `position` and `velocity` [n,3].
/// Order 0: frozen. Order 1: x + w v, v. Order 2: the acceleration of the last window goes on,
///   a = (v(n) - v(n-1)) / w(n-1),  x* = x + w v + w^2 a / 2,  v* = v + w a,
/// which for equal windows is x + w (3/2 v(n) - 1/2 v(n-1)) and 2 v(n) - v(n-1)
/// (Piperno, Farhat, Larrouturou 1995, Comput. Methods Appl. Mech. Engrg. 124, generalised to
/// windows of changing width). With the solid's own acceleration that takes the place of a: central
/// differences then have x* itself at the end of one step (leap-frog across the interface).
void predict_wall(const WallHistory& history, int order, double width, std::span<double> position,
                  std::span<double> velocity) noexcept;

/// Pulls a predicted wall towards the path it is on. `path` and `motion` hold position and velocity
/// [6 n] at the beginning and at the end of a window of this width [s]; `path` takes the end over. A position predicted anew in each window misses
/// the path by some e; the cubic then bends by 6 e / width^2 at its end, and the gas in the first
/// cell, heavy against a thin layer of solid in windows far below the flow's step, answers that with
/// a load. So only `share` of e is made up for in this window:
///   x* <- x' + share (x* - x'),  x' = x_before + width (v_before + v*) / 2.
void keep_to_path(std::span<double> path, double width, double share, std::span<double> motion) noexcept;

}  // namespace ocublast::coupler
