#pragma once

#include <array>
#include <memory>
#include <vector>

#include "flow_solver/grid/grid.hpp"
#include "flow_solver/sources/ball_wave.hpp"
#include "flow_solver/sources/jwl_wave.hpp"
#include "flow_solver/sources/kingery_bulmash.hpp"
#include "flow_solver/step.hpp"

namespace ocublast::flow::inline OCU_PRECISION {

/// Ball of hot gas in air (gamma 1.4) that stands for 1 kg of TNT, calibrated against the free-air
/// curves of Kingery and Bulmash for Z = 2 to 10 m/kg^(1/3): no point or ball with the heat of
/// detonation meets them (4.2 MJ/kg is 20 to 27 % low there; afterburning adds energy later).
/// Nearer, use the JWL start.
struct TntCalibration {
  double energy = 6.05e6;  ///< J/kg above ambient
  double radius = 0.38;    ///< m/kg^(1/3)
  double mass = 0.43;      ///< kg/kg above ambient
  double delay = 0.17e-3;  ///< s/kg^(1/3) from detonation to the ball
  /// Energy of a charge on the ground against one in the air: a rigid plane doubles, ground takes
  /// its part.
  double surface_share = 0.872;
};

/// Mass of TNT in air [kg] whose wave is that of `mass` on the ground, mirrored at the plane: 2 x
/// share.
[[nodiscard]] double mirrored_tnt_mass(double mass, BurstKind burst);

/// The calibrated ball of a charge [kg of TNT]; on the ground: the whole ball of which the upper
/// half counts.
[[nodiscard]] BallStart tnt_ball(double mass, BurstKind burst);
/// Time from detonation to the ball [s].
[[nodiscard]] double tnt_delay(double mass, BurstKind burst);

/// A spherical wave at a place.
struct PlacedWave {
  std::array<double, 3> center{};  ///< m
  std::shared_ptr<RadialWave> wave;
  double delay = 0.0;  ///< s, from detonation to the wave's time 0
};

/// Waves from outside as the gas beyond the domain's open faces sees them: ambient plus the changes
/// by each wave, right as long as they do not overlap at full strength. Time 0 is `start` after
/// detonation.
class IncidentWaves final : public IncomingGas {
 public:
  IncidentWaves(const State& ambient, std::vector<PlacedWave> waves, double start)
      : ambient_(ambient), waves_(std::move(waves)), start_(start) {}
  /// Makes the times [begin, end] of the run known, s; to be called before each step. `begin` never
  /// falls.
  void cover(double begin, double end);
  [[nodiscard]] State at(double t, double x, double y, double z) const override;

 private:
  State ambient_;
  std::vector<PlacedWave> waves_;
  double start_;
};

/// Wave prescribed by the curves of Kingery and Bulmash: pressure of their wave form; density and
/// velocity behind the front from the Rankine-Hugoniot relations, then isentropic and in proportion
/// to the overpressure. Good where the front is weak (Z > 2).
class PrescribedWave final : public RadialWave {
 public:
  /// `mass` [kg of TNT]; places up to `r_max` [m]. Throws CaseError where the curves end.
  PrescribedWave(const Gas& gas, const State& ambient, BurstKind burst, double mass, double r_min,
                 double r_max);
  void cover(double, double) override {}
  [[nodiscard]] RadialState at(double r, double t) const override;
  [[nodiscard]] double front_radius(double t) const override;

 private:
  [[nodiscard]] BlastWaveForm form(double r) const;
  Gas gas_;
  State ambient_;
  double r_min_, step_;  ///< m, and by index in log r
  std::vector<BlastWaveForm> forms_;
};

/// What a wave brought to a grid.
struct MappedCharge {
  double time = 0.0;          ///< s after detonation
  double front = 0.0;         ///< m
  double energy = 0.0;        ///< J above ambient on the grid
  double energy_asked = 0.0;  ///< J, that of the wave in the domain
  double mass = 0.0;          ///< kg above ambient on the grid
  double mass_asked = 0.0;    ///< kg
};

/// Changes of the conserved state [5 per cell, n_k n_j n_i]: density, momenta, energy.
struct WaveOnGrid {
  std::vector<std::array<double, 5>> change;
  MappedCharge report;
};

/// Cell means of a wave's state above ambient at its latest step, on any grid: mass, momentum and
/// total energy are averaged over each cell, then mass and energy are corrected in proportion to
/// their local magnitudes so that the sums equal those of the wave's share inside the domain
/// (planes of symmetry through the centre cut it). The front must not have left the domain
/// otherwise.
[[nodiscard]] WaveOnGrid make_wave_on_grid(const Grid& grid, const SteppedWave& wave,
                                           const std::array<double, 3>& center);

/// Distance from a point, over the present directions of a grid.
[[nodiscard]] double distance_from(const Grid& grid, const std::array<double, 3>& center,
                                   const std::array<double, 3>& x);

}  // namespace ocublast::flow
