#pragma once

#include <array>
#include <string_view>

namespace ocublast::flow {

/// Free air: a sphere far from the ground. Surface: a hemisphere on it.
enum class BurstKind { free_air, surface };

enum class BlastQuantity {
  incident_pressure,   ///< Pa, peak overpressure
  reflected_pressure,  ///< Pa, peak overpressure at a wall, normal incidence
  incident_impulse,    ///< Pa s/kg^(1/3), of the positive phase
  reflected_impulse,   ///< Pa s/kg^(1/3)
  arrival_time,        ///< s/kg^(1/3)
  positive_duration,   ///< s/kg^(1/3)
  shock_velocity       ///< m/s
};

/// Range of scaled distance Z [m/kg^(1/3)] in which a curve holds.
struct ScaledRange {
  double min = 0.0, max = 0.0;
};
[[nodiscard]] ScaledRange kingery_bulmash_range(BurstKind burst, BlastQuantity quantity);

/// Curve of Kingery and Bulmash (1984), ARBRL-TR-02555, for TNT in air at sea level: 10^(sum c_i
/// U^i), U = K0 + K1 log10 Z. Times and impulses are per cube root of the charge mass. Throws
/// CaseError outside the range.
[[nodiscard]] double kingery_bulmash(BurstKind burst, BlastQuantity quantity,
                                     double scaled_distance);

/// Wave form p(t) = peak (1 - s) exp(-decay s), s = (t - arrival)/duration, at one place.
struct BlastWaveForm {
  double peak = 0.0;      ///< Pa
  double arrival = 0.0;   ///< s
  double duration = 0.0;  ///< s
  double decay = 0.0;     ///< 1
  /// Overpressure [Pa] at time t [s]; the negative phase as the formula gives it.
  [[nodiscard]] double overpressure(double t) const;
};

/// Decay b of a Friedlander wave with peak P, duration d and impulse I: P d (b - 1 + exp(-b)) = I
/// b^2, by Newton's method.
[[nodiscard]] double friedlander_decay(double peak, double duration, double impulse);

/// Incident (or normally reflected) wave of a charge [kg of TNT] at a distance [m].
[[nodiscard]] BlastWaveForm blast_wave_form(BurstKind burst, double charge_mass, double distance,
                                            bool reflected);

}  // namespace ocublast::flow
