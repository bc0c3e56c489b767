#pragma once

#include <span>
#include <vector>

namespace ocublast::flow {

/// Motion of a body's vertices over one interval: the cubic through positions and velocities at
/// both ends, or a straight line. Position, velocity and acceleration at any time follow from it,
/// so that the three are consistent. All arrays [n_vertices, 3], SI units.
class WallPath {
 public:
  /// At rest at `position` for all times.
  explicit WallPath(std::span<const double> position);

  /// From the state the last interval ended with to the given one.
  void set_cubic(double t_begin, double t_end, std::span<const double> position_end,
                 std::span<const double> velocity_end);
  void set_straight(double t_begin, double t_end, std::span<const double> position_end);

  /// State at time t. Before the interval its first position, after it its last one, at rest.
  void evaluate(double t, std::vector<double>& position, std::vector<double>& velocity,
                std::vector<double>& acceleration) const;
  /// Largest speed [m/s] of vertex v at the ends and in the middle of the interval.
  [[nodiscard]] double largest_speed(std::size_t v) const;

  /// The wall as a checkpoint found it: this state at any time, and the start of the next path.
  void set_state(std::span<const double> position, std::span<const double> velocity,
                 std::span<const double> acceleration);

 private:
  std::vector<double> acceleration_;  ///< of a given state
  void begin_interval(double t_begin, double t_end);
  enum class Kind { rest, cubic, straight, given } kind_ = Kind::rest;
  double t_begin_ = 0.0;
  double t_end_ = 0.0;
  std::vector<double> x0_, v0_, x1_, v1_;
};

}  // namespace ocublast::flow
